"""How well the overlaps in use still hold, looked at once a second in the background."""

from collections.abc import Sequence
from concurrent.futures import Future
from dataclasses import dataclass, replace
from math import degrees, isnan, radians
from time import monotonic

import numpy as np
from scipy.spatial.transform import Rotation

from fisheye_core.background import Background
from fisheye_core.errors import BugError, FisheyeError
from fisheye_geometry.attitude import Attitude
from fisheye_geometry.rig import Pair
from panorama_stitch.overlap.monitor import SeamMonitor, SeamState
from panorama_stitch.overlap.overlap_result import Overlap
from panorama_stitch.overlap.view import OverlapView
from panorama_stitch.pipeline.rig_state import RigState

_EVERY_S = 1.0
_SAME_RAD = radians(0.5)
"""What many moments tell replaces a measurement that is no farther from it."""


@dataclass
class _Watched:
    """The monitor of one pair, and what it saw last."""

    attitude: Attitude
    monitor: SeamMonitor
    state: SeamState | None = None


class SeamWatch:
    """Looks at one frame set a second with bounded memory, and never moves a seam by itself."""

    def __init__(self, rig: RigState):
        """Start; `rig` is what is known of the cameras."""
        self._rig = rig
        self._background = Background(self._failed)
        self._watched: dict[Pair, _Watched] = {}
        self._job: Future | None = None
        self._due_s = 0.0
        self._bug = ''

    @property
    def is_due(self) -> bool:
        """Whether it is time to look again."""
        return monotonic() >= self._due_s and (self._job is None or self._job.done())

    def take(self, images: Sequence[np.ndarray], overlaps: Sequence[Overlap]) -> Future:
        """Look at live images of all cameras and the overlaps in use, in the background."""
        now_s = monotonic()
        self._due_s = now_s + _EVERY_S
        self._job = self._background.do(self._look, list(images), list(overlaps), now_s)
        return self._job

    def states(self) -> dict[Pair, SeamState]:
        """Return how each pair held when it was last looked at."""
        watched = dict(self._watched)
        return {pair: one.state for pair, one in watched.items() if one.state is not None}

    def sharpened(self, overlaps: Sequence[Overlap]) -> list[Overlap]:
        """Return overlaps with what many moments tell in place of what one measurement told."""
        pairs = self._rig.pairs
        return [
            self._sharpened(overlap, pairs[index]) if index < len(pairs) else overlap
            for index, overlap in enumerate(overlaps)
        ]

    def complaints(self) -> list[str]:
        """Return what is wrong with the overlaps in use, in sentences."""
        cameras = self._rig.cameras
        bugs = [f'the overlaps are not watched: {self._bug}'] if self._bug else []
        return bugs + [
            f'{cameras[pair.right]} has moved by {state.drift_deg:.1f} degrees against '
            f'{cameras[pair.left]} since their overlap was measured: call calibrate_overlap'
            for pair, state in self.states().items()
            if state.drifted
        ]

    def metrics(self) -> dict[str, float]:
        """Return drift and quality of each pair, and the quality of the panorama: the worst."""
        cameras, states = self._rig.cameras, self.states()
        values: dict[str, float] = {}
        for pair, state in states.items():
            name = f'{cameras[pair.left]}-{cameras[pair.right]}'
            if not isnan(state.drift_deg):
                values[f'{name} overlap drift deg'] = state.drift_deg
            values[f'{name} seam quality'] = state.quality
        if states:
            values['quality'] = min(state.quality for state in states.values())
        return values

    def stop(self) -> None:
        """End the thread."""
        self._background.stop()

    def _look(
        self, images: Sequence[np.ndarray], overlaps: Sequence[Overlap], now_s: float
    ) -> None:
        watched: dict[Pair, _Watched] = {}
        views = [
            OverlapView(image, view.source, view.body)
            for image, view in zip(images, self._rig.camera_views, strict=True)
        ]
        for pair, overlap in zip(self._rig.pairs, overlaps, strict=False):
            if not overlap.found or overlap.attitude is None:
                continue
            one = self._watched.get(pair)
            if one is None or one.attitude != overlap.attitude:
                rotation = Rotation.from_matrix(overlap.attitude.matrix)
                one = _Watched(overlap.attitude, SeamMonitor(rotation))
            one.state = one.monitor.look(views[pair.left], views[pair.right], now_s)
            watched[pair] = one
        self._watched, self._bug = watched, ''

    def _sharpened(self, overlap: Overlap, pair: Pair) -> Overlap:
        one = self._watched.get(pair)
        result = one.monitor.sharpened() if one else None
        if result is None or not overlap.found or overlap.attitude is None:
            return overlap
        rotation, _ = result
        measured = Rotation.from_matrix(overlap.attitude.matrix)
        apart_rad = (measured.inv() * rotation).magnitude()
        if apart_rad > _SAME_RAD or overlap.attitude.is_pure_yaw:
            return overlap
        message = f'{overlap.message}; sharpened by {degrees(apart_rad):.2f} degrees over time'
        return replace(overlap, attitude=Attitude.of(rotation.as_matrix()), message=message)

    def _failed(self, error: FisheyeError) -> None:
        """Forget what was seen: the cameras may have become others."""
        self._watched = {}
        self._bug = str(error) if isinstance(error, BugError) else ''
