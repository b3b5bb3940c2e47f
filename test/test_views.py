"""Views as machines take them: from the running node, over DDS."""

import threading
from array import array

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Vector3Stamped
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from sensor_msgs.msg import CameraInfo, CompressedImage, Image

from fisheye_bridge.camera_info import lens_of
from fisheye_bridge.stamps import ns_of
from fisheye_capture.scene import Scene
from fisheye_geometry.attitude import Attitude
from fisheye_geometry.surface import Surface
from fisheye_testing.domains import unused_domain
from fisheye_testing.image_message import to_array
from fisheye_testing.rig import RigProcesses, camera_parameters
from fisheye_testing.waiting import wait_for
from fisheye_testing.watcher import Watcher

START_S = 40.0
FAITHFUL_DB = 24.0
"""Of a scene whose overlap was measured, seen through 640x480 px of 170 degrees."""
CLOSE_DEG = 0.5


class Consumer:
    """What a detector subscribes to: pictures and camera_info, joined by stamp."""

    def __init__(self, node, view):
        self.infos, self.images = {}, {}
        self.view, self.node = view, node
        self.subscriptions = [
            node.create_subscription(kind, f'{view}/{topic}', take, depth)
            for kind, topic, take, depth in (
                (CameraInfo, 'camera_info', lambda m: self.keep(self.infos, m), 100),
                (Image, 'image_raw', lambda m: self.keep(self.images, m), 5),
            )
        ]

    def keep(self, messages, message):
        messages[ns_of(message.header.stamp)] = message

    def both(self):
        """Return the newest pair (Image, CameraInfo), or None."""
        stamps = sorted(set(self.infos.copy()) & set(self.images.copy()))
        return (self.images[stamps[-1]], self.infos[stamps[-1]]) if stamps else None

    def leave(self):
        for subscription in self.subscriptions:
            self.node.destroy_subscription(subscription)


@pytest.fixture(scope='module')
def domain():
    return unused_domain()


@pytest.fixture(scope='module')
def watcher(domain):
    with Watcher(domain) as watcher:
        yield watcher


@pytest.fixture(scope='module')
def rig(domain, watcher, tmp_path_factory):
    """Run a panorama node with views of many kinds."""
    with RigProcesses(domain, tmp_path_factory.mktemp('log')) as rig:
        rig.start(
            'panorama',
            views='[front, right_view, rear, ptz]',
            **{'right_view.pitch_deg': -10.0, 'ptz.width': 320, 'ptz.height': 240},
        )
        wait_for(lambda: rig.check_alive() or watcher.is_measured, START_S, 'a measured overlap')
        yield rig
        rig.check_alive()


@pytest.fixture(scope='module')
def diagnosed(watcher):
    """Return what the panorama node says of itself, the newest last."""
    said = []

    def take(message):
        said.extend(status for status in message.status if status.name == 'panorama')

    watcher.node.create_subscription(DiagnosticArray, '/diagnostics', take, 10)
    return said


@pytest.fixture(scope='module')
def set_parameters(watcher):
    """Return a function that sets parameters of the panorama node and gives what it answers."""
    client = watcher.node.create_client(SetParameters, '/panorama/set_parameters')

    def change(**values):
        assert client.wait_for_service(START_S)
        request = SetParameters.Request(
            parameters=[
                Parameter(name.replace('__', '.'), value=value).to_parameter_msg()
                for name, value in values.items()
            ]
        )
        done = threading.Event()
        future = client.call_async(request)
        future.add_done_callback(lambda _: done.set())
        assert done.wait(START_S)
        return future.result().results

    return change


def truth(info, image, yaw_deg, pitch_deg=0.0):
    lens = lens_of(info)
    plane = Surface(
        'rectilinear', lens.width, lens.height, lens.focal_x_px, lens.center_x_px, lens.center_y_px
    )
    attitude = Attitude(*np.radians((yaw_deg, pitch_deg)))
    return Scene().view(plane, attitude).frame(ns_of(image.header.stamp))


def psnr(a, b):
    return 10 * np.log10(255**2 / max(np.mean((a.astype(float) - b) ** 2), 1e-9))


def test_a_detector_gets_what_it_needs(rig, watcher, diagnosed):
    front, side = Consumer(watcher.node, 'front'), Consumer(watcher.node, 'right_view')
    for consumer, yaw_deg, pitch_deg in ((front, 0, 0), (side, 90, -10)):
        wait_for(consumer.both, START_S, f'a pair of {consumer.view}')
        image, info = consumer.both()
        assert image.header == info.header
        assert image.header.frame_id == f'{consumer.view}_optical_frame'
        assert (info.distortion_model, info.d) == ('plumb_bob', array('d', [0.0] * 5))
        assert list(info.p) == [*info.k[:3], 0, *info.k[3:6], 0, *info.k[6:], 0]
        assert list(info.r) == [1, 0, 0, 0, 1, 0, 0, 0, 1]
        assert list(info.k) == pytest.approx([320, 0, 319.5, 0, 320, 239.5, 0, 0, 1])
        assert psnr(to_array(image), truth(info, image, yaw_deg, pitch_deg)) > FAITHFUL_DB
    jpegs = []
    coded = watcher.node.create_subscription(
        CompressedImage, 'front/image_raw/compressed', jpegs.append, 5
    )
    wait_for(lambda: jpegs, START_S, 'a JPEG')
    watcher.node.destroy_subscription(coded)
    assert jpegs[0].format == 'bgr8; jpeg compressed bgr8'
    rear = Consumer(watcher.node, 'rear')
    words = 'rear: the rig does not see'
    wait_for(
        lambda: any(words in status.message for status in diagnosed[-1:]),
        START_S,
        'a WARN',
    )
    image, _ = wait_for(rear.both, START_S, 'a pair of rear')
    assert not to_array(image)[200:280, 300:340].any(), 'black where nothing is seen'
    for consumer in (front, side, rear):
        consumer.leave()


def test_nothing_is_drawn_while_nobody_subscribes(rig, watcher, diagnosed):
    key = 'front rate Hz'

    def rate():
        return {entry.key: entry.value for entry in diagnosed[-1].values}.get(key)

    wait_for(lambda: diagnosed and rate() is None, START_S, 'a report')
    consumer = Consumer(watcher.node, 'front')
    wait_for(lambda: float(rate() or 0) > 5, START_S, 'a rate')
    consumer.leave()
    wait_for(lambda: rate() is None, START_S, 'silence')


def test_views_and_their_parameters_change_while_the_node_runs(rig, watcher, set_parameters):
    (result,) = set_parameters(views=['front', 'ptz'])
    assert result.successful, result.reason
    consumer = Consumer(watcher.node, 'front')
    wait_for(consumer.both, START_S, 'a pair')
    results = set_parameters(
        front__yaw_deg=40.0, front__hfov_deg=60.0, front__width=320, front__height=200
    )
    assert all(result.successful for result in results), results

    def smaller():
        # The parameters are set one by one, the height last.
        image, info = consumer.both()
        return (info.width, info.height) == (320, 200) and (image, info)

    image, info = wait_for(smaller, START_S, 'a smaller picture')
    assert (image.width, image.height) == (320, 200)
    assert psnr(to_array(image), truth(info, image, 40)) > FAITHFUL_DB - 3, 'finer than the lens'
    for values, words in (
        ({'front__hfov_deg': 0.0}, 'front.hfov_deg'),
        ({'front__hfov_deg': 179.0}, 'front.hfov_deg'),
        ({'views': [f'v{i}' for i in range(20)]}, 'views has 20 names; expected up to 8'),
        ({'views': ['v' * 200]}, 'expected a letter, then letters, digits or _, up to 100 in all'),
        ({'views': ['left']}, "views has 'left', whose topics are those of a camera already"),
    ):
        (result,) = set_parameters(**values)
        assert not result.successful
        assert words in result.reason
    assert all(result.successful for result in set_parameters(views=['other', 'ptz']))
    wait_for(
        lambda: (
            not watcher.node.count_publishers('/front/image_raw')
            and watcher.node.count_publishers('/other/image_raw')
        ),
        START_S,
        'the other view',
    )


def test_a_view_is_steered(rig, watcher, diagnosed, set_parameters):
    consumer = Consumer(watcher.node, 'ptz')
    wait_for(consumer.both, START_S, 'a pair')
    look = watcher.node.create_publisher(Vector3Stamped, 'ptz/look', 1)
    wait_for(look.get_subscription_count, START_S, 'who hears')

    def turn(yaw_deg, pitch_deg, hfov_deg):
        message = Vector3Stamped()
        angles = np.radians((yaw_deg, pitch_deg, hfov_deg))
        message.vector.x, message.vector.y, message.vector.z = angles
        look.publish(message)

    def arrived(hfov_deg, what):
        focal_px = 160 / np.tan(np.radians(hfov_deg) / 2)
        wait_for(lambda: abs(consumer.both()[1].k[0] - focal_px) < 0.01, START_S, what)
        return focal_px

    def rest():
        (result,) = set_parameters(ptz__pitch_deg=0.0)  # as it is already
        assert result.successful, result.reason
        arrived(90, 'rest')

    def turned_smoothly():
        # A machine that is busy for longer than the turn sees only its end.
        rest()
        before_ns = ns_of(consumer.both()[0].header.stamp)
        turn(60, -10, 50)
        focal_px = arrived(50, 'the turn')
        passed = [info.k[0] for ns, info in consumer.infos.copy().items() if ns > before_ns]
        return sum(162 < focal < focal_px - 5 for focal in passed) >= 3

    wait_for(turned_smoothly, START_S, 'a turn that camera_info follows picture by picture')
    image, info = consumer.both()
    assert psnr(to_array(image), truth(info, image, 60, -10)) > FAITHFUL_DB - 3
    rest()

    def refused():
        turn(np.nan, 0, 0)
        # It stands in one report only.
        words = 'x of look is nan; expected a finite number of rad'
        return any(words in status.message for status in diagnosed)

    wait_for(refused, START_S, 'a WARN')
    turn(179, 0, 80)
    arrived(80, 'the limit')
    image, info = consumer.both()
    assert to_array(image).any(axis=2).all(), 'limited to what the rig sees'


def test_stitch_node_has_views_too(tmp_path):
    domain = unused_domain()
    with RigProcesses(domain, tmp_path) as rig, Watcher(domain) as watcher:
        rig.start_all(False, camera_parameters(None))
        rig.stop('stitch')
        rig.start('stitch', views='[front, right_view]')
        wait_for(lambda: rig.check_alive() or watcher.is_measured, START_S, 'a measured overlap')
        for view, yaw_deg in (('front', 0), ('right_view', 90)):
            consumer = Consumer(watcher.node, view)
            image, info = wait_for(consumer.both, START_S, f'a pair of {view}')
            assert psnr(to_array(image), truth(info, image, yaw_deg)) > FAITHFUL_DB - 2, 'twice'
