"""Follow corners from picture to picture while a robot turns."""

from collections.abc import Sequence

import numpy as np

from fisheye_core.errors import CalibrationError, ImageFormatError
from panorama_stitch.turn.corners import Corners
from panorama_stitch.turn.sightings import Sightings, joined

_STEP_WIDTHS = 0.025
"""A picture is kept when the scene has moved this share of the picture's width since the last."""
_LEAST = 25
"""Corners that must be found again from one kept picture to the next."""


class TurnTracker:
    """Chooses pictures by how far the scene moved, and follows corners through them.

    Attributes
    ----------
    frames : list
        The sets of pictures that were kept, one (height, width) uint8 a camera.
    count : int
        Sets that came.
    """

    def __init__(self, cameras: Sequence[str]):
        self._cameras = tuple(cameras)
        self.frames: list[tuple[np.ndarray, ...]] = []
        self.count = 0
        self._tracks = [Corners() for _ in cameras]
        self._rows: list[tuple[int, int, np.ndarray, np.ndarray]] = []

    def add(self, pictures: Sequence[np.ndarray]) -> bool:
        """Look at the next pictures, one a camera; tell whether they were kept.

        Raises
        ------
        ImageFormatError
            If the size of one is not that of those before it.
        CalibrationError
            If it shows so little of what the last ones did that a picture between is missing.
        """
        self.count += 1
        if not self.frames:
            return self._keep(pictures)
        for name, picture, before in zip(self._cameras, pictures, self.frames[-1], strict=True):
            if picture.shape != before.shape:
                raise ImageFormatError(
                    f'picture {self.count} of {name} has {picture.shape[1]}x{picture.shape[0]} '
                    f'px; those before it have {before.shape[1]}x{before.shape[0]} px'
                )
        moved = [
            track.follow(before, picture) / picture.shape[1]
            for track, before, picture in zip(self._tracks, self.frames[-1], pictures, strict=True)
        ]
        if max(moved) < _STEP_WIDTHS:
            return False
        for name, track in zip(self._cameras, self._tracks, strict=True):
            if (found := track.settle()) < _LEAST:
                raise CalibrationError(
                    f'picture {self.count} of {name} shows only {found} of the corners that the '
                    f'one before it shows; expected {_LEAST} and more: turn more slowly, with '
                    'pictures at most 8 degrees apart, where there is more to see'
                )
        return self._keep(pictures)

    def _keep(self, pictures) -> bool:
        number = len(self.frames)
        self.frames.append(tuple(pictures))
        for camera, (track, picture) in enumerate(zip(self._tracks, pictures, strict=True)):
            track.fill(picture)
            self._rows.append((camera, number, track.ids, track.points))
        return True

    def sightings(self) -> Sightings:
        """Return where corners were seen; each is a landmark of its own."""
        # The same number in two cameras is not the same corner.
        return joined(
            [
                (camera, frame, ids * len(self._cameras) + camera, points)
                for camera, frame, ids, points in self._rows
            ]
        ).numbered()
