"""Messages and files of any content: each is taken, or refused with one sentence."""

import os
import re
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from messages import camera_infos, compressed_images, images, projections

from fisheye_bridge.camera_info import camera_of
from fisheye_bridge.images import from_jpeg, to_array
from fisheye_bridge.projection import surface_of
from fisheye_bridge.stamps import ns_of, stamp_of
from fisheye_capture.synthetic import synthetic_lens
from fisheye_core.errors import FileAccessError, FileContentError, FisheyeError
from fisheye_geometry.camera_file import Camera, read_camera, write_camera
from fisheye_undistort.undistort_settings import UndistortSettings
from panorama_stitch.overlap.overlap_file import read_overlaps, write_overlaps
from panorama_stitch.overlap.overlap_result import Overlap

EXAMPLES = 3000 if os.environ.get('LONG') else 300
LENS = synthetic_lens(640, 480, 2.97)
SURFACE = UndistortSettings().surface_of(LENS)
OVERLAP = Overlap(method='particles', found=True, offset_x_px=545.0, offset_y_px=0.0)
NAMES = ('left', 'right')
BOMB = 'b0: &b0 [x, x, x, x, x, x, x, x, x, x]\n' + ''.join(
    f'b{i}: &b{i} [{", ".join([f"*b{i - 1}"] * 10)}]\n' for i in range(1, 12)
)
"""A few lines that mean 10 to the power of 12 entries."""
TOKEN = r'[^\s,\[\]{}]+|\n *'
SCALARS = [
    *(
        '.nan',
        '-.inf',
        '1e999',
        '-1',
        '0',
        '9' * 400,
        '0x' + 'f' * 5000,
        '9' * 5000,
        'true',
        'null',
        '2001-99-99',
    ),
    *('!!python/object/apply:os.system ["true"]', '!!binary x', '[1, [2]]', '{a: b}', '*b11'),
    *('!!bool maybe', '!!int ""', '!!timestamp x', '"\\UFFFFFFFF"', '[' * 20_000),
    *('&a *a', '"', '\t', '%YAML 9.9', '? - :', '\x00', 'é', '190:20:30', '<<', '"\\uD800"'),
]

examples = settings(
    max_examples=EXAMPLES,
    database=None,
    suppress_health_check=list(HealthCheck),
)


@examples
@given(images())
def test_images(message):
    with suppress(FisheyeError):
        assert to_array(message)[0].shape[:2] == (message.height, message.width)


@examples
@given(compressed_images())
def test_compressed_images(message):
    with suppress(FisheyeError):
        assert from_jpeg(message)[0].size


@examples
@given(camera_infos())
def test_a_camera_info_that_is_taken_can_be_saved_and_used_at_the_next_start(
    tmp_path_factory, message
):
    try:
        camera = camera_of(message, 'left')
    except FisheyeError:
        return
    path = tmp_path_factory.getbasetemp() / 'taken.yaml'
    write_camera(path, camera)
    again = read_camera(path)
    assert again.lens == camera.lens
    UndistortSettings().surface_of(again.lens)


@examples
@given(projections())
def test_projections_and_their_stamps(message):
    stamp = message.header.stamp
    again = stamp_of(ns_of(stamp))
    assert ns_of(again) == ns_of(stamp)
    with suppress(FisheyeError):
        surface_of(message)


@st.composite
def mutations(draw, text):
    """A file after a disk, an editor and an enemy had it."""
    for _ in range(draw(st.integers(1, 4))):
        spots = [match.span() for match in re.finditer(TOKEN, text)] or [(0, 0)]
        begin, end = draw(st.sampled_from(spots))
        text = draw(
            st.sampled_from(
                [
                    text[:begin],
                    text[:begin] + text[end:],
                    text[:end] + text[begin:],
                    text[:begin] + draw(st.sampled_from(SCALARS)) + text[end:],
                    text[:begin] + draw(st.text(max_size=5)) + text[end:],
                ]
            )
        )
    return draw(st.sampled_from(['', BOMB])) + text


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp('files')


def write_rig(path):
    write_overlaps(path, NAMES, (SURFACE, SURFACE), [OVERLAP])


def read_rig(path):
    return read_overlaps(path, NAMES, (SURFACE, SURFACE))


@pytest.mark.parametrize(
    ('write', 'read'),
    [
        (lambda path: write_camera(path, Camera('left', LENS)), read_camera),
        (write_rig, read_rig),
    ],
    ids=['calibration', 'overlap'],
)
def test_files(folder, write, read):
    path = Path(folder, 'file.yaml')
    write(path)
    read(path)
    good = path.read_text()

    def try_one(text):
        path.write_text(text, errors='surrogatepass')
        try:
            read(path)
        except (FileAccessError, FileContentError) as error:
            assert str(error).startswith(str(path))
            assert '\n' not in str(error)
            assert len(str(error)) < len(str(path)) + 1000

    for match in re.finditer(TOKEN, good):
        for scalar in SCALARS:
            try_one(
                (BOMB if '*' in scalar else '')
                + good[: match.start()]
                + scalar
                + good[match.end() :]
            )
    examples(given(mutations(good))(try_one))()
