"""A viewer node beside a node in the place of the stitching, and a browser that looks."""

from array import array
from functools import partial

import aiohttp
import pytest
import serving
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from fisheye_msgs.msg import Overlaps, Projection
from rclpy.node import Node
from rclpy.parameter import Parameter
from sensor_msgs.msg import CompressedImage

from fisheye_bridge.qos import IMAGE, LATCHED
from panorama_viewer.viewer_node import ViewerNode

DEADLINE_S = 15.0
JPEG = b'\xff\xd8 as it is \xff\xd9'


class Stitching(Node):
    """Publishes what the stitch node would, in the namespace /rig."""

    def __init__(self, context, stamp=None):
        super().__init__('stitch', context=context, namespace='/rig')
        self.stamp = stamp
        self.image = self.create_publisher(CompressedImage, 'panorama/image/compressed', IMAGE)
        self.projection = self.create_publisher(Projection, 'panorama/projection', LATCHED)
        self.overlap = self.create_publisher(Overlaps, 'panorama/overlap', LATCHED)
        self.diagnostics = self.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self.create_timer(0.05, self.publish)

    def publish(self):
        message = CompressedImage(format='bgr8; jpeg compressed bgr8', data=array('B', JPEG))
        message.header.stamp = self.stamp or self.get_clock().now().to_msg()
        self.image.publish(message)
        skew = [KeyValue(key='skew median ms', value='2.5')]
        self.diagnostics.publish(
            DiagnosticArray(
                status=[
                    DiagnosticStatus(name='rig/left/capture', level=b'\2', message='unplugged'),
                    DiagnosticStatus(name='other/left/capture', level=b'\2', message='not ours'),
                    DiagnosticStatus(name='rig/stitch', values=skew),
                ]
            )
        )


def viewer(ros, **parameters):
    return ViewerNode(
        context=ros.context,
        namespace='/rig',
        parameter_overrides=[Parameter(name, value=v) for name, v in parameters.items()],
    )


visit = partial(serving.visit, deadline_s=DEADLINE_S)


def look(node):
    """Return the first picture that a browser is shown."""

    async def look(session):
        async with session.ws_connect(f'{node.url}live') as stream:
            async for message in stream:
                if message.type is aiohttp.WSMsgType.BINARY:
                    return message.data
        return pytest.fail('the stream ended without a picture')

    return visit(look)
