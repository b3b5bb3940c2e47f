"""Frames of all cameras that were taken at the same time, whatever the cameras do."""

from collections.abc import Sequence
from threading import RLock
from time import monotonic, monotonic_ns
from typing import NamedTuple

import numpy as np

from fisheye_core.encodings import alike, converted
from fisheye_core.latest_only import LatestOnlyQueue
from fisheye_core.rate_meter import RateMeter
from panorama_stitch.pipeline.known_cameras import KnownCameras
from panorama_stitch.pipeline.pairing import FramePairing
from panorama_stitch.pipeline.panorama_settings import PanoramaOutputSettings
from panorama_stitch.pipeline.stale import StaleCameras

_WAITING = 2
"""Frame sets that may wait to be composed: a moment without the processor loses none."""


class _Frame(NamedTuple):
    """An image that waits for its partner, and when it was taken."""

    image: np.ndarray
    stamp_ns: int


class FrameSet(NamedTuple):
    """An image of each camera; those with an age are not live."""

    images: Sequence[np.ndarray]
    stamp_ns: int
    ages_s: dict[str, float]


class FrameSets:
    """Pairs frames as they come, from any thread; only the newest frame sets wait.

    Where a camera is silent, the others go on beside its last image.

    Attributes
    ----------
    pairing : FramePairing
        What waits for its partner.
    rates : dict of RateMeter
        At which each camera's frames come.
    lock : RLock
        Held while a frame is taken.
    """

    def __init__(self, settings: PanoramaOutputSettings, cameras: KnownCameras):
        """Start with settings and what is known of the cameras."""
        self.pairing = FramePairing(settings.cameras, round(settings.max_pair_skew_s * 1e9))
        self.rates = {camera: RateMeter() for camera in settings.cameras}
        self.lock = RLock()
        self._settings, self._cameras = settings, cameras
        self._stale = StaleCameras(settings.cameras)
        self._waiting: LatestOnlyQueue[FrameSet] = LatestOnlyQueue(_WAITING)
        self._paired_s = monotonic()
        self._color = ''

    def take(self, camera: str, stamp_ns: int, image: np.ndarray, encoding: str) -> bool:
        """Add a frame; return whether it completed a frame set.

        The first one in colour decides the order of the channels of all.

        Raises
        ------
        ImageFormatError
            If it is not of the size that the camera is known to give.
        """
        self._cameras.check(camera, image)
        self.rates[camera].count()
        with self.lock:
            if encoding != 'mono8':
                self._color = self._color or encoding
                image = converted(image, encoding, self._color)
            self._stale.note(camera, image)
            by_stamp = self._settings.pair_by == 'stamp'
            when_ns = stamp_ns if by_stamp else monotonic_ns()
            frames = self._paired(camera, when_ns, _Frame(image, stamp_ns))
            if frames is None:
                frames = self._beside_stale(camera, stamp_ns)
                if frames is None:
                    return False
                self.pairing.pass_over(when_ns)
            self._paired_s = monotonic()
            self._waiting.put(frames)
            return True

    def get(self) -> FrameSet | None:
        """Wait for a frame set; return None once closed."""
        return self._waiting.get()

    def forget(self, camera: str, height: int, width: int) -> None:
        """Drop what a camera showed if its images have another size from now on."""
        last = self._stale.last(camera)
        if last is not None and last.shape[:2] != (height, width):
            self.pairing.clear()
            self._waiting.clear()
            self._stale.forget(camera)

    def apply(self, settings: PanoramaOutputSettings) -> None:
        """Use other settings from the next frame on."""
        with self.lock:
            if settings.pair_by != self._settings.pair_by:
                self.pairing.clear()
            self._settings = settings
            self.pairing.max_skew_ns = round(settings.max_pair_skew_s * 1e9)

    def close(self) -> None:
        """Make `get`, now and later, return None."""
        self._waiting.close()

    def dimmed(self, frames: FrameSet) -> list[np.ndarray]:
        """Return the images of a frame set, stale ones dimmed, all in colour if one is."""
        return alike(
            [
                self._stale.dim(camera, image) if camera in frames.ages_s else image
                for camera, image in zip(self._cameras.cameras, frames.images, strict=True)
            ]
        )

    def encoding(self, image: np.ndarray) -> str:
        """Return the encoding of an image of a frame set."""
        return 'mono8' if image.ndim == 2 else self._color

    @property
    def missing(self) -> list[str]:
        """Cameras of which there is no image yet."""
        return self._stale.missing

    @property
    def overtaken(self) -> int:
        """Frame sets that were dropped because a newer one came."""
        return self._waiting.dropped

    @property
    def unpaired_s(self) -> float:
        """How long ago the last frames belonged together, s.

        0 while a camera is stale, and for as long as a camera may be silent without being stale.
        """
        age_s = monotonic() - self._paired_s
        is_long = age_s > self._stale.longest_limit_s(self._settings.stale_after_s)
        return age_s if is_long and not self.ages_s() else 0.0

    def ages_s(self) -> dict[str, float]:
        """Return the cameras that are stale, each with the age of its last frame, s."""
        return self._stale.ages_s(self._settings.stale_after_s)

    def _paired(self, camera: str, when_ns: int, frame: _Frame) -> FrameSet | None:
        """Pair a frame by a moment; return the frame set that it completes."""
        paired = self.pairing.add(camera, when_ns, frame, frame.image.nbytes)
        if paired is None:
            return None
        images, stamps_ns = zip(*(member.frame for member in paired), strict=True)
        return FrameSet(images, min(stamps_ns), {})

    def _beside_stale(self, camera: str, stamp_ns: int) -> FrameSet | None:
        """Show what lives beside the last images of the rest; the first living sets the pace."""
        ages_s, cameras = self.ages_s(), self._cameras
        living = [name for name in cameras.cameras if name not in ages_s]
        # None lives where this thread itself was kept waiting for so long.
        if not ages_s or living[:1] != [camera] or not cameras.is_complete:
            return None
        last = {name: self._stale.last(name) for name in cameras.cameras}
        live = last[camera]
        if live is None:
            return None
        images = [
            cameras.black(name, live.shape[2:]) if image is None else image
            for name, image in last.items()
        ]
        return FrameSet(images, stamp_ns, ages_s)
