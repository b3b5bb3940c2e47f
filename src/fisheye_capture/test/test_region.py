"""Regions of a frame: where they lie, and what is refused."""

import numpy as np
import pytest

from fisheye_capture.region import Region, region_named
from fisheye_capture.source import Frame, JpegFrame
from fisheye_capture.synthetic import synthetic_lens
from fisheye_core.errors import ImageFormatError, SettingError
from fisheye_geometry.camera import Camera
from fisheye_testing.mjpeg_server import jpeg

NUMBERED = np.arange(5 * 7 * 3, dtype=np.uint8).reshape(5, 7, 3)


@pytest.mark.parametrize(
    ('name', 'rows', 'columns'),
    [
        ('left', slice(0, 5), slice(0, 3)),
        ('right', slice(0, 5), slice(4, 7)),
        ('top', slice(0, 2), slice(0, 7)),
        ('bottom', slice(3, 5), slice(0, 7)),
        ('1,2,4,3', slice(2, 5), slice(1, 5)),
        (' 0, 0, 7, 5 ', slice(0, 5), slice(0, 7)),
    ],
)
def test_where_a_region_lies(name, rows, columns):
    frame = Region(name).frame(Frame(3, NUMBERED))
    assert frame.stamp_ns == 3
    assert frame.jpeg is None
    assert np.array_equal(frame.image, NUMBERED[rows, columns])
    assert frame.size == frame.image.shape[1::-1]
    assert np.shares_memory(frame.image, NUMBERED)
    assert np.array_equal(Region(name).cut(NUMBERED[..., 0]), NUMBERED[rows, columns, 0])


@pytest.mark.parametrize(
    'name', ['middle', '1,2,3', '1,2,3,4,5', '-1,0,3,3', '0,0,0,3', '0,0,3,0', 'Left', '1;2;3;4']
)
def test_what_names_no_region(name):
    with pytest.raises(SettingError, match=f"front.region is '{name}'; expected left, right, top"):
        Region(name, 'front.region')


@pytest.mark.parametrize('name', ['4,0,4,5', '0,3,7,3', '7,0,1,1', '0,5,1,1'])
def test_a_region_outside_the_frame(name):
    words = f"region '{name}' reaches outside the frame of 7x5 px; expected x . w up to 7"
    with pytest.raises(ImageFormatError, match=words):
        Region(name).frame(Frame(0, NUMBERED))


def test_a_frame_too_small_to_be_halved():
    with pytest.raises(ImageFormatError, match='outside the frame of 1x5 px'):
        Region('right').cut(NUMBERED[:, :1])


def test_regions_of_a_coded_frame_decode_it_once_and_only_when_asked():
    whole = JpegFrame(0, np.frombuffer(jpeg(90, 32, 24), np.uint8), (32, 24), 'bgr8')
    left, right = (Region(name).frame(whole) for name in ('left', 'right'))
    assert 'image' not in vars(whole)
    assert left.image.shape == right.image.shape == (24, 16, 3)
    assert np.shares_memory(left.image, whole.image)
    assert np.shares_memory(right.image, whole.image)


def test_the_camera_of_a_region_sees_what_the_whole_one_sees_there():
    camera = Camera('both', synthetic_lens(640, 480, np.radians(170)))
    part = Region('320,0,320,480').camera(camera)
    ray = np.array([0.3, 0.1, 1.0])
    whole_px, _ = camera.lens.project(ray)
    part_px, _ = part.lens.project(ray)
    assert whole_px - part_px == pytest.approx([320, 0])


def test_no_name_is_the_whole_frame():
    assert region_named('') is None
    assert region_named('top').name == 'top'
