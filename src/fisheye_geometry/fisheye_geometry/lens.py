"""Lenses by the names that ROS gives their models."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from fisheye_core.errors import CalibrationError
from fisheye_geometry.annular_lens import AnnularLens
from fisheye_geometry.fisheye_lens import FisheyeLens
from fisheye_geometry.lens_model import MAX_PICTURE_SIDE_PX, Lens
from fisheye_geometry.pinhole_lens import PinholeLens

__all__ = [
    'MAX_PICTURE_SIDE_PX',
    'MODELS',
    'AnnularLens',
    'FisheyeLens',
    'Lens',
    'PinholeLens',
    'make_lens',
]

MODELS: dict[str, type[Lens]] = {
    'equidistant': FisheyeLens,
    'fisheye': FisheyeLens,
    'plumb_bob': PinholeLens,
    'rational_polynomial': PinholeLens,
    'annular': AnnularLens,
}


def make_lens(
    model: str,
    width: int,
    height: int,
    matrix: ArrayLike,
    distortion: Sequence[float],
) -> Lens:
    """Build the lens that a ROS camera_info describes.

    Parameters
    ----------
    model
        `distortion_model` of REP-104: `equidistant` (or `fisheye`), `plumb_bob`,
        `rational_polynomial`; and `annular`, which is none of ROS's.
    width, height
        Size of the picture, px.
    matrix
        Camera matrix K, nine numbers in row order or (3, 3), px.
    distortion
        The model's coefficients; zeros behind the four of a fisheye lens, which some drivers
        send, are left out.

    Raises
    ------
    CalibrationError
        For an unknown model and for numbers that describe no lens.
    """
    if model not in MODELS:
        raise CalibrationError(
            f'distortion model {model!r:.60} is not known; expected one of {", ".join(MODELS)}'
        )
    lens = MODELS[model]
    most = max(lens.coefficient_counts)
    if not any(distortion[most:]):
        distortion = distortion[:most]
    matrix = np.asarray(matrix, float).reshape(3, 3)
    focal_x, skew, center_x = matrix[0]
    return lens(
        width=int(width),
        height=int(height),
        focal_x_px=float(focal_x),
        focal_y_px=float(matrix[1, 1]),
        center_x_px=float(center_x),
        center_y_px=float(matrix[1, 2]),
        distortion=tuple(float(k) for k in distortion),
        skew_px=float(skew),
    )
