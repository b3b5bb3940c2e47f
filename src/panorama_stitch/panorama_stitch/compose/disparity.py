"""Disparity between two views, there and back, followed from frame to frame."""

import cv2
import numpy as np

from fisheye_core.parallel import run_parallel

_COLUMNS = 112
"""Views are reduced to about so many columns, those of 30 degrees from 640x480 px."""
_ROWS_IN_ONE, _MOST_ROWS = 8, 100
"""Rows are reduced so many times as much: what stands upright is found as a whole."""
_FARTHER, _RANGE = 12, 48
"""How many columns behind the far scene the search begins, and how many it goes through.

The far scene need not meet exactly, and what is nearer is displaced in one direction only.
"""
_BLOCK, _SMALL_STEP, _LARGE_STEP = 3, 20, 400
"""Side of what is compared, and what a change of disparity costs by a column, and by more."""
_SEEN_PX = 3
"""What one view alone shows has no match that matches it within so many columns."""
_NONE = 3
"""Sixteenths of a column that pass for none: the search rounds, and far things stay sharp."""
_OUTLIER_SIDE = 5
_AROUND = 17, 3
"""So many columns and rows around what is near move with it, and as many give way."""
_STILL, _MOVING = 1.5, 4.0
"""Grey levels of change from frame to frame, up to which nothing moves, and from which it does."""
_STEADY = 0.2
"""Share of the way to its new value that the disparity goes at once where nothing moves."""
_CHANGE_SIDES = 13, 3
_AGREE_PX = 4.0
"""Disparities that lead there and back again do so within so many columns."""
_RESIDUE_SHARE, _NOISE = 0.5, 5
"""Of what the views differ by they leave no more than that share, and grey levels of noise."""
_RESIDUE_SIDES = 9, 1


class Disparity:
    """Finds for each pixel of two views how far to the right the other one shows the same.

    Semi-global matching (H. Hirschmueller, "Stereo processing by semiglobal matching and mutual
    information", 2008, https://doi.org/10.1109/TPAMI.2007.1166) along rows. What is around near
    things moves with them, so that between near and far the picture is stretched and never torn.
    Where nothing moves the disparity is averaged over time; what moves is followed at once.

    Attributes
    ----------
    width, height : int
        Of the reduced views.
    columns, rows : ndarray
        (height, width) float32: where each pixel is.
    there, back : ndarray
        (height, width) float32, px of the reduced views: what lies at x in the left one lies at
        x + there in the right one; and the other way round.
    """

    def __init__(self, width: int, height: int):
        """Prepare for views of `width` times `height` px."""
        across = max(1, round(width / _COLUMNS))
        down = max(_ROWS_IN_ONE * across, round(height / _MOST_ROWS))
        self.width, self.height = max(1, width // across), max(1, height // down)
        self._whole = np.s_[: self.height * down, : self.width * across]
        sides = np.arange(self.width, dtype=np.float32), np.arange(self.height, dtype=np.float32)
        self.columns, self.rows = np.meshgrid(*sides)
        first = -_FARTHER, _FARTHER + 1 - _RANGE
        self._left = _View(self, width, height, first[0], cv2.erode)
        self._right = _View(self, width, height, first[1], cv2.dilate)
        self.there, self.back = self._left.moved, self._right.moved
        shape = self.height, self.width
        self._weight = np.ones(shape, np.float32)
        self._at, self._again = np.empty((2, *shape), np.float32)
        self._is = np.empty(shape, np.bool_)
        self._even, self._followed = np.empty((2, *shape), np.uint8)
        self._is_first = True

    def follow(self, left: np.ndarray, right: np.ndarray) -> None:
        """Follow the next views (height, width[, channels]) uint8."""
        ours, theirs = self._left, self._right
        run_parallel([lambda: ours.look(left), lambda: theirs.look(right)])
        if not self._is_first:
            change = np.maximum(ours.change, theirs.change, out=self._weight)
            change -= _STILL
            change *= 1 / (_MOVING - _STILL)
            np.clip(change, _STEADY, 1, out=change)
        self._is_first = False
        run_parallel(
            [
                lambda: ours.follow(theirs, self._weight),
                lambda: theirs.follow(ours, self._weight),
            ]
        )

    def sample(self, field: np.ndarray, at: np.ndarray, out: np.ndarray) -> None:
        """Interpolate a field in columns `at` (height, width) of each row."""
        border = {'borderMode': cv2.BORDER_REPLICATE}
        cv2.remap(field, at, self.rows, cv2.INTER_LINEAR, dst=out, **border)

    def judge(self, agrees: np.ndarray, counts: np.ndarray) -> None:
        """Find where the disparity is right, and where it matters.

        Parameters
        ----------
        agrees
            (height, width) uint8, overwritten: 1 where there and back leads to where it began, and
            the views show the same; 0 elsewhere.
        counts
            The same: 1 there, and where the views differ if they are not warped.
        """
        at, again = self._at, self._again
        agrees[:] = 1
        for there, back in ((self.there, self.back), (self.back, self.there)):
            np.add(self.columns, there, out=at)
            self.sample(back, at, again)
            again += there
            agrees &= np.less(np.abs(again, out=again), _AGREE_PX, out=self._is)
        ours, theirs = self._left.grey, self._right.grey
        # They need not be equally bright.
        scale = max(1.0, cv2.mean(ours)[0]) / max(1.0, cv2.mean(theirs)[0])
        even = cv2.convertScaleAbs(theirs, dst=self._even, alpha=scale)
        np.add(self.columns, self.there, out=at)
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
        """Reduce a picture as the views are."""
        size = self.width, self.height
        return cv2.resize(image[self._whole], size, interpolation=cv2.INTER_AREA)


class _View:
    """One of the views: its reduced grey picture, and where in the other one it lies."""

    def __init__(self, frame: Disparity, width: int, height: int, first: int, nearest):
        """Prepare to search from a `first` disparity on; `nearest` finds the nearest around."""
        shape = frame.height, frame.width
        self.moved, self.change = np.zeros((2, *shape), np.float32)
        self._whole = frame._whole
        self._grey = np.empty((height, width), np.uint8)[frame._whole]
        self.grey, self._before, self._difference = np.zeros((3, *shape), np.uint8)
        self._nearest = nearest
        self._not_found = np.int16((first - 1) * cv2.StereoMatcher_DISP_SCALE)
        # Pixels are left out whose match might be beyond the edge.
        self._border = 0, 0, max(0, first + _RANGE), max(0, -first)
        self._inner = np.s_[:, self._border[2] : self._border[2] + frame.width]
        bordered = frame.height, frame.width + sum(self._border)
        self._bordered = np.empty((2, *bordered), np.uint8)
        self._disparity = np.empty(bordered, np.int16)
        self._kept, self._steady = np.empty((2, *shape), np.int16)
        self._is, self._has_match = np.empty((2, *shape), np.bool_)
        self._found, self._near = np.empty((2, *shape), np.float32)
        self._around = np.ones(_AROUND[::-1], np.uint8)
        self._search = cv2.StereoSGBM_create(
            minDisparity=first,
            numDisparities=_RANGE,
            blockSize=_BLOCK,
            P1=_SMALL_STEP,
            P2=_LARGE_STEP,
            disp12MaxDiff=_SEEN_PX,
            preFilterCap=31,
            mode=cv2.STEREO_SGBM_MODE_HH,
        )

    def look(self, image: np.ndarray) -> None:
        """Reduce the next picture and find where it changed."""
        self.grey, self._before = self._before, self.grey
        grey = image[self._whole]
        if image.ndim == 3:
            grey = cv2.cvtColor(grey, cv2.COLOR_BGR2GRAY, dst=self._grey)
        size = self.grey.shape[::-1]
        cv2.resize(grey, size, dst=self.grey, interpolation=cv2.INTER_AREA)
        cv2.absdiff(self.grey, self._before, dst=self._difference)
        cv2.boxFilter(self._difference, cv2.CV_32F, _CHANGE_SIDES, dst=self.change)

    def follow(self, other: '_View', weight: np.ndarray) -> None:
        """Find where the other picture shows the same, and go there by a weight."""
        for grey, bordered in zip((self.grey, other.grey), self._bordered, strict=True):
            cv2.copyMakeBorder(grey, *self._border, cv2.BORDER_REPLICATE, dst=bordered)
        self._search.compute(*self._bordered, self._disparity)
        disparity, kept, found = self._disparity[self._inner], self._kept, self._found
        # What has no match is far: something near hides it from the other camera.
        np.greater(np.abs(disparity, out=kept), _NONE, out=self._is)
        self._is &= np.not_equal(disparity, self._not_found, out=self._has_match)
        np.multiply(disparity, self._is, out=kept)
        # Disparities are counted to the left, in 16ths.
        cv2.medianBlur(kept, _OUTLIER_SIDE, dst=self._steady)
        scale = -1 / cv2.StereoMatcher_DISP_SCALE
        cv2.multiply(self._steady, scale, dst=found, dtype=cv2.CV_32F)
        self._nearest(found, self._around, dst=self._near)
        cv2.blur(self._near, _AROUND, dst=found)
        found -= self.moved
        found *= weight
        self.moved += found
