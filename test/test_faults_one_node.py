"""The node that does everything: its cameras lost, and a long run as fast as it goes."""

import os

import camera_faults
import pytest
from camera_faults import check_camera_fault
from field import START_S, write_pictures

from fisheye_testing.again import asked_again
from fisheye_testing.health import usage
from fisheye_testing.rig import SIDES
from fisheye_testing.waiting import wait_for

LONG = bool(os.environ.get('LONG'))
BREAKS = [camera_faults.stop, camera_faults.come_back_smaller]
if LONG:
    BREAKS += [camera_faults.stall, camera_faults.send_garbage, camera_faults.send_nothing]
WARM, PAIRS = 1000, 20_000 if LONG else 1500
SOAK_S = 1200.0
FLAT_MIB = 10.0
"""The watch on the seams fills its memory of half a minute meanwhile; nothing else grows."""
REST_S = 30.0
"""A measurement in the background gives back what it took by then."""


def test_a_long_run_needs_no_more_memory_files_or_threads(rig, watcher, tmp_path):
    write_pictures(tmp_path)
    cameras = {
        f'{side}.{name}': tmp_path / f'{side}.{suffix}'
        for side in SIDES
        for name, suffix in (('source', 'jpg'), ('camera_info_url', 'yaml'))
    }
    rig.start('panorama', frame_rate_hz=1000, **cameras)

    def after(count):
        wait_for(
            lambda: rig.check_alive() or len(watcher.stamps_ns) >= count,
            SOAK_S,
            f'panorama {count}',
        )
        return usage(rig.processes['panorama'].pid)

    wait_for(lambda: watcher.overlaps, START_S, 'an overlap')
    before, now = after(WARM), after(PAIRS)
    print(f'\n{PAIRS} frame pairs as fast as they go: {before} after {WARM}, {now} at the end')
    wait_for(
        lambda: after(PAIRS).resident_mib - before.resident_mib < FLAT_MIB,
        REST_S,
        f'less than {FLAT_MIB} MiB above {before.resident_mib:.0f} MiB',
    )
    assert now.files <= before.files
    assert now.threads <= before.threads


@pytest.mark.parametrize('break_it', BREAKS)
@asked_again
def test_a_network_camera_is_lost_and_comes_back(one, break_it):
    check_camera_fault(one, break_it, 'panorama', 'panorama')
