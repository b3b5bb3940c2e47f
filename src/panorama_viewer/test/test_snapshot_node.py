"""The node behind the command snapshot, beside a node that publishes panoramas."""

import sys

import numpy as np
import pytest
import rclpy
from fisheye_msgs.msg import Projection
from rclpy.executors import SingleThreadedExecutor
from sensor_msgs.msg import Image
from std_msgs.msg import Header

from fisheye_bridge import shared_memory
from fisheye_bridge.images import ImageBuffer
from fisheye_bridge.projection import projection_of
from fisheye_bridge.qos import IMAGE, LATCHED
from fisheye_bridge.stamps import stamp_of
from fisheye_core.errors import SourceError
from fisheye_geometry.surface import Surface
from panorama_viewer.snapshot_node import SnapshotNode, main, parse

SURFACE = Surface('cylindrical', 32, 12, 10.0, 15.5, 5.5)
PANORAMA = np.full((12, 32, 3), (10, 20, 30), np.uint8)
SPINS = 500


@pytest.fixture
def context():
    context = rclpy.Context()
    rclpy.init(context=context)
    yield context
    rclpy.shutdown(context=context)


@pytest.mark.parametrize('stamp_ns', [1_700_000_000_250_000_000, -1])
def test_a_panorama_is_taken_with_its_surface_and_any_stamp(context, stamp_ns):
    where = {'context': context, 'namespace': '/snapshot_test'}
    node, stitching = SnapshotNode(**where), rclpy.create_node('stitch', **where)
    projection = stitching.create_publisher(Projection, 'panorama/projection', LATCHED)
    image = stitching.create_publisher(Image, 'panorama/image', IMAGE)
    header = Header(stamp=stamp_of(stamp_ns))
    projection.publish(projection_of(SURFACE, header, wraps=True))
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    buffer = ImageBuffer(SURFACE.width, SURFACE.height, 'rgb8')
    buffer.array[:] = PANORAMA[..., ::-1]
    buffer.message.header = header
    for _ in range(SPINS):
        image.publish(buffer.message)
        executor.spin_once(timeout_sec=0.02)
        if node.taken:
            break
    taken, surface, taken_ns, wraps, _ = node.taken
    np.testing.assert_array_equal(taken, PANORAMA)
    assert (surface, taken_ns, wraps) == (SURFACE, stamp_ns, True)
    for ended in (node, stitching):
        ended.destroy_node()


@pytest.mark.parametrize('other', [None, SURFACE.window(0, 0, 30, 12)], ids=['none', 'other'])
def test_that_no_projection_of_the_panorama_came_is_said(context, other):
    where = {'context': context, 'namespace': '/snapshot_test'}
    node, stitching = SnapshotNode(**where), rclpy.create_node('stitch', **where)
    projection = stitching.create_publisher(Projection, 'panorama/projection', LATCHED)
    image = stitching.create_publisher(Image, 'panorama/image', IMAGE)
    if other:
        projection.publish(projection_of(other, Header(), wraps=False))
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    buffer = ImageBuffer(SURFACE.width, SURFACE.height, 'rgb8')
    said = ''
    for _ in range(SPINS):
        image.publish(buffer.message)
        executor.spin_once(timeout_sec=0.02)
        with pytest.raises(SourceError) as raised:
            node.wait(0.0)
        said = str(raised.value)
        if 'projection' in said:
            break
    topic = '/snapshot_test/panorama/projection'
    assert said == f'no projection of the panorama came on {topic} within 0 s'
    for ended in (node, stitching):
        ended.destroy_node()


def test_the_command_says_that_no_panorama_came(monkeypatch, capsys):
    prepared = []
    monkeypatch.setattr(shared_memory, 'prepare', lambda: prepared.append(True) or '')
    monkeypatch.setattr('sys.argv', ['snapshot', '--timeout', '0.1'])
    assert main() == 1
    assert (
        capsys.readouterr().err == 'snapshot: no panorama came on /panorama/image within 0.1 s\n'
    )
    assert prepared, 'shared memory of killed nodes is cleared'


@pytest.mark.parametrize(
    ('words', 'said'),
    [
        (['--timeout', 'nan'], 'nan is not a time; expected seconds from 0'),
        (['--timeout=-1'], '-1 is not a time; expected seconds from 0'),
        (['--ros-args', '-p', 'x'], "Couldn't parse parameter override rule: '-p x'"),
        (['--ros-args', '-r', '__ns:=bad-ns'], "Couldn't parse remap rule: '-r __ns:=bad-ns'"),
    ],
)
def test_a_wrong_command_line_is_a_sentence(monkeypatch, capsys, words, said):
    monkeypatch.setattr(sys, 'argv', ['snapshot', *words])
    with pytest.raises(SystemExit):
        parse()
    assert said in capsys.readouterr().err
