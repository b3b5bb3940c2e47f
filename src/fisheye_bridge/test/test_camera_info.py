"""CameraInfo: there and back, and what is no calibration refused."""

import numpy as np
import pytest
from fisheye_msgs.msg import Projection
from std_msgs.msg import Header

from fisheye_bridge.camera_info import camera_info_of, camera_of, lens_of
from fisheye_bridge.projection import projection_of, surface_of
from fisheye_core.errors import CalibrationError, GeometryError
from fisheye_geometry.camera_file import Camera
from fisheye_geometry.lens import make_lens
from fisheye_geometry.surface import Surface

LENS = make_lens('equidistant', 640, 480, [223, 0, 319, 0, 224, 239, 0, 0, 1], [0.1, 0, 0, 0])


def test_a_camera_comes_back():
    message = camera_info_of(Camera('left', LENS), Header(frame_id='here'))
    assert (message.distortion_model, message.header.frame_id) == ('equidistant', 'here')
    assert message.p[:4].tolist() == [223, 0, 319, 0]
    again = camera_of(message, 'left')
    assert again.lens == LENS
    assert camera_info_of(again, message.header) == message


@pytest.mark.parametrize(
    ('change', 'words'),
    [
        ({'k': [0.0] * 9}, 'not calibrated'),
        ({'binning_x': 641}, 'binning_x is 641; expected up to 640 px'),
        ({'r': [float('nan')] * 9}, 'R holds nan; expected finite numbers'),
        ({'p': [float('inf')] * 12}, 'P holds inf; expected finite numbers'),
        ({'distortion_model': 'unheard'}, "'unheard' is not known"),
        ({'d': [0.1]}, '1 distortion coefficients'),
        ({'width': 0}, 'width is 0 px'),
    ],
)
def test_what_is_no_calibration_is_refused(change, words):
    message = camera_info_of(Camera('left', LENS), Header())
    for name, value in change.items():
        setattr(message, name, value)
    with pytest.raises(CalibrationError, match=words):
        camera_of(message)


def test_a_cropped_and_binned_camera_is_that_of_its_pictures():
    message = camera_info_of(Camera('left', LENS), Header())
    message.binning_x, message.binning_y = 2, 1
    roi = message.roi
    roi.x_offset, roi.y_offset, roi.width, roi.height = 100, 40, 320, 240
    lens = camera_of(message).lens
    assert (lens.width, lens.height) == (160, 240)
    ray, _ = LENS.unproject(np.array([300.5, 100.0]))  # between two pixels that became one
    assert lens.project(ray)[0] == pytest.approx([100.0, 60.0])


def test_a_lens_needs_neither_r_nor_p():
    message = camera_info_of(Camera('left', LENS), Header())
    message.r, message.p = [float('nan')] * 9, [float('inf')] * 12
    assert lens_of(message) == LENS


def test_a_crop_that_is_not_on_the_sensor_is_refused():
    message = camera_info_of(Camera('left', LENS), Header())
    message.roi.x_offset, message.roi.width, message.roi.height = 400, 320, 240
    with pytest.raises(CalibrationError, match='roi has 320 px from 400 on along x'):
        camera_of(message)


def test_a_surface_comes_back():
    surface = Surface('cylindrical', 662, 872, 223.05, 330.4, 435.5)
    assert surface_of(projection_of(surface, Header())) == surface
    with pytest.raises(GeometryError, match="surface '' is not known"):
        surface_of(Projection())
