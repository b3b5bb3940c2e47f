"""Collect views of a target that tell something new about the lens."""

from collections import Counter

import numpy as np

from fisheye_core.errors import CalibrationError, ImageFormatError
from fisheye_undistort.detect.detection import Detector
from fisheye_undistort.detect.looking import Found, look_at
from fisheye_undistort.detect.pictures import NamedPicture
from fisheye_undistort.fit.angle_map import lit_part, picture_grid, place_name
from fisheye_undistort.fit.estimate import TargetView
from fisheye_undistort.target.target import Target

_MOVED = 0.01
"""A view is new where the target lies this share of the picture's width from all before."""
_STILL = 0.005
"""Between two looks at a moving target it must not move more, or it is blurred and sheared."""
_COVERED = 0.12
"""A place is covered where a point of the target lies within this share of the width."""
_MOST_PLACES = 2
_CELLS = (8, 6)
"""Columns and rows into which the picture is divided to tell how much of it was covered."""


class Collector:
    """Collector of the views that add information.

    Attributes
    ----------
    views : list of TargetView
        What was kept.
    state : str
        Why the last picture was not used, '' if it was.
    skipped : dict
        Name of each picture that was not used, and why; those of a moving target are not listed.
    looks : int
        Pictures that were added.
    size : tuple
        Width and height of the pictures, px.
    brightest : ndarray
        (height, width) uint8, the brightest that each pixel was.
    example : ndarray
        (height, width) uint8, the picture of the view that fills most of it.
    """

    def __init__(self, detector: Detector):
        self._detector = detector
        self._places: list[np.ndarray] = []
        self._last: np.ndarray | None = None
        self._found = self.looks = 0
        self._largest = 0.0
        self._apart_px: np.ndarray | float = np.inf
        self.views: list[TargetView] = []
        self.state = ''
        self.skipped: dict[str, str] = {}
        self.size = (0, 0)
        self.brightest = self.example = np.zeros((0, 0), np.uint8)

    def add(self, picture: NamedPicture, found: Found | None = None) -> bool:
        """Look at a picture, unless it is known what was found; tell whether its view was kept.

        Raises
        ------
        ImageFormatError
            If its size differs from that of the pictures before.
        """
        self._check_size(picture)
        self.brightest = np.maximum(self.brightest, picture.gray)
        self.looks += 1
        self.state = self._judge(picture, found or look_at(picture, self._detector))
        if self.state and not picture.moving:
            self.skipped[picture.name] = self.state
        return not self.state

    @property
    def found_any(self) -> bool:
        """Whether any picture showed the target, even if its view was not kept."""
        return self._found > 0

    def _judge(self, picture: NamedPicture, view: Found) -> str:
        """Keep a picture's view, or say why not."""
        before, self._last = self._last, None
        if isinstance(view, str):
            return view
        self._found += 1
        place = self._last = _place(view, self._detector.target)
        if picture.moving and not _close(place, before, _STILL * self.size[0]):
            return 'the target moves'
        for other, kept in zip(self._places, self.views, strict=True):
            if _close(place, other, _MOVED * self.size[0]):
                return f'shows the target where {kept.name} does'
        self._keep(view, place, picture)
        return ''

    def _check_size(self, picture):
        height, width = picture.gray.shape
        if not self.brightest.size:
            self.size = (width, height)
            self.brightest = np.zeros_like(picture.gray)
        if self.size != (width, height):
            raise ImageFormatError(
                f'{picture.name} has {width}x{height} px; the pictures before it have '
                f'{self.size[0]}x{self.size[1]} px, and all must come from one camera'
            )

    def _keep(self, view, place, picture):
        self.views.append(view)
        self._places.append(place)
        offsets = picture_grid(self.size)[:, :, None] - view.points_px
        self._apart_px = np.minimum(self._apart_px, np.linalg.norm(offsets, axis=-1).min(axis=-1))
        extent = float(np.prod(np.ptp(view.points_px, axis=0)))
        if extent > self._largest:
            self._largest, self.example = extent, picture.gray

    def finish(self) -> list[TargetView]:
        """Return the views.

        Raises
        ------
        CalibrationError
            If there are none, or many pictures of one and the same.
        """
        if not self._found:
            last = f'; the last: {self.state}' if self.looks else ''
            raise CalibrationError(f'the target is in none of {self.looks} pictures{last}')
        if not self.views:
            raise CalibrationError(
                f'the target moves in all {self.looks} pictures; hold it still for half a second'
            )
        if len(self.views) == 1 and self._found > 1:
            raise CalibrationError(
                f'all {self._found} views of the target are alike; move and tilt it between the '
                f"pictures, by more than {_MOVED:.0%} of the picture's width"
            )
        return self.views

    def progress(self) -> str:
        """Describe how far the collection has come."""
        if not self.views:
            return 'no view of the target yet'
        points = np.concatenate([view.points_px for view in self.views])
        size = np.array(self.size)
        cells = (points / size * _CELLS).astype(int).clip(0, np.array(_CELLS) - 1)
        share = len(np.unique(cells, axis=0)) / np.prod(_CELLS)
        return f'{len(self.views)} views, {share:.0%} of the picture covered{self._missing()}'

    def _missing(self) -> str:
        """Name the places where the target should be shown next."""
        is_missing = lit_part(self.brightest) & (self._apart_px > _COVERED * self.size[0])
        far = picture_grid(self.size)[is_missing]
        places = Counter(place_name(x, y, self.size[::-1]) for x, y in far).most_common(
            _MOST_PLACES
        )
        return f'; show it at the {" and the ".join(name for name, _ in places)}' if places else ''


def _place(view: TargetView, target: Target) -> np.ndarray:
    """Where a view's points lie, px, in rows to be compared with those of another view.

    Markers tell which point is which, and each point of the target has a row, NaN where it is not
    seen: points come and go. Of other targets, whose order may change, the only row has their mean
    and how they are spread.
    """
    if target.has_markers:
        rows = np.full((len(target.cells), 2), np.nan)
        rows[view.ids] = view.points_px
        return rows
    spread = np.cov(view.points_px.T)
    scale = np.sqrt(np.trace(spread))
    return np.concatenate([view.points_px.mean(axis=0), spread[np.triu_indices(2)] / scale])[None]


def _close(place: np.ndarray, other: np.ndarray | None, limit_px: float) -> bool:
    if other is None:
        return False
    apart = np.linalg.norm(place - other, axis=-1)
    in_both = apart[np.isfinite(apart)]
    return len(in_both) > 0 and float(in_both.mean()) < limit_px
