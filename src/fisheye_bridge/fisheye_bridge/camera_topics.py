"""A camera's topics: its pictures, and the lens that took them as far as it can be trusted."""

from collections.abc import Callable
from time import monotonic

import numpy as np
from rclpy.node import Node
from sensor_msgs.msg import CameraInfo
from std_msgs.msg import Header

from fisheye_bridge.camera_info import lens_of, readout_of
from fisheye_bridge.diagnostics import ERROR, WARN, WARNING_PAUSE_S, Report
from fisheye_bridge.qos import BEST_EFFORT_INPUT
from fisheye_bridge.topics import ImageSubscription
from fisheye_core.errors import CalibrationError, FisheyeError
from fisheye_core.planar_picture import halvings
from fisheye_geometry.camera import Camera, Readout
from fisheye_geometry.image_circle import LensWithImageCircle
from fisheye_geometry.lens import Lens
from fisheye_geometry.settling import Settling

_AGAIN_S = 1.0
"""Until a calibration that was refused is looked at again: settings may have changed."""


class CameraSubscription:
    """Subscribes to image_raw and camera_info, and keeps what is broken away.

    Attributes
    ----------
    lens : Lens or None
        The last good one, within the circle that it lights.
    pictures : ImageSubscription
        Its pictures; those that were not usable are counted there.
    """

    def __init__(
        self,
        node: Node,
        *,
        on_picture: Callable[[np.ndarray, str, Header], None],
        on_lens: Callable[[Lens, Header], None],
        check: Callable[[Lens], object],
        namespace: str = '',
        transport: str = 'raw',
        cut: Callable[[np.ndarray], np.ndarray] | None = None,
    ):
        """Subscribe.

        Parameters
        ----------
        node
            Who subscribes.
        on_picture
            Called with each picture, (height, width[, 3]) uint8, its encoding and its header.
        on_lens
            Called with a lens that may be news and the header of its camera_info: when its first
            picture has shown the circle that it lights, or when no picture comes.
        check
            Called with a lens that comes; a `FisheyeError` that it raises refuses that lens, and
            the one before stays.
        namespace
            Of the topics, below that of the node.
        transport
            'raw', 'compressed' or 'video', of the pictures.
        cut
            Takes the camera's part out of each picture; a `FisheyeError` that it raises drops the
            picture. None: it is all of it.
        """
        self._node, self._cut = node, cut
        self._is_video = transport == 'video'
        self._on_picture, self._on_lens, self._check = on_picture, on_lens, check
        self._prefix = f'{namespace}/' if namespace else ''
        self._seen: LensWithImageCircle | None = None
        self._content, self._header = '', Header()
        self._picture_size: tuple[int, int] | None = None
        self._described: tuple[int, int] | None = None
        self._refusal, self._is_over, self._note = '', False, ''
        self._refused, self._again_s = '', 0.0
        self._settling = Settling()
        self.pictures = ImageSubscription(
            node,
            f'{self._prefix}image_raw',
            self._take_picture,
            transport=transport,
            key=f'{namespace} pictures refused'.lstrip(),
        )
        node.create_subscription(
            CameraInfo, f'{self._prefix}camera_info', self._take_camera_info, BEST_EFFORT_INPUT
        )

    @property
    def lens(self) -> Lens | None:
        """The last good lens."""
        return self._seen.lens if self._seen else None

    def refuse(self, error: FisheyeError) -> None:
        """Report that a lens cannot be used."""
        self._refusal, self._is_over = str(error), False
        kept = '; the last good calibration stays in use' if self._seen else ''
        self._node.get_logger().warning(
            f'{self._prefix}camera_info refused: {error}{kept}',
            throttle_duration_sec=WARNING_PAUSE_S,
        )

    def report(self, report: Report, *, is_used: bool) -> None:
        """Report what is wrong; a refusal once more after the camera_info in use came again.

        Parameters
        ----------
        report
            To be filled.
        is_used
            Whether some lens of this camera is in use.
        """
        if self._refusal:
            level = WARN if is_used else ERROR
            report.add(level, f'{self._prefix}camera_info refused: {self._refusal}')
        elif not is_used:
            what = f'{self._prefix}image_raw' if self._seen else f'{self._prefix}camera_info'
            report.add(ERROR, f'waiting for {what}')
        if self._is_over:
            self._refusal = ''
        if self._settling.waits:
            report.add(
                WARN,
                f'{self._prefix}camera_info changes again and again; expected one calibration: '
                f'it is followed every {self._settling.pause_s:.0f} s',
            )
        if self._note:
            report.add(WARN, self._note)
        self.pictures.dropped.tell(report)

    def _take_camera_info(self, message: CameraInfo) -> None:
        readout = readout_of(message)
        size = message.width, message.height
        content = repr((*size, readout, message.distortion_model, *message.k, *message.d))
        if content == self._content:
            self._is_over = True
            self._settling.calm()
            if self._picture_size is None and self._seen:
                self._tell(self._seen.lens)
            return
        if content == self._refused and monotonic() < self._again_s:
            return
        try:
            lens = _in_video(lens_of(message)) if self._is_video else lens_of(message)
            self._described = lens.width, lens.height
            if self._picture_size not in (None, (lens.width, lens.height)):
                whole = f'{size[0]}x{size[1]} px'
                part = '' if readout == Readout() else f' ({whole} with {readout})'
                raise CalibrationError(
                    '{}x{} px{} do not fit the pictures, which have {}x{} px'.format(
                        lens.width, lens.height, part, *self._picture_size
                    )
                )
            if content != self._refused and not self._settling.follow():
                return
            self._check(lens)
        except FisheyeError as error:
            self._refused, self._again_s = content, monotonic() + _AGAIN_S
            self.refuse(error)
            return
        self._content, self._header, self._note = content, message.header, ''
        self._seen = LensWithImageCircle(lens)

    def _take_picture(self, image: np.ndarray, encoding: str, header: Header) -> None:
        if self._cut:
            image = self._cut(image)
        if self._is_video and self._described:
            image = _unpadded(image, *self._described)
        if self._described or not self._is_video:
            self._picture_size = image.shape[1::-1]
        seen = self._seen
        if seen and seen.look(image):
            self._tell(seen.lens)
        if seen and seen.note and not self._note:
            self._note = f'{self._prefix}camera_info: {seen.note}'
            self._node.get_logger().warning(self._note)
        self._on_picture(image, encoding, header)

    def _tell(self, lens: Lens) -> None:
        try:
            self._on_lens(lens, self._header)
        except FisheyeError as error:
            self.refuse(error)


def _in_video(lens: Lens) -> Lens:
    """Return a camera's lens as its video shows it, which is halved where it is too large."""
    binning = 1 << halvings(lens.width, lens.height)
    return Readout(binning_x=binning, binning_y=binning).of(Camera('', lens)).lens


def _unpadded(image: np.ndarray, width: int, height: int) -> np.ndarray:
    """Remove the column or row that video repeats where a camera's sides are odd."""
    is_padded = image.shape[1::-1] == (width + width % 2, height + height % 2)
    return image[:height, :width] if is_padded else image
