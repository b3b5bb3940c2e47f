"""A calibrated camera, and which part of its sensor the pictures show."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fisheye_core.errors import CalibrationError
from fisheye_geometry.lens import MAX_PICTURE_SIDE_PX, Lens

IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
_PROBES = 9
"""Pixels a side of the grid on which a lens is tried."""
_MAX_ASPECT = 16
"""Of the focal lengths: pixels that are binned one way only."""
_MIN_ANGLE_RAD = np.radians(1.0)


@dataclass(frozen=True)
class Camera:
    """A named, calibrated camera.

    Attributes
    ----------
    name
        The camera's name, '' where the file has none.
    lens
        What it sees.
    rectification
        R of camera_info, nine numbers in row order.
    projection
        P of camera_info, twelve numbers in row order; () for K beside a column of zeros.

    Raises
    ------
    CalibrationError
        If R or P is not finite, or no camera can have such a lens.
    """

    name: str
    lens: Lens
    rectification: tuple[float, ...] = IDENTITY
    projection: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        for name, values in (('R', self.rectification), ('P', self.projection)):
            for value in values:
                if not abs(value) <= sys.float_info.max:
                    raise CalibrationError(f'{name} holds {value}; expected finite numbers')
        _check_plausible(self.lens)

    def size_mismatch(self, width: int, height: int) -> str:
        """Explain why images of a size, px, cannot come from this camera; '' if they can."""
        if (self.lens.width, self.lens.height) == (width, height):
            return ''
        return (
            f'the calibration is for {self.lens.width}x{self.lens.height} px; '
            f'the pictures have {width}x{height} px'
        )

    @property
    def projection_matrix(self) -> np.ndarray:
        """P of camera_info, (3, 4) float64."""
        if self.projection:
            return np.array(self.projection).reshape(3, 4)
        return np.hstack([self.lens.matrix, np.zeros((3, 1))])


def _check_plausible(lens: Lens) -> None:
    """Refuse numbers that a lens can have, but no camera."""
    low, high = sorted((lens.focal_x_px, lens.focal_y_px))
    if low < 1 or high > _MAX_ASPECT * low:
        raise CalibrationError(
            f'the focal lengths are {lens.focal_x_px:g} and {lens.focal_y_px:g} px; expected 1 px '
            f'or more, and no more than {_MAX_ASPECT} times as much one way as the other'
        )
    if lens.max_angle_rad < _MIN_ANGLE_RAD:
        raise CalibrationError(
            f'the distortion of the lens ends {np.degrees(lens.max_angle_rad):.2g} degrees off '
            f'its axis; expected {np.degrees(_MIN_ANGLE_RAD):g} or more'
        )
    for name, center, side in (
        ('x', lens.center_x_px, lens.width),
        ('y', lens.center_y_px, lens.height),
    ):
        if not -MAX_PICTURE_SIDE_PX <= center <= side + MAX_PICTURE_SIDE_PX:
            raise CalibrationError(
                f'center_{name}_px is {center:g}; expected it within {MAX_PICTURE_SIDE_PX} px '
                f'of the picture of {lens.width}x{lens.height} px'
            )
    x, y = np.linspace(0, lens.width - 1, _PROBES), np.linspace(0, lens.height - 1, _PROBES)
    if not lens.unproject(np.stack(np.meshgrid(x, y), axis=-1))[1].any():
        raise CalibrationError(
            f'no ray meets the picture of {lens.width}x{lens.height} px with the principal '
            f'point ({lens.center_x_px:g}, {lens.center_y_px:g}) px and the focal length '
            f'{lens.focal_x_px:g} px; expected a lens that sees some of it'
        )


def camera_from(
    name: str, lens: Lens, rectification: Sequence[float], projection: Sequence[float]
) -> Camera:
    """Return a camera of R and P as camera_info has them, where zeros mean that none is given."""
    return Camera(
        name,
        lens,
        tuple(map(float, rectification)) if any(rectification) else IDENTITY,
        tuple(map(float, projection)) if any(projection) else (),
    )


@dataclass(frozen=True)
class Readout:
    """The part of the sensor that pictures show: `roi` and `binning` of camera_info.

    Attributes
    ----------
    x_offset, y_offset, width, height
        Of the part, px of the sensor; a width and height of 0 mean all of it.
    binning_x, binning_y
        Pixels of the sensor that make one of the picture, along x and y; 0 means 1.
    """

    x_offset: int = 0
    y_offset: int = 0
    width: int = 0
    height: int = 0
    binning_x: int = 0
    binning_y: int = 0

    def of(self, camera: Camera) -> Camera:
        """Return the camera whose pictures are that part, of one that is given for the sensor.

        Raises
        ------
        CalibrationError
            If the part is not on the sensor, or smaller than one pixel of the picture.
        """
        if self == Readout():
            return camera
        lens = camera.lens
        width, height = self.width or lens.width, self.height or lens.height
        bin_x, bin_y = max(1, self.binning_x), max(1, self.binning_y)
        for name, offset, side, whole, binned in (
            ('x', self.x_offset, width, lens.width, bin_x),
            ('y', self.y_offset, height, lens.height, bin_y),
        ):
            if offset + side > whole:
                raise CalibrationError(
                    f'roi has {side} px from {offset} on along {name}; expected them within the '
                    f'{whole} px of width and height'
                )
            if binned > side:
                raise CalibrationError(f'binning_{name} is {binned}; expected up to {side} px')
        seen = replace(
            lens,
            width=width // bin_x,
            height=height // bin_y,
            focal_x_px=lens.focal_x_px / bin_x,
            focal_y_px=lens.focal_y_px / bin_y,
            center_x_px=_binned(lens.center_x_px - self.x_offset, bin_x),
            center_y_px=_binned(lens.center_y_px - self.y_offset, bin_y),
            skew_px=lens.skew_px / bin_x,
        )
        return replace(camera, lens=seen, projection=self._projection(camera, bin_x, bin_y))

    def _projection(self, camera: Camera, bin_x: int, bin_y: int) -> tuple[float, ...]:
        if not camera.projection:
            return ()
        to_part = np.array(
            [
                [1 / bin_x, 0.0, _binned(-self.x_offset, bin_x)],
                [0.0, 1 / bin_y, _binned(-self.y_offset, bin_y)],
                [0.0, 0.0, 1.0],
            ]
        )
        return tuple((to_part @ camera.projection_matrix).ravel().tolist())

    def __str__(self) -> str:
        bins = f'{max(1, self.binning_x)}x{max(1, self.binning_y)}'
        size = f'{self.width}x{self.height}' if self.width or self.height else 'all'
        return f'binning {bins}, roi {size} at ({self.x_offset}, {self.y_offset})'


def _binned(at_px: float, count: int) -> float:
    """Return where a coordinate lies once `count` pixels are one; integers are pixel centres."""
    return (at_px + 0.5) / count - 0.5
