"""What a sheet may be when it is not the one that was named."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import inf

import numpy as np

from fisheye_core.errors import CalibrationError, SettingError
from fisheye_undistort.detect.chessboard import size_of_any_chessboard
from fisheye_undistort.detect.detection import Detector
from fisheye_undistort.detect.looking import look_at
from fisheye_undistort.detect.markers import dictionary_in, find_charuco
from fisheye_undistort.detect.pictures import NamedPicture
from fisheye_undistort.fit.model_fitter import ModelFitter
from fisheye_undistort.target.target import STANDARD, Target

_MUCH_BETTER = 3.0
"""Points must scatter so much less about the lens for another target to be taken."""
_MOST_PICTURES = 4
"""Pictures that are looked at once more for each guess."""


def guess(pictures: Sequence[NamedPicture], detector: Detector) -> tuple[Target | None, str]:
    """Look for another target than the one that was named.

    Parameters
    ----------
    pictures
        Some that do not show the target.
    detector
        What looked for it.

    Returns
    -------
    target : Target or None
        What the pictures show if the numbers that were given may mean it as well: squares for
        inner corners, rows and columns exchanged, another layout or dictionary.
    seen : str
        What else they show, '' for nothing.
    """
    some = pictures[:: -(-len(pictures) // _MOST_PICTURES) or 1]
    for other in _same_numbers(detector.target):
        if _shows(some, replace(detector, target=other)):
            return other, ''
    for picture in some:
        if seen := _what_is_there(picture, detector):
            return seen
    return None, ''


def better_layout(pictures: Sequence[NamedPicture], detector: Detector) -> Target:
    """Return the target, or the one beside it that fits what pictures show better.

    A ChArUco board of the other layout is not missed, but a few of its corners are found in wrong
    places. Nor is a grid of circles with rows and columns exchanged, if their distances are alike.
    """
    target = detector.target
    if target.kind == 'circles' and target.rows != target.columns and target.dx_mm != target.dy_mm:
        other = replace(target, rows=target.columns, columns=target.rows)
        noise_px = [_noise_px(pictures, replace(detector, target=t)) for t in (target, other)]
        return other if _MUCH_BETTER * noise_px[1] < noise_px[0] else target
    if target.kind != 'charuco' or target.rows % 2:
        return target
    other = replace(target, legacy=not target.legacy)
    corners = [
        sum(len(find_charuco(picture.gray, layout)[1]) for picture in pictures)
        for layout in (target, other)
    ]
    return other if corners[1] > corners[0] else target


def _noise_px(pictures: Sequence[NamedPicture], detector: Detector) -> float:
    """Scatter of the points about the lens that fits them best; inf if there are none."""
    found = [(picture, look_at(picture, detector)) for picture in pictures]
    views = [(picture, view) for picture, view in found if not isinstance(view, str)]
    if not views:
        return inf
    height, width = views[0][0].gray.shape
    of_one_size = [view for picture, view in views if picture.gray.shape == (height, width)]
    try:
        return ModelFitter(of_one_size, detector.target, (width, height)).rough().noise_px
    except (CalibrationError, FloatingPointError, np.linalg.LinAlgError):
        return inf


def _same_numbers(target: Target) -> Iterator[Target]:
    """Targets that the same numbers may mean."""
    rows, columns = target.rows, target.columns
    changes: list[dict] = [{'rows': columns, 'columns': rows}]
    if target.kind == 'circles':
        changes.append(
            {'rows': columns, 'columns': rows, 'dx_mm': target.dy_mm, 'dy_mm': target.dx_mm}
        )
    if target.kind == 'chessboard':
        changes += [{'rows': rows - 1, 'columns': columns - 1}]
        changes += [{'rows': columns - 1, 'columns': rows - 1}]
    if target.kind == 'charuco':
        changes += [{'rows': rows + 1, 'columns': columns + 1}]
        changes += [{'rows': columns + 1, 'columns': rows + 1}]
    for change in changes:
        try:
            other = replace(target, **change)
        except SettingError:
            continue
        if other != target:
            yield other


def _what_is_there(picture: NamedPicture, detector: Detector) -> tuple[Target | None, str] | None:
    target = detector.target
    size = size_of_any_chessboard(picture.gray)
    if (
        size
        and target.kind == 'chessboard'
        and sorted(size) != sorted((target.rows, target.columns))
    ):
        return None, f'{size[0]} x {size[1]} inner corners of a chessboard'
    for kind, other in STANDARD.items():
        if kind != target.kind and _shows([picture], replace(detector, target=other)):
            return None, f'the target {other}'
    if target.kind == 'charuco' and (name := dictionary_in(picture.gray)):
        other = replace(target, dictionary=name)
        if _shows([picture], replace(detector, target=other)):
            return other, ''
        return None, f'markers of {name}'
    if size and target.kind != 'charuco':
        return None, f'{size[0]} x {size[1]} inner corners of a chessboard'
    return None


def _shows(pictures: Sequence[NamedPicture], detector: Detector) -> bool:
    """Whether any of the pictures shows a detector's target."""
    for picture in pictures:
        try:
            detector(picture.name, picture.gray)
        except (CalibrationError, SettingError):
            continue
        return True
    return False
