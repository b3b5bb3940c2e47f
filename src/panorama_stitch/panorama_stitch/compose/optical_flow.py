"""Optical flow between two views, there and back, followed from frame to frame."""

import cv2
import numpy as np

from fisheye_core.parallel import run_parallel

_COLUMNS = 56
"""Views are reduced to so many columns, half of those of 30 degrees from 640x480 px."""
_MOST_ROWS = 500
"""Nor do they keep many more rows: narrow overlaps of large pictures take no longer."""
_LEAST_SIDE = 80
"""Smaller ones get a border: the coarsest picture of the search is an eighth of their size."""
_FINEST_SCALE = 1
_STILL, _MOVING = 1.5, 4.0
"""Grey levels of change from frame to frame, up to which nothing moves, and from which it does."""
_STEADY = 0.2
"""Share of the way to its new value that the flow goes at once where nothing moves."""
_CHANGE_SIDE = 7
_AGREE_PX = 2.0
"""Flows that lead there and back again do so within so many columns."""
_RESIDUE_SHARE, _NOISE = 0.5, 5
"""Of what the views differ by flow leaves no more than that share, and grey levels of noise."""
_RESIDUE_SIDES = 5, 5


class OpticalFlow:
    """Finds for each pixel of two views where the other one shows the same.

    Dense inverse search (T. Kroeger et al., "Fast optical flow using dense inverse search", 2016,
    https://doi.org/10.1007/978-3-319-46493-0_29) starts from the flow of the previous frame. Where
    nothing moves the flow is averaged over time; what moves is followed at once.

    Attributes
    ----------
    width, height : int
        Of the reduced views, a border among them.
    inner : tuple of slice
        Rows and columns without the border.
    grid : ndarray
        (height, width, 2) float32: x and y of each pixel.
    flows : tuple of ndarray
        (height, width, 2) float32 each, px of the reduced views: what lies at p in the left one
        lies at p + flow in the right one; and the other way round.
    """

    def __init__(self, width: int, height: int):
        """Prepare for views of `width` times `height` px."""
        factor = max(1, round(width / _COLUMNS), round(height / _MOST_ROWS))
        self._size = max(1, width // factor), max(1, height // factor)
        self._whole = np.s_[: self._size[1] * factor, : self._size[0] * factor]
        self.width, self.height = (max(side, _LEAST_SIDE) for side in self._size)
        left, top = (self.width - self._size[0]) // 2, (self.height - self._size[1]) // 2
        self.inner = np.s_[top : top + self._size[1], left : left + self._size[0]]
        sides = np.arange(self.width, dtype=np.float32), np.arange(self.height, dtype=np.float32)
        self.grid = np.dstack(np.meshgrid(*sides))
        self._views = _View(self, width, height), _View(self, width, height)
        self._weight = np.ones_like(self.grid)
        self._scratch = [np.empty_like(self.grid) for _ in range(2)]
        self._across = np.empty((self.height, self.width), np.float32)
        self._is = np.empty((self.height, self.width), np.bool_)
        self._even, self._followed = np.empty((2, self.height, self.width), np.uint8)
        self._is_first = True

    @property
    def flows(self) -> tuple[np.ndarray, np.ndarray]:
        """As described above."""
        return self._views[0].flow, self._views[1].flow

    def follow(self, left: np.ndarray, right: np.ndarray) -> None:
        """Follow the next views (height, width[, channels]) uint8."""
        ours, theirs = self._views
        run_parallel([lambda: ours.look(left), lambda: theirs.look(right)])
        if not self._is_first:
            change = np.maximum(ours.change, theirs.change, out=ours.change)
            change -= _STILL
            change *= 1 / (_MOVING - _STILL)
            np.clip(change, _STEADY, 1, out=change)
            cv2.merge([change, change], dst=self._weight)
        self._is_first = False
        run_parallel(
            [
                lambda: ours.follow(theirs, self._weight),
                lambda: theirs.follow(ours, self._weight),
            ]
        )

    def sample(self, field: np.ndarray, at: np.ndarray, out: np.ndarray) -> None:
        """Interpolate a field at positions (height, width, 2)."""
        cv2.remap(field, at, None, cv2.INTER_LINEAR, dst=out, borderMode=cv2.BORDER_REPLICATE)

    def judge(self, agrees: np.ndarray, counts: np.ndarray) -> None:
        """Find where the flow is right, and where it matters.

        Parameters
        ----------
        agrees
            (height, width) uint8, overwritten: 1 where there and back leads to where it began, and
            the views show the same; 0 elsewhere.
        counts
            The same: 1 there, and where the views differ if they are not warped.
        """
        at, back = self._scratch
        agrees[:] = 1
        for there, again in (self.flows, self.flows[::-1]):
            np.add(self.grid, there, out=at)
            self.sample(again, at, back)
            back += there
            # Along an upright edge any height will do.
            across = np.abs(cv2.extractChannel(back, 0, dst=self._across), out=self._across)
            agrees &= np.less(across, _AGREE_PX, out=self._is)
        ours, theirs = (view.grey for view in self._views)
        # They need not be equally bright.
        scale = max(1.0, cv2.mean(ours)[0]) / max(1.0, cv2.mean(theirs)[0])
        even = cv2.convertScaleAbs(theirs, dst=self._even, alpha=scale)
        np.add(self.grid, self.flows[0], out=at)
        self.sample(even, at, self._followed)
        for image, residue in ((self._followed, self._followed), (even, self._even)):
            cv2.absdiff(ours, image, dst=residue)
            cv2.blur(residue, _RESIDUE_SIDES, dst=residue)
        np.greater(self._even, _NOISE, out=self._is)
        np.copyto(counts, self._is)
        cv2.convertScaleAbs(self._even, dst=self._even, alpha=_RESIDUE_SHARE, beta=_NOISE)
        agrees &= np.less(self._followed, self._even, out=self._is)
        counts |= agrees

    def reduced(self, image: np.ndarray) -> np.ndarray:
        """Reduce a picture as the views are; the border repeats its edge."""
        small = cv2.resize(image[self._whole], self._size, interpolation=cv2.INTER_AREA)
        rows, columns = self.inner
        bottom, right = self.height - rows.stop, self.width - columns.stop
        return cv2.copyMakeBorder(
            small, rows.start, bottom, columns.start, right, cv2.BORDER_REPLICATE
        )


class _View:
    """One of the views: its reduced grey picture, and the flow from it to the other."""

    def __init__(self, frame: OpticalFlow, width: int, height: int):
        shape = frame.height, frame.width
        self.flow = np.zeros((*shape, 2), np.float32)
        self.change = np.zeros(shape, np.float32)
        rows, columns = frame.inner
        self._border = rows.start, shape[0] - rows.stop, columns.start, shape[1] - columns.stop
        self._whole = frame._whole
        self._grey = np.empty((height, width), np.uint8)[frame._whole]
        self._small = np.empty((rows.stop - rows.start, columns.stop - columns.start), np.uint8)
        self.grey, self._before = np.zeros(shape, np.uint8), np.zeros(shape, np.uint8)
        self._difference = np.empty(shape, np.uint8)
        self._found = np.empty_like(self.flow)
        self._search = cv2.DISOpticalFlow_create(cv2.DISOPTICAL_FLOW_PRESET_ULTRAFAST)
        self._search.setFinestScale(_FINEST_SCALE)

    def look(self, image: np.ndarray) -> None:
        """Reduce the next picture and find where it changed."""
        self.grey, self._before = self._before, self.grey
        grey = image[self._whole]
        if image.ndim == 3:
            grey = cv2.cvtColor(grey, cv2.COLOR_BGR2GRAY, dst=self._grey)
        size = self._small.shape[::-1]
        cv2.resize(grey, size, dst=self._small, interpolation=cv2.INTER_AREA)
        cv2.copyMakeBorder(self._small, *self._border, cv2.BORDER_REPLICATE, dst=self.grey)
        cv2.absdiff(self.grey, self._before, dst=self._difference)
        side = _CHANGE_SIDE, _CHANGE_SIDE
        cv2.boxFilter(self._difference, cv2.CV_32F, side, dst=self.change)

    def follow(self, other: '_View', weight: np.ndarray) -> None:
        """Find the flow to the other picture, and go there by a weight (height, width, 2)."""
        np.copyto(self._found, self.flow)
        self._search.calc(self.grey, other.grey, self._found)
        self._found -= self.flow
        self._found *= weight
        self.flow += self._found
