"""The undistort node over real rclpy: corrected pictures, and nonsense kept away."""

from math import radians

import cv2
import numpy as np
import pytest
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile, ReliabilityPolicy
from undistort_bench import LENS

from fisheye_bridge.images import to_array
from fisheye_bridge.projection import surface_of
from fisheye_geometry.attitude import Attitude, quaternion
from fisheye_geometry.lens import make_lens
from fisheye_undistort.undistort_settings import UndistortSettings


def test_pictures_are_corrected_and_their_projection_is_told(make_bench):
    bench = make_bench()
    bench.until(lambda: bench.pictures and bench.projections, 'a corrected picture')
    surface = surface_of(bench.projections[-1])
    assert surface == UndistortSettings().surface_of(LENS)
    picture, encoding = to_array(bench.pictures[-1])
    assert (encoding, picture.shape) == ('bgr8', (surface.height, surface.width, 3))
    assert set(np.unique(picture)) == {0, 200}
    assert bench.pictures[-1].header.frame_id == 'left_optical_frame'
    assert bench.pictures[-1].header.stamp.nanosec > 0


@pytest.mark.parametrize(
    ('pitch_deg', 'roll_deg'), [(-20.0, 0.0), (0.0, 180.0), (-12.0, 90.0), (10.0, -7.0)]
)
def test_a_tilted_camera_is_corrected_level_and_its_yaw_is_told(make_bench, pitch_deg, roll_deg):
    bench = make_bench(yaw_deg=30.0, pitch_deg=pitch_deg, roll_deg=roll_deg)
    attitude = Attitude(radians(30), radians(pitch_deg), radians(roll_deg))
    at_px = np.array([[95.0, 72.0], [68.0, 50.0]])
    picture = np.full((LENS.height, LENS.width, 3), 100, np.uint8)
    for x, y in at_px.astype(int):
        cv2.circle(picture, (int(x), int(y)), 3, (255, 255, 255), -1)
    bench.until(
        lambda: bench.pictures and bench.projections, 'a corrected picture', picture=picture
    )
    projection = bench.projections[-1]
    q = projection.orientation
    assert (q.x, q.y, q.z, q.w) == pytest.approx(quaternion(Attitude(radians(30))))
    level = LENS.unproject(at_px)[0] @ attitude.matrix.T
    turned = level @ Attitude(radians(30)).matrix
    corrected = to_array(bench.pictures[-1])[0]
    for (x, y), seen in zip(*surface_of(projection).project(turned), strict=True):
        assert seen
        assert corrected[round(y), round(x), 0] > 200
    lit = corrected[..., 0] > 0
    assert lit.any(axis=1)[[0, -1]].all(), 'no more rows than the camera sees'


def test_live_angles_are_taken(make_bench):
    bench = make_bench()
    bench.until(lambda: bench.projections, 'a projection')
    level = surface_of(bench.projections[-1])
    bench.node.set_parameters([Parameter('pitch_deg', value=-15.0)])
    bench.until(lambda: surface_of(bench.projections[-1]) != level, 'a level surface')
    assert surface_of(bench.projections[-1]).center_y_px < level.center_y_px


def test_a_camera_that_publishes_best_effort_is_taken_as_such(make_bench):
    bench = make_bench(qos=QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT))
    bench.until(lambda: bench.pictures and bench.projections, 'a corrected picture')


def test_what_is_seen_is_never_0(make_bench):
    bench = make_bench()
    bench.until(
        lambda: bench.pictures,
        'a picture',
        picture=np.zeros((120, 160), np.uint8),
        encoding='mono8',
    )
    assert set(np.unique(to_array(bench.pictures[-1])[0])) == {0, 1}


def test_the_maps_are_rebuilt_only_for_a_real_change(make_bench):
    bench = make_bench()
    bench.until(lambda: len(bench.pictures) > 10 and bench.projections, 'pictures')
    assert len(bench.projections) == 1
    longer = make_lens('equidistant', 160, 120, [60, 0, 79.5, 0, 60, 59.5, 0, 0, 1], [0] * 4)
    bench.until(lambda: len(bench.projections) == 2, 'another projection', lens=longer)
    assert bench.projections[-1].focal_px == 60


def test_a_dark_rim_is_known_before_the_first_projection_is_told(make_bench):
    y, x = np.mgrid[:120, :160]
    circle = np.where(np.hypot(x - 79.5, y - 59.5) < 50, 200, 0).astype(np.uint8)
    bench = make_bench()
    bench.until(
        lambda: len(bench.pictures) > 6 and bench.projections,
        'pictures',
        picture=cv2.merge([circle] * 3),
    )
    (projection,) = bench.projections
    assert projection.width < UndistortSettings().surface_of(LENS).width


def test_a_projection_is_told_even_before_pictures_come(make_bench):
    bench = make_bench()
    bench.until(lambda: bench.projections, 'a projection', picture=None)


def test_unusable_pictures_are_dropped_and_counted(make_bench):
    bench = make_bench()
    bench.until(lambda: bench.pictures, 'a picture')
    small = np.zeros((12, 16, 3), np.uint8)
    for sending in ({'encoding': '16UC1'}, {'picture': small}, {'encoding': 'bgra8'}):
        before = bench.refused()
        bench.until(lambda before=before: bench.refused() > before, 'refusal', **sending)
    count = len(bench.pictures)
    bench.until(lambda: len(bench.pictures) > count, 'a picture again')


def test_live_parameters_apply_and_impossible_ones_are_refused(make_bench):
    bench = make_bench()
    bench.until(lambda: bench.pictures, 'a picture')

    def change(**values):
        return bench.node.set_parameters([Parameter(k, value=v) for k, v in values.items()])[0]

    assert change(scale='fit').successful
    bench.until(lambda: bench.pictures[-1].width == 160, 'the picture at its own size')
    refused = change(surface='spherical')
    assert (refused.successful, 'expected one of cylindrical' in refused.reason) == (False, True)
    assert change(surface='rectilinear', hfov_deg=100).successful
    refused = change(hfov_deg=175.0)
    assert 'holds less than 170 degrees; 175 were asked' in refused.reason


def test_the_parameters_are_taken_at_start(make_bench):
    bench = make_bench(surface='equirectangular', interpolation='nearest', hfov_deg=100)
    bench.until(lambda: bench.projections, 'a projection')
    assert bench.projections[0].surface == 'equirectangular'
    assert bench.projections[0].width == round(np.radians(100) * 54)
