"""Coarse proposals: pairs of pictures that are too dark and noisy for features."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from seeing import apart_deg, see, turned, world

from panorama_stitch.overlap.coarse import coarse_rotations
from panorama_stitch.overlap.correspondences import match_features
from panorama_stitch.overlap.features import find_features
from panorama_stitch.overlap.rotation import added, propose_rotations

NEAR_DEG = 5.0
"""From so far away the votes find it."""
YAW = 130.0
DIM = 0.08 * (world(1) - 128) + 60
"""Hardly above the noise."""


def dim_pair(left, right):
    views = see(DIM, left), see(DIM, right, seed=1)
    return views, left.inv() * right


@pytest.mark.parametrize(
    ('left', 'right'),
    [
        (turned(yaw=-YAW / 2), turned(yaw=YAW / 2)),
        (turned(yaw=-YAW / 2, pitch=-17), turned(yaw=YAW / 2, pitch=-17)),
        (turned(yaw=-YAW / 2, pitch=3, roll=5), turned(yaw=YAW / 2, pitch=-4, roll=4)),
        (turned(yaw=-YAW / 2, roll=180), turned(yaw=YAW / 2, roll=180)),
    ],
    ids=['level', 'down', 'askew', 'upside down'],
)
def test_what_is_seen_coarsely_is_proposed(left, right):
    views, truth = dim_pair(left, right)
    found = coarse_rotations(*views, [view.usable for view in views])
    assert min(apart_deg(Rotation.from_matrix(one), truth) for one in found[:3]) < NEAR_DEG


def test_what_is_known_is_not_proposed_again():
    views, truth = dim_pair(turned(yaw=-YAW / 2), turned(yaw=YAW / 2))
    usable = [view.usable for view in views]
    matches = match_features(*map(find_features, views, usable), static=True)
    known = {'near': None, 'within_rad': np.pi}
    proposals = propose_rotations(matches, 8, **known)
    coarse = coarse_rotations(*views, usable)
    more = added(proposals, coarse, 5, matches, **known)
    assert 0 < len(more) <= 5
    again = added([*proposals, *more], [one.matrix for one in more], 5, matches, **known)
    assert again == []
    near = {'near': truth.as_matrix(), 'within_rad': np.radians(10)}
    for one in added([], coarse, 5, matches, **near):
        assert apart_deg(Rotation.from_matrix(one.matrix), truth) < 10
