"""Command line: calibrate a rig's lenses and mounts from one turn on the spot, without a sheet."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from fisheye_core.command_line import CommandParser, exit_code
from fisheye_core.errors import FileAccessError, SettingError
from fisheye_geometry.rig import CAMERA_NAME, MAX_CAMERAS
from panorama_stitch.turn.recording import read_recording
from panorama_stitch.turn.rig_files import PARAMETERS, camera_paths, write_rig
from panorama_stitch.turn.tracker import TurnTracker
from panorama_stitch.turn.turn_calibration import calibrate_turn
from panorama_stitch.turn.turn_report import TurnReport

GOOD, POOR = 0, 2
_WAYS = {'auto': None, 'right': True, 'left': False}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; give its exit code: 0 good, 2 poor but written, 1 failed."""
    return exit_code('calibrate_rig', lambda: _run(_parser().parse_args(arguments)))


def _parser() -> CommandParser:
    parser = CommandParser(
        prog='calibrate_rig',
        description=__doc__,
        epilog='Exit code: 0 good, 2 poor but written, 1 failed (with the reason).',
    )
    add = parser.add_argument
    add(
        'cameras',
        nargs='+',
        metavar='NAME=SOURCE',
        help='from left to right: a folder, glob or video of each camera, the pictures of all '
        'taken at the same times while the robot turned',
    )
    add('--topics', action='store_true', help='the sources are image topics: watch them now')
    add(
        '--turn',
        choices=_WAYS,
        default='auto',
        help='which way the robot turns, seen from above: to its right, clockwise, or left '
        '(default: as most cameras are upright)',
    )
    add(
        '-o',
        '--output',
        type=Path,
        default=Path(),
        metavar='FOLDER',
        help=f'where NAME.yaml of each camera and {PARAMETERS} are written (default: here)',
    )
    return parser


def _sources(words: Sequence[str]) -> dict[str, str]:
    sources: dict[str, str] = {}
    for word in words:
        name, equals, source = word.partition('=')
        if not (equals and source and CAMERA_NAME.fullmatch(name)) or name in sources:
            raise SettingError(
                f"'{word}' names no camera; expected NAME=SOURCE with different names, such as "
                'left=pictures/left'
            )
        sources[name] = source
    if len(sources) > MAX_CAMERAS:
        raise SettingError(f'{len(sources)} cameras; expected 1 to {MAX_CAMERAS} of them')
    return sources


def _run(options: argparse.Namespace) -> int:
    sources = _sources(options.cameras)
    if not options.output.is_dir():
        raise FileAccessError(options.output, 'written to', 'it is no folder')
    camera_paths(options.output, tuple(sources))
    tracker = TurnTracker(tuple(sources))
    if options.topics:
        try:
            from panorama_stitch.turn.record_node import record
        except ImportError as error:
            raise SettingError(f'--topics needs ROS 2: {error}') from error
        record(sources, tracker)
    else:
        for pictures in read_recording(sources):
            tracker.add(pictures)
    calibration = calibrate_turn(tracker, tuple(sources), _WAYS[options.turn])
    report = TurnReport(calibration)
    written = write_rig(options.output, calibration)
    print(f'{report}\nwritten  {", ".join(map(str, written))}')
    return GOOD if report.good else POOR


if __name__ == '__main__':
    sys.exit(main())
