"""Shows the panorama in a browser."""

from concurrent.futures import Future
from math import isfinite
from time import monotonic
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from fisheye_msgs.msg import Overlap, Overlaps, Projection
from fisheye_msgs.srv import CalibrateOverlap
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from sensor_msgs.msg import CompressedImage

from fisheye_bridge.diagnostics import ERROR, Diagnostics
from fisheye_bridge.network import addresses
from fisheye_bridge.parameters import Parameters
from fisheye_bridge.projection import surface_of
from fisheye_bridge.qos import IMAGE_INPUT, LATCHED, LATCHED_INPUT
from fisheye_bridge.running import run
from fisheye_bridge.stamps import ns_of
from fisheye_core.errors import FisheyeError, OverlapError
from panorama_viewer.projection import Quaternion, StateHistory, described, turned
from panorama_viewer.server import ViewerServer
from panorama_viewer.settings import ViewerSettings
from panorama_viewer.status import ViewerStatus, measured
from panorama_viewer.tls import fingerprint, tls_of
from panorama_viewer.token import print_on_terminal

_TELL_S = 0.5
_NUMBERS = (
    *('confidence', 'yaw_deg', 'near_deg'),
    *('seam_begin_px', 'seam_end_px', 'right_begin_px', 'left_end_px'),
)
"""Of an overlap."""


class ViewerNode(Node):
    """panorama/image/compressed, and what is known of it, to browsers."""

    SETTINGS = (('', ViewerSettings),)

    def __init__(self, **kwargs):
        super().__init__('viewer', **kwargs)
        self._declared = Parameters(self, ViewerSettings, on_change=self._apply)
        self._status = ViewerStatus()
        self._image = None
        self._faults: list[str] = []
        self._levels: StateHistory[Quaternion | None] = StateHistory()
        self._told: dict[str, Any] | None = None
        for kind, topic, take, qos in (
            (Projection, 'panorama/projection', self._take_projection, LATCHED_INPUT),
            (Overlaps, 'panorama/overlap', self._take_overlaps, LATCHED),
            (DiagnosticArray, '/diagnostics', self._take_diagnostics, 10),
        ):
            self.create_subscription(kind, topic, take, qos)
        self._client = self.create_client(CalibrateOverlap, 'calibrate_overlap')
        self._watch = self.create_guard_condition(self._follow_browsers)
        self._tls = tls_of(self._declared.settings, addresses())
        self._server = ViewerServer(
            self._declared.settings,
            calibrate=self._calibrate,
            watched=self._watch.trigger,
            report=self._note_fault,
            tls=self._tls,
        )
        self._server.start()
        self._apply(self._declared.settings)
        # The page goes on while a recording, and with it the time of ROS, stands still.
        self.create_timer(_TELL_S, self._tell, clock=Clock(clock_type=ClockType.STEADY_TIME))
        self._diagnostics = Diagnostics(self, self._report)
        self._tell_where()

    @property
    def url(self) -> str:
        """What to open in a browser."""
        return self._server.url

    def destroy_node(self) -> None:
        """Close the connections to browsers too."""
        self._server.stop()
        super().destroy_node()

    def _apply(self, settings: ViewerSettings) -> None:
        """Follow live settings, and send the pages the size of the robot."""
        self._server.apply(settings)
        self._server.tell(
            robot_width_m=settings.robot_width_m, camera_height_m=settings.camera_height_m
        )

    def _tell_where(self) -> None:
        """Log the address; the token goes to the terminal, because logs are read by others."""
        address, url = self._server.address, self._server.url
        self.get_logger().info(f'the panorama is at {address}')
        if self._tls and self._tls.own:
            self.get_logger().info(
                f'the certificate is in {self._tls.path}; its SHA-256 is '
                f'{fingerprint(self._tls.own)}'
            )
        if url == address:
            return
        token_file = self._declared.settings.token_file
        if token_file:
            self.get_logger().info(f'looking needs the token in {token_file}')
        if not print_on_terminal(f'Open {url}') and not token_file:
            self.get_logger().warning(
                'looking needs a token, and there is no terminal to print it on: set the '
                'parameter token_file to a file that shall keep it'
            )

    def _follow_browsers(self) -> None:
        """Subscribe while somebody looks: the JPEG is made for subscribers only."""
        if self._server.watchers and self._image is None:
            self._image = self.create_subscription(
                CompressedImage, 'panorama/image/compressed', self._take_image, IMAGE_INPUT
            )
        elif not self._server.watchers and self._image is not None:
            self.destroy_subscription(self._image)
            self._image = None

    def _take_image(self, message) -> None:
        delay_ns = self.get_clock().now().nanoseconds - ns_of(message.header.stamp)
        self._status.picture(monotonic(), delay_ns / 1e9)
        orientation = self._levels.at(ns_of(message.header.stamp))
        self._server.show(message.data.tobytes(), orientation)

    def _take_projection(self, message) -> None:
        try:
            surface = surface_of(message)
        except FisheyeError as error:
            self.get_logger().warning(f'panorama/projection refused: {error}')
            return
        q = message.orientation
        self._levels.add(ns_of(message.header.stamp), turned(q.x, q.y, q.z, q.w))
        projection = described(surface, message.wraps)
        if projection != self._told:  # it comes with each panorama while the level changes
            self._told = projection
            self._server.tell(projection=projection)

    def _take_overlaps(self, message) -> None:
        self._server.tell(overlaps=[_entry(overlap) for overlap in message.overlaps])

    def _take_diagnostics(self, message) -> None:
        """Keep what the nodes of this rig report: those in the viewer's namespace."""
        space = self.get_namespace().strip('/')
        prefix = f'{space}/' if space else ''
        for status in message.status:
            name = status.name.lstrip('/')
            if name.startswith(prefix):
                self._status.heard(
                    monotonic(),
                    name.removeprefix(prefix),
                    ord(status.level),
                    status.message,
                    {entry.key: entry.value for entry in status.values},
                )

    def _tell(self) -> None:
        self._server.tell(**self._status.told(monotonic()))

    def _calibrate(self) -> Future:
        """Ask the stitch node to measure; called in the server's thread."""
        if not self._client.service_is_ready():
            raise OverlapError('nobody offers calibrate_overlap: is the stitch node running?')
        said: Future[str] = Future()
        asked = self._client.call_async(
            CalibrateOverlap.Request(save=self._declared.settings.save)
        )

        def say(done):
            if said.set_running_or_notify_cancel():
                said.set_result(_sentence(done.result(), self._declared.settings.save))

        asked.add_done_callback(say)
        return said

    def _report(self, report) -> None:
        report.values['browsers'] = self._server.watchers
        for fault in list(self._faults):
            report.add(ERROR, fault)

    def _note_fault(self, sentence: str, trace: str) -> None:
        """Log what failed in the server, whose other parts go on; called in its thread."""
        self._faults.append(sentence)
        self.get_logger().error(f'{sentence}\n{trace}')


def _entry(overlap: Overlap) -> dict[str, Any]:
    """Return what the page shows of an overlap; JSON has no NaN."""
    numbers = {name: getattr(overlap, name) for name in _NUMBERS}
    entry = {
        'left': overlap.left_camera,
        'right': overlap.right_camera,
        'found': overlap.found,
        **{name: value if isfinite(value) else None for name, value in numbers.items()},
    }
    return {**entry, 'words': measured(entry)}


def _sentence(response: CalibrateOverlap.Response, is_saved: bool) -> str:
    if not response.success:
        return response.message
    sentences = [_entry(overlap)['words'] for overlap in response.overlaps]
    if is_saved and all(overlap.found for overlap in response.overlaps):
        sentences.append('saved')
    return '; '.join(sentences)


def main() -> int:
    """Run the node."""
    return run(ViewerNode)
