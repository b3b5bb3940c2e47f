"""Options of calibrate_lens."""

import argparse
from dataclasses import replace
from pathlib import Path

from fisheye_core.command_line import CommandParser
from fisheye_undistort.detect.pictures import HALVES
from fisheye_undistort.foreign.written_formats import FORMATS
from fisheye_undistort.target.target import KINDS, MARKERS, STANDARD, Target

_SEAM = (
    'angle from the axis at which a seam of the panorama lies: the verdict asks for no more '
    '(default: all that the picture shows)'
)


def make_parser(description: str | None) -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    parser = CommandParser(
        prog='calibrate_lens',
        description=description,
        epilog='Exit code: 0 good, 2 poor but written, 1 failed (with the reason).',
    )
    add = parser.add_argument
    add('pictures', nargs='*', help='pictures, folders, globs, videos')
    add('--topic', help='collect views from this image topic, until there are --views or Ctrl-C')
    add('--views', type=int, default=25, help='views that --topic collects (default: %(default)s)')
    add('--half', choices=HALVES, default='', help='of pictures from a side-by-side stereo camera')
    add('--print', metavar='SHEET', help='write the target as .pdf, .svg or .png, and do no more')
    add('--compare', nargs=2, metavar='YAML', help='two calibrations of one camera, and no more')
    add('--convert', metavar='FILE', help='fit our lens to a calibration of another program')
    add('--camera', default='', help='of a FILE that holds several: cam1; of an OpenCV pair: 1, 2')
    add(
        '--to', choices=FORMATS, default='ros', help='what -o is written as (default: %(default)s)'
    )
    add('--target', choices=KINDS, default='circles', help='kind of target (default: %(default)s)')
    add('--rows', type=int, help='circles, inner corners, tags; of a ChArUco board: squares')
    add('--columns', type=int, help='likewise')
    add('--dx-mm', type=float, help='distance of columns; side of the squares; from tag to tag')
    add('--dy-mm', type=float, help='distance of rows (default: as --dx-mm, if that is given)')
    add('--radius-mm', type=float, help='of the circles')
    add('--marker-mm', type=float, help="side of a ChArUco board's markers, of an AprilTag")
    add('--dictionary', help=f"OpenCV's name of the markers' dictionary (default: {MARKERS})")
    add('--legacy', action='store_true', default=None, help='ChArUco board of OpenCV before 4.6')
    add('--min-area-px', type=float, default=0.0, help='smallest circle (default: searched)')
    add('--max-area-px', type=float, default=0.0, help='largest circle (default: searched)')
    add('--seam-deg', type=float, default=0.0, help=_SEAM)
    add('--name', default='camera', help='camera_name in the file (default: %(default)s)')
    add('-o', '--output', type=Path, help='camera_info file to write (default: NAME.yaml)')
    add('--plot', type=Path, help='also draw the report, .png, .pdf or .svg')
    return parser


def target_of(options: argparse.Namespace) -> Target:
    """Return the target that the options describe.

    Raises
    ------
    SettingError
        If there can be no such target.
    """
    names = (
        'rows',
        'columns',
        'dx_mm',
        'dy_mm',
        'radius_mm',
        'marker_mm',
        'dictionary',
        'legacy',
    )
    given = {name: value for name in names if (value := getattr(options, name)) is not None}
    if 'dx_mm' in given:
        given.setdefault('dy_mm', given['dx_mm'])
    return replace(STANDARD[options.target], **given)
