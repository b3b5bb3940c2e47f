import os
import re
from dataclasses import replace
from math import radians

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fisheye_core.errors import FileAccessError, OverlapFileError
from fisheye_geometry.attitude import Attitude
from fisheye_geometry.surface import Surface
from panorama_stitch.overlap.overlap_file import read_overlaps, write_overlaps
from panorama_stitch.overlap.overlap_result import Overlap
from panorama_stitch.overlap.particles import Particle

CAMERAS = ('left', 'middle', 'right')
SURFACES = tuple(
    Surface('cylindrical', 662 + i, 872, 223.0528, 330.4 + i, 435.5) for i in range(3)
)
FIRST = Overlap(
    'particles',
    True,
    545.02,
    -1.25,
    Attitude(radians(140.0), radians(1.0), radians(0.8)),
    116.98,
    0.8125,
    message='found',
)
SECOND = Overlap('correlation', False, 663.0, 0.0, confidence=0.125, message='no common scene')


@pytest.fixture
def path(tmp_path):
    path = tmp_path / 'rig' / 'overlap.yaml'
    write_overlaps(path, CAMERAS, SURFACES, [FIRST, SECOND])
    return path


def edit(path, change):
    entries = yaml.safe_load(path.read_text())
    change(entries)
    path.write_text(yaml.safe_dump(entries))


def test_what_was_written_is_read_again(path):
    first, second = read_overlaps(path, CAMERAS, SURFACES)
    assert first.attitude.pitch_rad == pytest.approx(FIRST.attitude.pitch_rad)
    assert replace(first, attitude=FIRST.attitude, min_correlation_value=0.0) == replace(
        FIRST, min_correlation_value=0.0
    )
    assert second == replace(SECOND, min_correlation_value=second.min_correlation_value)


def test_a_file_in_the_home(monkeypatch, tmp_path):
    monkeypatch.setenv('HOME', str(tmp_path))
    write_overlaps('~/overlap.yaml', CAMERAS[:2], SURFACES[:2], [FIRST])
    assert (tmp_path / 'overlap.yaml').is_file()
    assert len(read_overlaps('~/overlap.yaml', CAMERAS[:2], SURFACES[:2])) == 1


def test_particles_are_not_kept(path):
    particle = Particle(*range(10))
    write_overlaps(
        path, CAMERAS[:2], SURFACES[:2], [replace(FIRST, left_particles=(particle,), left_match=0)]
    )
    (overlap,) = read_overlaps(path, CAMERAS[:2], SURFACES[:2])
    assert (overlap.left_particles, overlap.left_match) == ((), -1)


def test_rounding_of_a_calibration_does_not_matter(path):
    surfaces = [replace(s, focal_px=s.focal_px + 0.001) for s in SURFACES]
    assert read_overlaps(path, CAMERAS, surfaces)


@pytest.mark.parametrize(
    ('cameras', 'changes', 'sentence'),
    [
        (
            ('left', 'right'),
            {},
            "for the cameras 'left', 'middle', 'right'; these are left, right",
        ),
        (CAMERAS, {'kind': 'equirectangular'}, "at surface 'cylindrical'; now it is equirect"),
        (CAMERAS, {'focal_px': 230.0}, 'at focal_px 223.0528; now it is 230'),
    ],
)
def test_another_rig_is_refused(path, cameras, changes, sentence):
    surfaces = [replace(surface, **changes) for surface in SURFACES[: len(cameras)]]
    with pytest.raises(OverlapFileError, match=sentence) as error:
        read_overlaps(path, cameras, surfaces)
    assert str(path) in str(error.value)


def test_a_rotation_holds_for_any_part_of_what_the_cameras_see(path):
    cut = [surface.window(9, 5, surface.width - 30, 800) for surface in SURFACES]
    cut[1] = SURFACES[1].window(20, -6, 700, 900)
    first, second = read_overlaps(path, CAMERAS, cut)
    assert first.attitude == read_overlaps(path, CAMERAS, SURFACES)[0].attitude
    assert first.offset_x_px == pytest.approx(FIRST.offset_x_px - 9 + 20)
    assert first.offset_y_px == pytest.approx(FIRST.offset_y_px - 5 - 6)
    assert first.overlap_px == pytest.approx(632 - first.offset_x_px)
    assert (second.found, second.offset_x_px) == (False, 700)


@pytest.mark.parametrize(('version', 'attitude'), [(2, None), (1, FIRST.attitude)])
def test_an_offset_holds_for_the_surfaces_that_it_was_measured_on(path, version, attitude):
    flat = replace(FIRST, attitude=attitude)
    write_overlaps(path, CAMERAS[:2], SURFACES[:2], [flat])
    edit(path, lambda entries: entries.update(version=version))
    if version == 1:
        edit(path, lambda entries: entries['overlaps'][0].pop('yaw_deg'))
    assert read_overlaps(path, CAMERAS[:2], SURFACES[:2])
    wider = [replace(surface, width=700) for surface in SURFACES[:2]]
    with pytest.raises(OverlapFileError, match="camera 'left' at width 662; now it is 700"):
        read_overlaps(path, CAMERAS[:2], wider)


def test_another_lens_behind_a_surface_of_the_same_focal_length_is_refused(path):
    names = 'left', 'right'
    write_overlaps(path, names, SURFACES[:2], [FIRST], (223.0528, 250.0))
    assert read_overlaps(path, names, SURFACES[:2], (223.0528, 250.0))
    fitted = [surface.with_focal(200.0) for surface in SURFACES[:2]]
    (overlap,) = read_overlaps(path, names, fitted, (223.0528, 250.0))
    yaw_px = (545.02 + SURFACES[1].center_x_px - SURFACES[0].center_x_px) * 200.0 / 223.0528
    by_px = fitted[1].center_x_px - fitted[0].center_x_px
    assert overlap.offset_x_px == pytest.approx(yaw_px - by_px)
    with pytest.raises(OverlapFileError, match="'right' at lens_focal_px 250"):
        read_overlaps(path, names, SURFACES[:2], (223.0528, 260.0))


@pytest.mark.parametrize(
    ('change', 'sentence'),
    [
        (lambda e: e.update(version=3), 'version is 3; expected 1 or 2'),
        (lambda e: e.pop('version'), 'version is None; expected 1'),
        (lambda e: e.update(cameras='left'), "cameras is 'left'; expected a list"),
        (lambda e: e['cameras'][0].update(width='wide'), 'expected a block with surface, width'),
        (lambda e: e['cameras'][0].update(center_x_px=1e9), 'center_x_px is 1000000000.0; exp'),
        (lambda e: e.pop('overlaps'), 'overlaps is None; expected a list'),
        (lambda e: e['overlaps'].pop(), '1 overlaps for 3 cameras; expected one for each pair'),
        (lambda e: e['overlaps'].reverse(), "the overlap of 'left' and 'middle' is missing"),
        (lambda e: e['overlaps'][0].update(offset_x_px='far'), "offset_x_px of .* is 'far'"),
        (lambda e: e['overlaps'][0].update(roll_deg=float('nan')), 'roll_deg of .* is nan'),
        (lambda e: e['overlaps'][0].update(near_deg='far'), 'expected a finite number$'),
        (lambda e: e['overlaps'][1].update(found='no'), "found of .* is 'no'"),
        (lambda e: e['overlaps'][1].update(method='magic'), "method of .* is 'magic'"),
    ],
)
def test_a_broken_file_is_refused_with_a_sentence(path, change, sentence):
    edit(path, change)
    with pytest.raises(OverlapFileError, match=sentence):
        read_overlaps(path, CAMERAS, SURFACES)


def test_a_missing_file_is_none(tmp_path):
    assert read_overlaps(tmp_path / 'none.yaml', CAMERAS, SURFACES) is None
    assert read_overlaps('', CAMERAS, SURFACES) is None


def test_a_file_that_cannot_be_looked_at_is_told():
    with pytest.raises(FileAccessError, match='cannot be read: File name too long'):
        read_overlaps('x' * 5000, CAMERAS, SURFACES)


def test_nothing_but_the_file_is_left_behind(path):
    assert [entry.name for entry in path.parent.iterdir()] == [path.name]


def test_what_no_rig_can_have_is_refused(path):
    good = path.read_text()
    wrong = [('yaw_deg', 400), ('roll_deg', 190)]
    first = [('offset_x_px', 1e9), ('offset_y_px', -5000), ('roll_deg', 90)]
    for version, key, value in [(2, *each) for each in wrong] + [(1, *each) for each in first]:
        edited = good.replace('version: 2', f'version: {version}')
        path.write_text(re.sub(f'{key}: [^,}}]*', f'{key}: {value}', edited, count=1))
        with pytest.raises(OverlapFileError, match=f'{key} of .*; expected a finite number up to'):
            read_overlaps(path, CAMERAS, SURFACES)


@settings(max_examples=500, suppress_health_check=list(HealthCheck))
@given(
    at=st.integers(0, 1500),
    count=st.integers(0, 40),
    piece=st.sampled_from(
        [
            '!!bool ',
            '!!int ""',
            '&a ',
            '*a',
            '"\\UFFFFFFFF"',
            '[' * 99,
            '1e999',
            '\t',
            '- {',
            '0: ',
        ]
    )
    | st.text(max_size=3),
)
def test_a_file_that_was_changed_anyhow_is_read_or_refused(path, at, count, piece):
    good = path.read_text()
    changed = path.with_name('changed.yaml')
    changed.write_text(good[:at] + piece + good[at + count :], encoding='utf-8')
    try:
        overlaps = read_overlaps(changed, CAMERAS, SURFACES)
    except OverlapFileError as error:
        assert str(changed) in str(error)
    else:
        assert [overlap.method for overlap in overlaps] == [FIRST.method, SECOND.method]


def test_a_fifo_is_refused_and_a_link_stays(tmp_path, path):
    os.mkfifo(tmp_path / 'fifo')
    with pytest.raises(FileAccessError, match='it is a FIFO; expected a regular file'):
        read_overlaps(tmp_path / 'fifo', CAMERAS, SURFACES)
    link = tmp_path / 'link.yaml'
    link.symlink_to(path)
    write_overlaps(link, CAMERAS[:2], SURFACES[:2], [FIRST])
    assert link.is_symlink()
    assert len(read_overlaps(path, CAMERAS[:2], SURFACES[:2])) == 1
