"""One view as ROS sees it: its picture, its camera_info, and the topic that steers it."""

from geometry_msgs.msg import TransformStamped, Vector3Stamped
from rclpy.node import Node
from sensor_msgs.msg import CameraInfo
from std_msgs.msg import Header

from fisheye_bridge.camera_info import camera_info_of
from fisheye_bridge.diagnostics import ERROR, WARN, DropCounter, Report
from fisheye_bridge.images import ImageBuffer
from fisheye_bridge.qos import COMMAND, IMAGE
from fisheye_bridge.stamps import stamp_of
from fisheye_bridge.topics import ImagePublisher
from fisheye_bridge.transforms import TransformPublisher, transform
from fisheye_core.errors import FisheyeError
from fisheye_core.latest_only import LatestOnlyWorker
from fisheye_core.rate_meter import RateMeter
from fisheye_geometry.camera import Camera
from panorama_stitch.pipeline.live_view import LiveView
from panorama_stitch.pipeline.panorama import Panorama
from panorama_stitch.pipeline.view_settings import ViewSettings

_UNSEEN_SHARE = 0.01
"""What the rig does not see of a view before anybody is told."""


class ViewPublisher:
    """Publishes a view of the panoramas that are handed over, in a thread of its own."""

    def __init__(
        self,
        node: Node,
        name: str,
        settings: ViewSettings,
        transforms: TransformPublisher,
        frame_id: str,
    ):
        """Start.

        Parameters
        ----------
        node
            Whose topics they are.
        name
            Of the view.
        settings
            Where the view looks.
        transforms
            Publishes where the view looks while it moves.
        frame_id
            Of the panorama.
        """
        self._node, self._name, self._parent = node, name, frame_id
        self._transforms = transforms
        self._view = LiveView(name, settings)
        self._fault = ''
        self._rate = RateMeter()
        self._buffer: ImageBuffer | None = None
        self._refused = DropCounter(node, f'a message on {name}/look', f'{name} look refused')
        self._image = ImagePublisher(node, f'{name}/image_raw')
        self._info = node.create_publisher(CameraInfo, f'{name}/camera_info', IMAGE)
        self._look = node.create_subscription(
            Vector3Stamped, f'{name}/look', self._take_look, COMMAND
        )
        self._worker: LatestOnlyWorker[Panorama] = LatestOnlyWorker(
            self._publish, f'view {name}', on_error=self._failed
        )

    @property
    def wanted(self) -> bool:
        """Whether anybody subscribes."""
        return self._image.wanted or bool(self._info.get_subscription_count())

    def apply(self, settings: ViewSettings) -> None:
        """Use other settings from the next picture on."""
        self._view.apply(settings)

    def rest(self) -> None:
        """Look where the settings say again, if the view was steered."""
        self._view.rest()

    def take(self, panorama: Panorama) -> None:
        """Publish the view of a panorama soon, unless a newer one comes before."""
        self._worker.put(panorama)

    def place(self) -> TransformStamped:
        """Return where the view looks while it is not steered."""
        return self._transform(Header(frame_id=self._parent), self._view.aim().attitude)

    def report(self, report: Report) -> None:
        """Report rate, and what is wrong while somebody subscribes."""
        self._refused.tell(report)
        if not self.wanted:
            return
        report.values[f'{self._name} rate Hz'] = self._rate.hz
        unseen = 1 - self._view.seen_share
        if self._fault:
            report.add(ERROR, f'{self._name}: {self._fault}')
        elif unseen > _UNSEEN_SHARE:
            report.add(
                WARN, f'{self._name}: the rig does not see {100 * unseen:.0f} % of it: black there'
            )

    def stop(self) -> None:
        """End the thread, and the topics."""
        self._worker.stop()
        self._image.destroy()
        self._node.destroy_publisher(self._info)
        self._node.destroy_subscription(self._look)

    def _take_look(self, message: Vector3Stamped) -> None:
        try:
            self._view.look(message.vector.x, message.vector.y, message.vector.z)
        except FisheyeError as error:
            self._refused.add(error)

    def _publish(self, panorama: Panorama) -> None:
        aim = self._view.aim(panorama)
        camera, frame_id = aim.camera, f'{self._name}_optical_frame'
        header = Header(stamp=stamp_of(panorama.stamp_ns), frame_id=frame_id)
        if self._image.wanted and not self._draw(panorama, aim, header):
            return
        self._info.publish(camera_info_of(Camera(self._name, camera.lens), header))
        if self._view.moves:
            parent = Header(stamp=header.stamp, frame_id=self._parent)
            self._transforms.move([self._transform(parent, aim.attitude)])
        self._rate.count()
        self._fault = ''

    def _draw(self, panorama: Panorama, aim, header: Header) -> bool:
        size = aim.camera.width, aim.camera.height, panorama.encoding
        if self._buffer is None or not self._buffer.fits(*size):
            self._buffer = ImageBuffer(*size)
        if not self._view.draw(panorama, aim, self._buffer.array):
            return False
        self._buffer.message.header = header
        quality = self._node.settings.jpeg_quality
        self._image.publish(self._buffer.message, self._buffer.array, quality)
        return True

    def _transform(self, header: Header, attitude) -> TransformStamped:
        return transform(header, f'{self._name}_optical_frame', attitude)

    def _failed(self, error: FisheyeError) -> None:
        self._fault = str(error)
