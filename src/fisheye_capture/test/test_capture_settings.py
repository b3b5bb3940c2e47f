"""Settings of a camera: what follows from its name."""

import pytest

from fisheye_capture.capture_settings import CaptureSettings


@pytest.mark.parametrize(('name', 'yaw_deg'), [('left', -70.0), ('right', 70.0), ('camera', 0.0)])
def test_the_name_gives_the_frame_and_the_place_in_the_published_rig(name, yaw_deg):
    named = CaptureSettings().named(name)
    assert (named.camera_name, named.frame_id) == (name, f'{name}_optical_frame')
    assert named.synthetic_yaw_deg == yaw_deg


def test_what_the_user_said_stays():
    settings = CaptureSettings(camera_name='nose', frame_id='frame', synthetic_yaw_deg=5.0)
    named = settings.named('left')
    assert (named.camera_name, named.frame_id, named.synthetic_yaw_deg) == ('nose', 'frame', 5.0)
