"""The undistort node over real rclpy: corrected pictures, and nonsense kept away."""

import time
from math import radians

import cv2
import numpy as np
import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from fisheye_msgs.msg import Projection
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import CameraInfo, Image, RegionOfInterest
from std_msgs.msg import Header

from fisheye_bridge.camera_info import camera_info_of
from fisheye_bridge.images import to_array
from fisheye_bridge.projection import surface_of
from fisheye_bridge.qos import IMAGE, LATCHED
from fisheye_geometry.attitude import Attitude, quaternion
from fisheye_geometry.camera_file import Camera
from fisheye_geometry.lens import make_lens
from fisheye_testing.image_message import to_message
from fisheye_testing.waiting import wait_for
from fisheye_undistort.undistort_node import UndistortNode
from fisheye_undistort.undistort_settings import UndistortSettings

DEADLINE_S = 10.0
LENS = make_lens('equidistant', 160, 120, [54, 0, 79.5, 0, 54, 59.5, 0, 0, 1], [0, 0, 0, 0])
PICTURE = np.full((120, 160, 3), 200, np.uint8)


class Bench:
    """The node between a publisher and subscribers, spun by hand."""

    def __init__(self, name, qos=IMAGE, **parameters):
        self._context = rclpy.Context()
        rclpy.init(context=self._context)
        overrides = [Parameter(key, value=value) for key, value in parameters.items()]
        common = {'context': self._context, 'namespace': f'/{name}'}
        self.node = UndistortNode(parameter_overrides=overrides, **common)
        self._tester = rclpy.create_node('tester', **common)
        self.pictures, self.projections, self._stamp = [], [], 0
        self._raw = self._tester.create_publisher(Image, 'image_raw', qos)
        self._info = self._tester.create_publisher(CameraInfo, 'camera_info', qos)
        self._tester.create_subscription(Image, 'image_rect', self.pictures.append, IMAGE)
        self._tester.create_subscription(
            Projection, 'projection', self.projections.append, LATCHED
        )
        self._statuses = []
        self._tester.create_subscription(DiagnosticArray, '/diagnostics', self._take_status, 10)
        self._executor = SingleThreadedExecutor(context=self._context)
        for node in (self.node, self._tester):
            self._executor.add_node(node)

    def send(self, picture=PICTURE, encoding='bgr8', lens=LENS, **wrong):
        self._stamp += 1
        header = Header(frame_id='left_optical_frame')
        header.stamp.nanosec = self._stamp
        if lens is not None:
            info = camera_info_of(Camera('left', lens), header)
            for key, value in wrong.items():
                setattr(info, key, value)
            self._info.publish(info)
        if picture is None:
            return
        message = to_message(picture, 'bgr8' if picture.ndim == 3 else 'mono8', header)
        message.encoding = encoding
        self._raw.publish(message)

    def until(self, condition, what, **sending):
        deadline = time.monotonic() + DEADLINE_S
        while not condition():
            assert time.monotonic() < deadline, what
            self.send(**sending)
            for _ in range(6):
                self._executor.spin_once(timeout_sec=0.01)

    def told(self):
        """Return what the node warns of in its diagnostics."""
        status = self.status()
        return '' if status.level == DiagnosticStatus.OK else status.message

    def status(self):
        """Return the node's next diagnostics."""
        self._statuses.clear()
        wait_for(
            lambda: self._executor.spin_once(timeout_sec=0.01) or self._statuses,
            what='diagnostics',
        )
        return self._statuses[0]

    def refused(self):
        """Return how many pictures were refused."""
        values = {entry.key: entry.value for entry in self.status().values}
        return int(values['pictures refused'])

    def _take_status(self, message):
        self._statuses += [
            s for s in message.status if s.hardware_id == self.node.get_fully_qualified_name()
        ]

    def close(self):
        self._executor.shutdown()
        self.node.destroy_node()
        self._tester.destroy_node()
        rclpy.shutdown(context=self._context)


@pytest.fixture
def make_bench(request):
    benches = []

    def make(**parameters):
        name = ''.join(c if c.isalnum() else '_' for c in request.node.name)
        benches.append(Bench(name, **parameters))
        return benches[-1]

    yield make
    for bench in benches:
        bench.close()


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
    bench.until(lambda: len(bench.pictures) > 10, 'pictures')
    assert len(bench.projections) == 1
    longer = make_lens('equidistant', 160, 120, [60, 0, 79.5, 0, 60, 59.5, 0, 0, 1], [0] * 4)
    bench.until(lambda: len(bench.projections) == 2, 'another projection', lens=longer)
    assert bench.projections[-1].focal_px == 60


@pytest.mark.parametrize(
    'wrong',
    [
        {'k': [0.0] * 9},
        {'k': [float('nan')] * 9},
        {'distortion_model': 'unheard_of'},
        {'d': [0.1, 0.2]},
        {'width': 0},
        {'width': 320, 'height': 240},
        {'k': [1e300, 0.0, 79.5, 0.0, 1e300, 59.5, 0.0, 0.0, 1.0]},
        {'binning_x': 4},
    ],
)
def test_a_nonsense_camera_info_leaves_the_good_one_in_use(make_bench, wrong):
    bench = make_bench()
    bench.until(lambda: bench.pictures, 'a picture')
    bench.pictures.clear()
    bench.until(lambda: len(bench.pictures) > 3, 'pictures still', **wrong)
    bench.until(lambda: len(bench.pictures) > 6, 'pictures with the good one again')
    assert len(bench.projections) == 1


def test_a_binned_and_cropped_camera_is_corrected_like_the_whole_one(make_bench):
    whole = make_lens(
        'equidistant', 400, 300, [108, 0, 209.5, 0, 108, 149.5, 0, 0, 1], [0, 0, 0, 0]
    )
    roi = RegionOfInterest(x_offset=50, y_offset=30, width=320, height=240)
    bench = make_bench()
    bench.until(
        lambda: bench.pictures and bench.projections,
        'a corrected picture',
        lens=whole,
        binning_x=2,
        binning_y=2,
        roi=roi,
    )
    assert surface_of(bench.projections[-1]) == UndistortSettings().surface_of(LENS)


def test_a_binning_that_does_not_fit_the_pictures_is_named(make_bench):
    bench = make_bench()
    bench.until(lambda: bench.pictures, 'a picture')
    bench.until(lambda: bench.told(), 'the refusal', binning_x=4)
    assert bench.told() == (
        'camera_info refused: 40x120 px (160x120 px with binning 4x1, roi all at (0, 0)) do not '
        'fit the pictures, which have 160x120 px'
    )


def test_a_lens_that_ends_within_its_pictures_is_told(make_bench):
    ending = make_lens(
        'equidistant', 160, 120, [60, 0, 79.5, 0, 60, 59.5, 0, 0, 1], [-0.45, 0, 0, 0]
    )
    bench = make_bench()
    bench.until(lambda: 'ends' in bench.told(), 'the note', lens=ending)
    assert 'camera_info: the distortion of the lens ends 49.3 degrees off its axis' in bench.told()


def test_a_dark_rim_is_known_before_the_first_projection_is_told(make_bench):
    y, x = np.mgrid[:120, :160]
    circle = np.where(np.hypot(x - 79.5, y - 59.5) < 50, 200, 0).astype(np.uint8)
    bench = make_bench()
    bench.until(lambda: len(bench.pictures) > 6, 'pictures', picture=cv2.merge([circle] * 3))
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
