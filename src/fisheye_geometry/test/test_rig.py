"""Rigs: pairs, chains of rotations, and rings that close or do not."""

import numpy as np
import pytest

from fisheye_core.errors import GeometryError
from fisheye_geometry.attitude import Attitude, angle_between, rotation_matrix
from fisheye_geometry.lens import make_lens
from fisheye_geometry.rig import Rig, RigCamera, chain, pairs_of, unwrapped

LENS = make_lens('plumb_bob', 100, 80, [80, 0, 49.5, 0, 80, 39.5, 0, 0, 1], [])
RING = [
    Attitude(*np.radians(angles)).matrix
    for angles in ((-135, -6, 1), (-45, -8, -2), (45, -5, 2), (135, -7, 0))
]
EXACT = 1e-9


def rotations(attitudes, pairs):
    return [attitudes[left].T @ attitudes[right] for left, right in pairs]


def camera(name):
    return RigCamera(name, LENS, Attitude())


def test_pairs():
    assert pairs_of(3) == ((0, 1), (1, 2))
    assert pairs_of(3, is_closed=True) == ((0, 1), (1, 2), (2, 0))
    assert pairs_of(2, is_closed=True) == ((0, 1), (1, 0))
    assert pairs_of(1, is_closed=True) == ()


def test_a_chain_gives_the_attitudes_back():
    found = chain(rotations(RING, pairs_of(4)))
    for attitude, truth in zip(found.attitudes, RING, strict=True):
        assert attitude == pytest.approx(RING[0].T @ truth, abs=EXACT)
    assert not found.is_closed
    assert chain(rotations(RING, pairs_of(4)), ring='closed').is_closed


def test_the_residue_of_a_ring_is_told_and_spread_evenly():
    measured = rotations(RING, pairs_of(4, is_closed=True))
    measured[2] = measured[2] @ rotation_matrix(np.radians([0.8, -1.0, 0.5]))
    found = chain(measured[:-1], measured[-1])
    residue_deg = np.linalg.norm([0.8, 1.0, 0.5])
    assert found.is_closed
    assert np.degrees(found.residue_rad) == pytest.approx(residue_deg)
    assert f'{residue_deg:.2f} degrees' in found.message
    spread = rotations(found.attitudes, pairs_of(4, is_closed=True))
    turned = [angle_between(*pair) for pair in zip(measured, spread, strict=True)]
    assert np.degrees(turned) == pytest.approx([residue_deg / 4] * 4)


def test_a_ring_that_misses_by_more_than_three_degrees_is_not_closed():
    measured = rotations(RING, pairs_of(4, is_closed=True))
    closing = measured[-1] @ Attitude(np.radians(3.4)).matrix
    found = chain(measured[:-1], closing)
    assert not found.is_closed
    assert 'not closed: the rotations around it miss by 3.4 degrees, more than 3' in found.message
    assert found.attitudes[3] == pytest.approx(RING[0].T @ RING[3], abs=EXACT)


def test_an_open_ring_stays_open():
    measured = rotations(RING, pairs_of(4, is_closed=True))
    assert not chain(measured[:-1], measured[-1], ring='open').is_closed


def test_bearings_go_on_to_the_right():
    assert unwrapped(np.radians([90, 180, -90])) == pytest.approx(np.radians([90, 180, 270]))
    assert unwrapped(np.radians([-90, 90.4])) == pytest.approx(np.radians([-90, 90.4]))
    assert unwrapped(np.radians([70, -70])) == pytest.approx(np.radians([70, -70]))


@pytest.mark.parametrize(
    ('names', 'words'),
    [((), 'has 0 cameras; expected 1 to 8'), ('abcdefghi', 'has 9 cameras'), ('aa', 'different')],
)
def test_impossible_rigs_are_refused(names, words):
    with pytest.raises(GeometryError, match=words):
        Rig(tuple(map(camera, names)))


def test_a_rig_knows_its_pairs_and_what_lies_between_them():
    cameras = [RigCamera(n, LENS, Attitude.of(m)) for n, m in zip('abcd', RING, strict=True)]
    rig = Rig(tuple(cameras), is_closed=True)
    assert rig.pairs[-1] == (3, 0)
    assert [np.degrees(rig.yaw_between(pair)) for pair in rig.pairs] == pytest.approx([90] * 4)
    relative = rig.relative(rig.pairs[1])
    assert relative.matrix == pytest.approx(RING[1].T @ RING[2], abs=EXACT)
