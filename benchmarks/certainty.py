"""What a calibration promises, and what is true: real views, and lenses that are not ours.

Part of `make bench-calibration`.
"""

import time
from itertools import product

import numpy as np
from foreign_lenses import foreign_lens
from rendered_view import facing_pose, render_view

from fisheye_core.errors import FisheyeError
from fisheye_geometry.lens import Lens
from fisheye_testing.data import real_data
from fisheye_undistort.detect.detection import Detector
from fisheye_undistort.detect.gathering import gather
from fisheye_undistort.detect.pictures import NamedPicture, read_pictures
from fisheye_undistort.fit.angle_map import lit_part
from fisheye_undistort.fit.calibration import calibrate
from fisheye_undistort.report.report import CalibrationReport
from fisheye_undistort.target.target import STANDARD, TAGS, Target

LENSES = ('equisolid', 'stereographic', 'double_sphere', 'ocam')
FIELDS_DEG = (120, 160, 190, 220)
COVERAGES = {'middle': (8, 0.5), 'all': (24, 1.0)}
"""Views, and how far from the axis the sheet's middle goes, in shares of the field."""
DISTANCE_MM = (80, 220)
TRIES = 4000
NOISE_SEED = 7
TARGETS = (
    STANDARD['circles'],
    STANDARD['acircles'],
    STANDARD['chessboard'],
    STANDARD['charuco'],
    Target('aprilgrid', 4, 4, 44.0, 44.0, marker_mm=34.0, dictionary=TAGS),
)
REAL = Target('chessboard', 7, 10, 25.0, 25.0)


def report_of(read, target: Target) -> CalibrationReport:
    """Return the report on pictures, as calibrate_lens makes it."""
    collector = gather(read, Detector(target)).collector
    lit = lit_part(collector.brightest)
    calibration = calibrate(collector.finish(), target, collector.size, lit=lit)
    return CalibrationReport(calibration, collector.brightest, collector.skipped)


def real_views() -> None:
    """Print what is found and promised of the real chessboard views."""
    print('\nreal views    found  rms, px  held out, px  certain to, degrees  of  time, s')
    for half in ('left', 'right'):
        started = time.perf_counter()
        report = report_of(
            lambda half=half: read_pictures([real_data('shun74') / 'calib-*.jpg'], half), REAL
        )
        calibration, halves = report.calibration, report.calibration.halves
        print(
            f'shun74 {half:6} {len(calibration.views):5}  {calibration.rms_px:7.3f}  '
            f'{halves.held_out_px:12.3f}  {report.certainty.calibrated_deg:19.0f}  '
            f'{np.degrees(report.edge_rad):3.0f} {time.perf_counter() - started:6.1f}'
        )


def rendered_lenses() -> None:
    """Print found views, errors and verdicts of lenses of other models, all targets in turn."""
    print(
        '\nlens           field  views   target      found  rms, px  covered  worst there  '
        'to the edge  within 3 deviations  verdict'
    )
    totals, false_goods, shares = [0, 0], 0, []
    for number, (fov_deg, name, views) in enumerate(product(FIELDS_DEG, LENSES, COVERAGES)):
        target = TARGETS[number % len(TARGETS)]
        truth = foreign_lens(name, fov_deg)
        count, reach = COVERAGES[views]
        pictures = photographs(truth, target, count, reach)
        row = f'{name:13} {fov_deg:6}  {views:6}  {target.kind:10}'
        try:
            report = report_of(lambda pictures=pictures: pictures, target)
        except FisheyeError as error:
            print(f'{row}  {error}'[:140])
            continue
        covered, inside, worst, share = errors(report, truth)
        found = len(report.calibration.views)
        totals[0] += found
        totals[1] += len(pictures)
        false_goods += report.good and worst > 0.5
        shares.append(share)
        print(
            f'{row} {found:3}/{len(pictures):<3} {report.calibration.rms_px:7.3f}  '
            f'{covered:7.0f}  {inside:11.3f}  {worst:11.3f}  {share:19.1%}  '
            f'{"good" if report.good else "poor"}'
        )
    print(
        f'found {totals[0]} of {totals[1]}; within 3 deviations {np.mean(shares):.2%} of all '
        f'points of the pictures; good with an error above 0.5 degrees: {false_goods}'
    )


def errors(report: CalibrationReport, truth: Lens) -> tuple[float, float, float, float]:
    """Return the covered angle, worst errors within it and to the edge, and the share in 3 s."""
    calibration = report.calibration
    rays, seen = truth.unproject(calibration.angles.pixels)
    found = calibration.angles
    apart = np.degrees(2 * np.arcsin((np.linalg.norm(rays - found.rays, axis=-1) / 2).clip(0, 1)))
    apart = np.where(found.seen, apart, 180.0)
    angle = np.degrees(np.arccos(rays[..., 2].clip(-1, 1)))
    covered = float(np.degrees(calibration.directions_rad[0].max()))
    deviation = np.degrees(found.deviation_rad(calibration.covariance))
    is_within = (apart < 3 * deviation) | ~found.seen
    return (
        covered,
        float(apart[seen & (angle <= covered)].max()),
        float(apart[seen].max()),
        float(is_within[seen].mean()),
    )


def photographs(lens: Lens, target: Target, count: int, reach: float) -> list[NamedPicture]:
    """Render sheets of which the camera sees all, out to a share of the field."""
    random = np.random.default_rng(NOISE_SEED)
    last = np.array([lens.width, lens.height]) - 2
    pictures: list[NamedPicture] = []
    for _ in range(TRIES):
        pose = facing_pose(
            random.uniform(0, 2 * np.pi),
            reach * lens.max_angle_rad * np.sqrt(random.uniform()),
            random.uniform(*DISTANCE_MM),
            random.uniform((-0.6, -0.6, -3), (0.6, 0.6, 3)),
        )
        pixels, seen = lens.project(1.4 * target.points_mm @ pose.rotation.T + pose.translation_mm)
        if seen.all() and np.all((pixels > 1) & (pixels < last)):
            picture = render_view(lens, target, pose, seed=len(pictures))
            pictures.append(NamedPicture(f'{len(pictures)}.png', picture))
        if len(pictures) == count:
            break
    return pictures
