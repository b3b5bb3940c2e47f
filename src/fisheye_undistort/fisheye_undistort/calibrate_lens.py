"""Command line: print a target, and calibrate a lens from pictures of it."""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from fisheye_core.errors import FisheyeError, SettingError
from fisheye_geometry.camera_file import Camera, write_camera
from fisheye_undistort.calibration import calibrate
from fisheye_undistort.collector import Collector
from fisheye_undistort.detection import Detector
from fisheye_undistort.pictures import HALVES, read_pictures
from fisheye_undistort.report import CalibrationReport
from fisheye_undistort.target import KINDS, STANDARD, Target

GOOD, FAILED, POOR = 0, 1, 2
_INTERRUPTED = 130


class _Parser(argparse.ArgumentParser):
    def error(self, message):
        raise SettingError(f'{message} (see {self.prog} --help)')


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; give its exit code: 0 good, 2 poor but written, 1 failed."""
    try:
        return _run(_parser().parse_args(arguments))
    except FisheyeError as error:
        print(f'calibrate_lens: {error}', file=sys.stderr)
        return FAILED
    except KeyboardInterrupt:
        return _INTERRUPTED


def _parser() -> _Parser:
    parser = _Parser(
        prog='calibrate_lens',
        description=__doc__,
        epilog='Exit code: 0 good, 2 poor but written, 1 failed (with the reason).',
    )
    add = parser.add_argument
    add('pictures', nargs='*', help='pictures, folders, globs, videos')
    add('--topic', help='collect views from this image topic, until there are --views or Ctrl-C')
    add('--views', type=int, default=25, help='views that --topic collects (default: %(default)s)')
    add('--half', choices=HALVES, default='', help='of pictures from a side-by-side stereo camera')
    add('--print', metavar='SHEET', help='write the target as .pdf, .svg or .png, and do no more')
    add('--target', choices=KINDS, default='circles', help='kind of target (default: %(default)s)')
    add('--rows', type=int, help='circles, inner corners; of a ChArUco board: squares')
    add('--columns', type=int, help='likewise')
    add('--dx-mm', type=float, help='distance of columns; side of the squares')
    add('--dy-mm', type=float, help='distance of rows (default: as --dx-mm, if that is given)')
    add('--radius-mm', type=float, help='of the circles')
    add('--marker-mm', type=float, help="side of a ChArUco board's markers")
    add(
        '--min-area-px',
        type=float,
        default=0.0,
        help='smallest circle (default: 100 at 640x480, scaled with the picture)',
    )
    add('--max-area-px', type=float, default=0.0, help='largest circle (default: likewise 10000)')
    add('--name', default='camera', help='camera_name in the file (default: %(default)s)')
    add('-o', '--output', type=Path, help='camera_info file to write (default: NAME.yaml)')
    add('--plot', type=Path, help='also draw the report, .png, .pdf or .svg')
    return parser


def _target(options: argparse.Namespace) -> Target:
    names = ('rows', 'columns', 'dx_mm', 'dy_mm', 'radius_mm', 'marker_mm')
    given = {name: value for name in names if (value := getattr(options, name)) is not None}
    if 'dx_mm' in given:
        given.setdefault('dy_mm', given['dx_mm'])
    return replace(STANDARD[options.target], **given)


def _run(options: argparse.Namespace) -> int:
    if not options.name or '/' in options.name:
        raise SettingError(f"--name is '{options.name}'; expected a word without '/'")
    target = _target(options)
    if options.print:
        from fisheye_undistort.target_sheet import write_sheet

        print(f'{options.print}: {target}, on {write_sheet(options.print, target)}')
        return GOOD
    if options.plot:
        from fisheye_undistort.report_plot import check_plot, plot_report

        check_plot(options.plot)
    collector = Collector(Detector(target, options.min_area_px, options.max_area_px))
    if options.topic:
        try:
            from fisheye_undistort.collect_node import collect
        except ImportError as error:
            raise SettingError(f'--topic needs ROS 2: {error}') from error
        collect(options.topic, collector, options.views, options.half)
    elif options.pictures:
        for picture in read_pictures(options.pictures, options.half):
            collector.add(picture)
    else:
        raise SettingError('nothing to do: give pictures, --topic or --print (see --help)')
    calibration = calibrate(collector.finish(), target, collector.size)
    report = CalibrationReport(calibration, collector.brightest, collector.skipped)
    output = options.output or Path(f'{options.name}.yaml')
    write_camera(output, Camera(options.name, calibration.lens))
    print(f'{report}\nwritten  {output}')
    if options.plot:
        plot_report(options.plot, report, collector.example)
    return GOOD if report.good else POOR


if __name__ == '__main__':
    sys.exit(main())
