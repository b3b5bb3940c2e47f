"""Draw what a calibration is worth."""

import os
from pathlib import Path
from textwrap import fill

import numpy as np
from matplotlib.figure import Figure

from fisheye_core.errors import FileAccessError
from fisheye_geometry.lens_surface import surface_for
from fisheye_geometry.remap import RemapTable
from fisheye_undistort.fit.calibration import Calibration
from fisheye_undistort.report.certainty import LIMIT_DEG
from fisheye_undistort.report.difference_plot import draw_angles
from fisheye_undistort.report.figure_file import check_suffix, write_figure
from fisheye_undistort.report.report import CalibrationReport

_SIZE_INCH = (20, 9.5)
_TITLE = 180
"""Characters in a line of it."""
_ARROW_WIDTHS = 0.03
"""Length of the longest residual as drawn, in widths of the picture."""
_RING_DEG = 4.0
_STRAIGHT_FOV_RAD = np.radians(120)


def check_plot(path: Path) -> None:
    """Refuse, before there is a report, what `plot_report` cannot write.

    Raises
    ------
    SettingError
        For a suffix that is no format of a figure.
    FileAccessError
        For a folder that is not there.
    """
    check_suffix(path, 'a plot')
    if not os.path.isdir(path.parent):
        raise FileAccessError(path, 'written', f'there is no folder {path.parent}')


def plot_report(path: str | Path, report: CalibrationReport, example: np.ndarray) -> None:
    """Write the plot as PNG, PDF or SVG.

    Parameters
    ----------
    path
        Where to.
    report
        What to draw.
    example
        (height, width) uint8, a picture to show undistorted.

    Raises
    ------
    FileAccessError
        If the file cannot be written.
    """
    figure = Figure(figsize=_SIZE_INCH, layout='constrained')
    figure.suptitle(fill(report.verdict, _TITLE), fontsize=13)
    grid = figure.add_gridspec(2, 4)
    calibration = report.calibration
    _points(figure.add_subplot(grid[0, 0]), calibration, report.brightest)
    _residuals(figure.add_subplot(grid[0, 1]), calibration)
    _coverage(figure.add_subplot(grid[0, 2], projection='polar'), report)
    draw_angles(
        figure.add_subplot(grid[0, 3]),
        report.certainty.off_deg,
        (calibration.lens.width, calibration.lens.height),
        f'degrees that the lens may be off; red line: {LIMIT_DEG:g}',
    )
    _distortion(figure.add_subplot(grid[1, 0]), report)
    _views(figure.add_subplot(grid[1, 1]), calibration)
    _undistorted(figure.add_subplot(grid[1, 2]), calibration, example)
    _by_angle(figure.add_subplot(grid[1, 3]), report)
    write_figure(figure, Path(path), dpi=110)


def _by_angle(axes, report: CalibrationReport) -> None:
    """Draw how far the lens may be off by the angle from the axis."""
    certainty, halves = report.certainty, report.calibration.halves
    edges = np.arange(0.0, np.nanmax(certainty.angle_deg) + _RING_DEG, _RING_DEG)
    angles = (edges[1:] + edges[:-1]) / 2
    middle, most = certainty.by_angle(edges)
    axes.semilogy(angles, most, lw=2, label='most all around')
    axes.semilogy(angles, middle, lw=1, label='median all around')
    if halves:
        apart = np.degrees(halves.difference_rad(report.calibration.angles.pixels))
        axes.semilogy(
            certainty.angle_deg[certainty.lit],
            apart[certainty.lit],
            '.',
            ms=2,
            c='0.6',
            label='between even and odd views',
        )
    axes.axhline(LIMIT_DEG, color='r', lw=1)
    covered = np.degrees(report.calibration.directions_rad[0].max())
    axes.axvline(covered, color='k', ls=':', lw=1, label='last point')
    axes.set(
        title=f'certain out to {certainty.calibrated_deg:.0f} degrees all around',
        xlabel='angle from the axis, degrees',
        ylabel='degrees',
        ylim=(1e-3, 100),
    )
    axes.legend(fontsize=8)
    axes.grid(alpha=0.3)


def _points(axes, calibration: Calibration, picture: np.ndarray) -> None:
    axes.imshow(picture, cmap='gray', vmin=0, vmax=400)
    for view in calibration.views:
        axes.plot(*view.points_px.T, '.', ms=4)
    axes.set(title='points found, one colour a view', xlabel='x, px', ylabel='y, px')


def _residuals(axes, calibration: Calibration) -> None:
    points = np.concatenate([view.points_px for view in calibration.views])
    residuals = np.concatenate(calibration.estimate.residuals_px)
    length = np.linalg.norm(residuals, axis=-1)
    width, height = calibration.lens.width, calibration.lens.height
    enlarged = _ARROW_WIDTHS * width / max(length.max(), 1e-9)
    axes.quiver(
        *points.T,
        *residuals.T,
        length,
        angles='xy',
        scale_units='xy',
        scale=1 / enlarged,
        width=0.003,
        cmap='viridis',
    )
    axes.plot(calibration.lens.center_x_px, calibration.lens.center_y_px, 'r+', ms=12)
    axes.set(
        title=f'residuals, {enlarged:.0f} times enlarged; the longest has {length.max():.2f} px',
        xlim=(0, width),
        ylim=(height, 0),
        aspect='equal',
        xlabel='x, px',
        ylabel='y, px',
    )


def _coverage(axes, report: CalibrationReport) -> None:
    angle, azimuth = report.calibration.directions_rad
    edge = np.degrees(report.edge_rad)
    axes.set_theta_direction(-1)  # y points down in a picture
    axes.plot(azimuth, np.degrees(angle), '.', ms=4, alpha=0.6)
    axes.plot(np.linspace(0, 2 * np.pi, 200), np.full(200, edge), 'r', lw=1)
    axes.set_rmax(max(edge, np.degrees(angle.max())) * 1.03)
    axes.set_title(f'degrees from the axis; red: the picture ends at {edge:.0f}')


def _distortion(axes, report: CalibrationReport) -> None:
    lens = report.calibration.lens
    covered = report.calibration.directions_rad[0].max()
    angles = np.linspace(0, min(lens.max_angle_rad, report.edge_rad * 1.1), 200)
    rays = np.stack([np.sin(angles), np.zeros(200), np.cos(angles)], axis=-1)
    pixels, _ = lens.project(rays)
    radius = pixels[:, 0] - lens.center_x_px
    inside = angles <= covered
    degrees = np.degrees(angles)
    axes.plot(degrees, lens.focal_x_px * angles, color='0.7', ls='--', label='equidistant')
    axes.plot(degrees[inside], radius[inside], lw=2, label='fitted, points seen')
    axes.plot(degrees[~inside], radius[~inside], ls=':', lw=2, label='fitted, extrapolated')
    axes.set(title='distortion curve', xlabel='angle from the axis, degrees', ylabel='radius, px')
    axes.legend()
    axes.grid(alpha=0.3)


def _views(axes, calibration: Calibration) -> None:
    rms = calibration.estimate.rms_px
    axes.bar(np.arange(len(rms)), rms)
    axes.axhline(calibration.rms_px, color='r', lw=1)
    step = max(1, len(rms) // 25)
    names = [view.name for view in calibration.views][::step]
    axes.set_xticks(np.arange(len(rms))[::step], names, rotation=90, fontsize=7)
    axes.set(title=f'rms of each view; red: {calibration.rms_px:.3f} px in all', ylabel='px')


def _undistorted(axes, calibration: Calibration, example: np.ndarray) -> None:
    lens = calibration.lens
    surface = surface_for(lens, 'rectilinear', scale='fit', hfov_rad=_STRAIGHT_FOV_RAD)
    axes.imshow(RemapTable(lens, surface)(example), cmap='gray', vmin=0, vmax=255)
    axes.set(title='one view undistorted: straight lines must be straight')
    axes.set_axis_off()
