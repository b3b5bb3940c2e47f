"""Command line: print a target, and calibrate a lens from pictures of it."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from fisheye_core.command_line import exit_code, show_progress
from fisheye_core.errors import SettingError
from fisheye_geometry.camera_file import Camera, read_camera
from fisheye_undistort.calibrate_options import make_parser, target_of
from fisheye_undistort.detect.detection import Detector
from fisheye_undistort.detect.gathering import Gathered, gather
from fisheye_undistort.detect.live_gathering import LiveGathering
from fisheye_undistort.detect.pictures import read_pictures
from fisheye_undistort.fit.angle_map import lit_part
from fisheye_undistort.fit.calibration import calibrate
from fisheye_undistort.foreign.conversion import convert
from fisheye_undistort.foreign.written_formats import check_output, write_as
from fisheye_undistort.report.calibrated_angle import report_path
from fisheye_undistort.report.lens_difference import LensDifference
from fisheye_undistort.report.report import CalibrationReport
from fisheye_undistort.report.report_file import calibrated_line, write_report

GOOD, POOR = 0, 2


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; give its exit code: 0 good, 2 poor but written, 1 failed."""
    return exit_code('calibrate_lens', lambda: _run(make_parser(__doc__).parse_args(arguments)))


def _run(options: argparse.Namespace) -> int:
    if not options.name or '/' in options.name:
        raise SettingError(f"--name is '{options.name}'; expected a word without '/'")
    if not 0 <= options.seam_deg < 180:
        raise SettingError(f'--seam-deg is {options.seam_deg:g}; expected 0 to 180 degrees')
    if options.plot:
        from fisheye_undistort.report.report_plot import check_plot

        check_plot(options.plot)
    for name, action in _ACTIONS.items():
        if getattr(options, name):
            return action(options)
    raise SettingError('nothing to do: give pictures, --topic or --print (see --help)')


def _print(options: argparse.Namespace) -> int:
    from fisheye_undistort.target.target_sheet import write_sheet

    target = target_of(options)
    print(f'{options.print}: {target}, on {write_sheet(options.print, target)}')
    return GOOD


def _compare(options: argparse.Namespace) -> int:
    one, other = (read_camera(path).lens for path in options.compare)
    difference = LensDifference(one, other)
    print(difference)
    if options.plot:
        from fisheye_undistort.report.difference_plot import plot_difference

        plot_difference(options.plot, difference)
    return GOOD


def _convert(options: argparse.Namespace) -> int:
    output = _output(options)
    conversion = convert(options.convert, options.camera)
    write_as(options.to, output, Camera(options.name, conversion.lens), str(conversion))
    print(f'{conversion}\nwritten  {output}')
    return GOOD if conversion.good else POOR


def _output(options: argparse.Namespace) -> Path:
    """Return the file to write, after a look whether it can be."""
    output = options.output or Path(f'{options.name}.yaml')
    check_output(options.to, output)
    return output


def _collected(options: argparse.Namespace) -> Gathered:
    """Collect from a topic what is shown until there is enough."""
    detector = Detector(target_of(options), options.min_area_px, options.max_area_px, quick=True)
    try:
        from fisheye_undistort.collect_node import collect
    except ImportError as error:
        raise SettingError(f'--topic needs ROS 2: {error}') from error
    gathering = LiveGathering(detector)
    collect(options.topic, gathering, options.views, options.half)
    return gathering.gathered()


def _gathered(options: argparse.Namespace) -> Gathered:
    """Collect from pictures what they show."""
    detector = Detector(target_of(options), options.min_area_px, options.max_area_px)
    shown = sys.stderr.isatty()

    def progress(line: str) -> None:
        if shown:
            show_progress(line, 60)

    try:
        return gather(lambda: read_pictures(options.pictures, options.half), detector, progress)
    finally:
        if shown:
            print(file=sys.stderr)


def _calibrate(options: argparse.Namespace) -> int:
    output = _output(options)
    gathered = _collected(options) if options.topic else _gathered(options)
    collector = gathered.collector
    calibration = calibrate(
        collector.finish(),
        gathered.target,
        collector.size,
        lit=lit_part(collector.brightest),
    )
    report = CalibrationReport(
        calibration, collector.brightest, collector.skipped, options.seam_deg
    )
    write_as(options.to, output, Camera(options.name, calibration.lens), calibrated_line(report))
    write_report(report_path(output), report, options.name)
    if gathered.note:
        print(f'note     {gathered.note}')
    print(f'{report}\nwritten  {output}, {report_path(output).name}')
    if options.plot:
        from fisheye_undistort.report.report_plot import plot_report

        plot_report(options.plot, report, collector.example)
    return GOOD if report.good else POOR


_ACTIONS = {
    'print': _print,
    'compare': _compare,
    'convert': _convert,
    'topic': _calibrate,
    'pictures': _calibrate,
}
"""What each option that names something to do does; the first that is given counts."""


if __name__ == '__main__':
    sys.exit(main())
