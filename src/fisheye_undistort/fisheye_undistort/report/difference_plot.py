"""Draw angles over a picture: how two lenses differ, or how far one may be off."""

from pathlib import Path

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from fisheye_undistort.report.certainty import LIMIT_DEG
from fisheye_undistort.report.figure_file import write_figure
from fisheye_undistort.report.lens_difference import LensDifference

_SIZE_INCH = (9, 6.5)
_LEAST_DEG, _MOST_DEG = 0.01, 10.0


def draw_angles(axes, angles_deg: np.ndarray, size: tuple[int, int], title: str) -> None:
    """Draw a map of angles.

    Parameters
    ----------
    axes
        Of Matplotlib.
    angles_deg
        (rows, columns) over the whole picture; NaN stays white.
    size
        Width and height of the picture, px.
    title
        What it is.
    """
    x, y = (
        np.linspace(0, side - 1, n) for side, n in zip(size, angles_deg.shape[::-1], strict=True)
    )
    shown = np.ma.masked_invalid(angles_deg)
    mesh = axes.pcolormesh(
        x,
        y,
        shown.clip(_LEAST_DEG, _MOST_DEG),
        norm=LogNorm(_LEAST_DEG, _MOST_DEG),
        cmap='viridis',
    )
    if np.any(shown > LIMIT_DEG) and np.any(shown <= LIMIT_DEG):
        axes.contour(x, y, shown, levels=[LIMIT_DEG], colors='r')
    axes.figure.colorbar(mesh, ax=axes, label='degrees')
    axes.set(title=title, xlim=(0, size[0]), ylim=(size[1], 0), aspect='equal', xlabel='x, px')


def plot_difference(path: str | Path, difference: LensDifference) -> None:
    """Write the map of a difference as PNG, PDF or SVG.

    Raises
    ------
    FileAccessError
        If the file cannot be written.
    """
    figure = Figure(figsize=_SIZE_INCH, layout='constrained')
    size = (difference.one.width, difference.one.height)
    title = f'rays apart, a rotation of {difference.turned_deg:.2f} degrees taken out'
    draw_angles(figure.subplots(), difference.apart_deg, size, title)
    write_figure(figure, Path(path), dpi=110)
