"""SIGINT and SIGTERM in every state: exit 0 within 2 s, no traceback, no child left behind."""

import os
import signal
from pathlib import Path

import pytest
from field import START_S, STOP_S, write_pictures
from fisheye_msgs.srv import CalibrateOverlap
from sensor_msgs.msg import Image

from fisheye_bridge.qos import IMAGE_INPUT
from fisheye_testing.again import TooSlowError, asked_again
from fisheye_testing.domains import unused_domain
from fisheye_testing.health import Health
from fisheye_testing.mjpeg_server import MjpegServer, jpeg
from fisheye_testing.rig import SEPARATE, SIDES, RigProcesses
from fisheye_testing.waiting import wait_for

NOBODY = 'http://127.0.0.1:9/stream'
ERROR = b'\x02'
SIGNALS = (signal.SIGINT, signal.SIGTERM) if os.environ.get('LONG') else (signal.SIGTERM,)
LARGE = {'width': 1920, 'height': 1440}
"""Pictures of this size keep a calibration busy for seconds."""


class Crowd(RigProcesses):
    """Many nodes, each in a state of its own, and a subscriber to what they publish."""

    def __init__(self, folder: Path):
        domain = unused_domain()
        super().__init__(domain, folder / 'log')
        self.health = Health(domain)
        self.taken = set()

    def __exit__(self, *arguments) -> None:
        super().__exit__(*arguments)
        self.health.__exit__()

    def names(self) -> set[str]:
        """Return the names of the nodes in the graph, without its own."""
        return set(self.health.node.get_node_names()) - {self.health.node.get_name()}

    def begin(self, **nodes: dict[str, object]) -> None:
        """Start nodes with their parameters, after all of an earlier try are gone."""
        wait_for(lambda: not self.names(), START_S, 'an empty graph')
        for node, parameters in nodes.items():
            self.start(node, **parameters)
        self.taken.clear()
        self.health.status.clear()

    def listen(self, topic: str) -> None:
        """Publish a topic."""
        self.health.node.create_subscription(
            Image, topic, lambda _: self.taken.add(topic), IMAGE_INPUT
        )

    def in_error(self, node: str) -> bool:
        """Whether a node complains."""
        return self.health.level(node) == ERROR


@pytest.fixture
def crowd(tmp_path):
    with Crowd(tmp_path) as crowd:
        yield crowd


def children(pid: int) -> list[int]:
    return [int(c) for c in Path(f'/proc/{pid}/task/{pid}/children').read_text().split()]


def stop_all(crowd, nodes, with_signal):
    """End nodes, one after the other; give how long each took."""
    took = {}
    for node in nodes:
        pids = children(crowd.processes[node].pid)
        code, took[node] = crowd.stop(node, with_signal)
        words = crowd.log(node).read_text()
        assert code == 0, f'{node}: {words}'
        assert 'Traceback' not in words
        assert not [pid for pid in pids if Path(f'/proc/{pid}').exists()], f'{node} left children'
    print(f'\n{with_signal.name}:', ', '.join(f'{n} {s:.1f} s' for n, s in took.items()))
    if max(took.values()) >= STOP_S:
        raise TooSlowError(took)


@pytest.mark.parametrize('with_signal', SIGNALS)
@asked_again
def test_a_node_that_waits_ends_at_once(crowd, tmp_path, with_signal):
    write_pictures(tmp_path)
    silent = MjpegServer(jpeg(90, 640, 480))
    silent.stalled.set()
    nodes = {
        'absent/capture': {'source': NOBODY},
        'unplugged/capture': {'source': '/dev/video97'},
        'stalled/capture': {'source': silent.url},
        'idle/undistort': {},
        'idle/stitch': {},
    }
    for name, url in (('absent', NOBODY), ('stalled', silent.url)):
        nodes[f'{name}/panorama'] = {
            f'{side}.{key}': value
            for side in SIDES
            for key, value in {
                'source': url,
                'camera_info_url': tmp_path / f'{side}.yaml',
            }.items()
        }
    crowd.begin(**nodes)
    wait_for(lambda: crowd.check_alive() or all(map(crowd.in_error, nodes)), START_S, 'waiting')
    try:
        stop_all(crowd, nodes, with_signal)
    finally:
        silent.stop()


@pytest.mark.parametrize('with_signal', SIGNALS)
@asked_again
def test_a_node_at_work_ends_at_once(crowd, with_signal):
    nodes = *SEPARATE, 'one/panorama'
    crowd.begin(**{node: {} for node in nodes})
    topics = ['left/image_raw', 'left/image_rect', 'panorama/image', 'one/panorama/image']
    for topic in topics:
        crowd.listen(topic)
    wait_for(lambda: crowd.check_alive() or crowd.taken >= set(topics), START_S, 'pictures')
    stop_all(crowd, nodes, with_signal)


@pytest.mark.parametrize('with_signal', SIGNALS)
@asked_again
def test_a_node_that_calibrates_ends_at_once(crowd, with_signal):
    crowd.begin(panorama=LARGE)
    crowd.listen('panorama/image')
    client = crowd.health.node.create_client(CalibrateOverlap, 'calibrate_overlap')
    wait_for(lambda: crowd.check_alive() or crowd.taken, START_S, 'pictures')
    wait_for(client.service_is_ready, START_S, 'the service')
    first, *others = [
        # Whoever asks for the same as the one before gets its measurement.
        client.call_async(CalibrateOverlap.Request(method=method))
        for method in ('correlation', 'particles') * 3
    ]
    wait_for(first.done, START_S, 'the first answer')
    stop_all(crowd, ['panorama'], with_signal)
    if others[-1].done():
        raise TooSlowError('the calibrations were over before the signal')


@pytest.mark.parametrize('with_signal', SIGNALS)
@asked_again
def test_a_node_that_is_being_built_ends_at_once(crowd, with_signal):
    crowd.begin(panorama=LARGE)
    wait_for(lambda: 'panorama' in crowd.names(), START_S, 'the panorama node in the graph')
    stop_all(crowd, ['panorama'], with_signal)
