"""How exact and how fast lenses are calibrated, on photographs whose truth is known.

Prints tables and draws out/calibration.png: the error with and without the correction of the
circles' bias, and the time against the number of circles and the size of the picture, as in
figures 19 and 20 of Al-Harasis and Sababha 2019, doi 10.1007/s11042-019-7501-z.
"""

import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from certainty import real_views, rendered_lenses
from matplotlib.figure import Figure
from rendered_view import render_view, scattered_poses

from fisheye_geometry.lens import FisheyeLens
from fisheye_undistort.detect.detection import Detector
from fisheye_undistort.fit.calibration import calibrate
from fisheye_undistort.fit.estimate import TargetView
from fisheye_undistort.target.target import STANDARD, Target

VIEWS = 12
REPEATS = 5
PLOT = Path('out/calibration.png')
LENSES = {
    170: (215.0, (0.02, -0.01, 0.003, -0.0008)),
    190: (199.0, (-0.03, 0.003, -0.006, 0.0015)),
}
PAPER = STANDARD['circles']
GRIDS = {
    9: PAPER,
    20: Target('circles', 4, 5, 50.0, 50.0, radius_mm=18.0),
    35: Target('circles', 5, 7, 38.0, 38.0, radius_mm=14.0),
    70: Target('circles', 7, 10, 26.0, 26.0, radius_mm=9.5),
    140: Target('circles', 10, 14, 18.0, 18.0, radius_mm=6.8),
}
VIEWS_TIMED = (25, 50, 100, 200)
WIDTHS = (320, 640, 1280, 1920, 2560)


@dataclass(frozen=True)
class CalibrationResult:
    """Errors against the truth, and seconds taken."""

    focal_percent: float
    center_px: float
    angle_deg: float
    reach_deg: float
    rms_px: float
    find_s: float
    fit_s: float


def fisheye(fov_deg: int, width: int) -> FisheyeLens:
    """Return a lens that sees `fov_deg` across a picture of 4 to 3."""
    focal, distortion = LENSES[fov_deg]
    scale = width / 640
    return FisheyeLens(
        width,
        width * 3 // 4,
        focal * scale,
        focal * scale * 1.003,
        321.8 * scale,
        237.6 * scale,
        distortion,
    )


def photographs(lens: FisheyeLens, target: Target, count: int = VIEWS) -> list[np.ndarray]:
    """Render sheets with noise, blur and uneven light."""
    poses = scattered_poses(lens, target, count, (170, 270))
    return [render_view(lens, target, pose, seed=seed) for seed, pose in enumerate(poses)]


def angle_error_deg(lens: FisheyeLens, truth: FisheyeLens, reach_rad: float) -> float:
    """Largest error of the distortion curve out to an angle."""
    angles = np.linspace(0.01, reach_rad, 200)
    rays = np.stack([np.sin(angles), 0 * angles, np.cos(angles)], axis=-1)
    pixels = truth.project(rays)[0] + (
        lens.center_x_px - truth.center_x_px,
        lens.center_y_px - truth.center_y_px,
    )
    back = lens.unproject(pixels)[0]
    return float(np.degrees(np.abs(np.arctan2(back[:, 0], back[:, 2]) - angles).max()))


def measure(
    truth: FisheyeLens, target: Target, pictures, *, correct_bias=True
) -> CalibrationResult:
    """Calibrate from pictures and compare with the truth."""
    detect = Detector(target)
    started = time.perf_counter()
    views = [detect(str(number), picture) for number, picture in enumerate(pictures)]
    found = time.perf_counter()
    calibration = calibrate(views, target, (truth.width, truth.height), correct_bias=correct_bias)
    fitted = time.perf_counter()
    lens, reach = calibration.lens, calibration.directions_rad[0].max()
    return CalibrationResult(
        focal_percent=100 * abs(lens.focal_x_px / truth.focal_x_px - 1),
        center_px=float(
            np.hypot(lens.center_x_px - truth.center_x_px, lens.center_y_px - truth.center_y_px)
        ),
        angle_deg=angle_error_deg(lens, truth, reach),
        reach_deg=float(np.degrees(reach)),
        rms_px=calibration.rms_px,
        find_s=(found - started) / len(views),
        fit_s=fitted - found,
    )


def accuracy() -> None:
    """Print the errors of four cameras, with and without the correction of the bias."""
    print(f'{VIEWS} views each; the errors without the correction of the bias in brackets')
    print(
        'lens  picture    circles  focal length, %  principal point, px  '
        'angle, degrees          rms, px'
    )
    for fov_deg in LENSES:
        for width, circles in ((640, 9), (1280, 70)):
            truth, target = fisheye(fov_deg, width), GRIDS[circles]
            pictures = photographs(truth, target)
            yes, no = (measure(truth, target, pictures, correct_bias=b) for b in (True, False))
            print(
                f'{fov_deg:4}  {truth.width}x{truth.height:<5} {circles:7}  '
                f'{yes.focal_percent:6.3f} ({no.focal_percent:.3f})  '
                f'{yes.center_px:9.3f} ({no.center_px:.3f})    '
                f'{yes.angle_deg:.3f} ({no.angle_deg:.3f}) to {yes.reach_deg:3.0f}  '
                f'{yes.rms_px:.3f} ({no.rms_px:.3f})'
            )


def against_circles() -> list[tuple[int, CalibrationResult]]:
    """Measure and print time and error against the number of circles, at 1280x960."""
    print('\ncircles  find, ms a picture  fit, s  focal length, %  angle, degrees')
    truth, rows = fisheye(170, 1280), []
    for circles, target in GRIDS.items():
        result = measure(truth, target, photographs(truth, target))
        rows.append((circles, result))
        print(
            f'{circles:7}  {1000 * result.find_s:18.0f}  {result.fit_s:6.2f}  '
            f'{result.focal_percent:15.3f}  {result.angle_deg:14.3f}'
        )
    return rows


def against_size() -> list[tuple[str, float]]:
    """Measure and print the time to find nine circles against the size of the picture."""
    print('\npicture     find 9 circles, ms')
    rows = []
    for width in WIDTHS:
        lens = fisheye(170, width)
        (picture,) = photographs(lens, PAPER, 1)
        detect, times = Detector(PAPER), []
        for _ in range(REPEATS):
            started = time.perf_counter()
            detect('', picture)
            times.append(time.perf_counter() - started)
        rows.append((f'{lens.width}x{lens.height}', min(times)))
        print(f'{rows[-1][0]:9}   {1000 * rows[-1][1]:10.0f}')
    return rows


def against_views() -> None:
    """Print the time to fit against the number of views of 70 points."""
    print('\nviews  fit, s (70 points each, halves and covariance included)')
    truth, target = fisheye(170, 1280), GRIDS[70]
    random = np.random.default_rng(0)
    views = []
    for pose in scattered_poses(truth, target, max(VIEWS_TIMED), (100, 270)):
        points = target.points_mm @ pose.rotation.T + pose.translation_mm
        pixels = truth.project(points)[0] + random.normal(0, 0.1, (len(points), 2))
        views.append(TargetView(str(len(views)), pixels, np.arange(len(points))))
    for count in VIEWS_TIMED:
        started = time.perf_counter()
        calibrate(views[:count], target, (truth.width, truth.height), correct_bias=False)
        print(f'{count:5}  {time.perf_counter() - started:6.2f}')


def draw(circles: list[tuple[int, CalibrationResult]], sizes: list[tuple[str, float]]) -> None:
    """Draw both tables."""
    figure = Figure(figsize=(12, 4.5), layout='constrained')
    left, right = figure.subplots(1, 2)
    counts = [count for count, _ in circles]
    left.plot(counts, [1000 * result.find_s for _, result in circles], 'o-')
    left.set(
        xlabel='circles',
        ylabel='find, ms a picture (blue)',
        ylim=(0, None),
        title=f'1280x960, {VIEWS} views',
    )
    error = left.twinx()
    error.plot(counts, [result.angle_deg for _, result in circles], 's--', color='C1')
    error.set(ylabel='angle error, degrees (orange)', ylim=(0, None))
    right.plot([name for name, _ in sizes], [1000 * seconds for _, seconds in sizes], 'o-')
    right.set(xlabel='picture', ylabel='find, ms a picture', ylim=(0, None), title='9 circles')
    for axes in (left, right):
        axes.grid(alpha=0.3)
    PLOT.parent.mkdir(exist_ok=True)
    figure.savefig(PLOT, dpi=110)
    print(f'\n{PLOT}')


if __name__ == '__main__':
    accuracy()
    against_views()
    real_views()
    rendered_lenses()
    draw(against_circles(), against_size())
