"""What lies below the nodes: shared memory that lacks or is left over, subscribers that starve."""

import os
import re
import signal
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from field import BUSY_S, START_S
from namespaces import Namespace

from fisheye_testing.again import asked_again
from fisheye_testing.domains import unused_domain
from fisheye_testing.health import usage
from fisheye_testing.rig import SEPARATE, SIDES, RigProcesses
from fisheye_testing.waiting import wait_for
from fisheye_testing.watcher import Watcher

TOOLS = Path(__file__).parents[1] / 'tools'
RATE_HZ = 30.0
LONG = bool(os.environ.get('LONG'))
ROUNDS = 5 if LONG else 2
STOPS, HELD_UP = (50, 2) if LONG else (3, 1)
"""How often a subscriber is stopped, and how often that may be noticed: where it holds the lock of
its port just then, Fast DDS waits for it up to a second, which no setting changes."""
STOPPED_S, NOTICED_S, LOCKED_S = 1.0, 0.3, 2.5
LIVELY = 0.8
"""Share of the rate that a busy machine keeps."""
WATCHED_S = 3.0
FLAT_MIB, SETTLED_ROUNDS = 5.0, 6
SEGMENT_BYTES = 64 << 20


def lines(rig, name, pattern):
    return re.findall(pattern, rig.log(name).read_text(), re.M)


def stamps_ns(rig, name):
    """Return the stamps of what a subscriber took."""
    return [int(stamp) for stamp in lines(rig, name, r'^(\d+) -?[\d.]+$')]


def subscribe(rig, name, *options, prefix=()):
    rig.log(name).unlink(missing_ok=True)
    program = str(TOOLS / 'subscriber.py')
    rig.run(name, [*prefix, sys.executable, program, '/panorama/image', *options])
    wait_for(lambda: rig.check_alive() or stamps_ns(rig, name), START_S, f'a picture for {name}')


def recent_rate_hz(rig, name):
    """Return the rate of the newest pictures by their stamps."""
    stamps = stamps_ns(rig, name)
    return sum(stamp > stamps[-1] - WATCHED_S * 1e9 for stamp in stamps) / WATCHED_S


def start(rig, prefix=()):
    for side in SIDES:
        rig.start(f'{side}/capture', prefix, frame_rate_hz=RATE_HZ)
        rig.start(f'{side}/undistort', prefix)
    rig.start('stitch', prefix)


@pytest.mark.parametrize(
    ('options', 'words'),
    [
        ('ro', 'has room for 0 MiB'),
        ('size=900k', 'has room for 0 MiB'),
        ('size=64m', 'has room for '),
    ],
    ids=['none', 'full', 'small'],
)
def test_without_enough_shared_memory_pictures_come_and_it_is_said(rig, options, words):
    mount = f'mount -t tmpfs -o {options} tmpfs /dev/shm'
    with Namespace(('mount',), mount) as there:
        start(rig, there.prefix)
        subscribe(rig, 'subscriber', prefix=there.prefix)
        enough = LIVELY * RATE_HZ
        rate = wait_for(
            lambda: max(0, recent_rate_hz(rig, 'subscriber') - enough), START_S, f'{enough} Hz'
        )
        print(f'\n/dev/shm with {options}: {rate + enough:.1f} panoramas a second')
        for node in SEPARATE:
            assert len(lines(rig, node, words)) == 1, rig.log(node).read_text()
        for name in reversed(list(rig.processes)):
            rig.stop(name)


def test_what_killed_processes_leave_stops_nobody(rig):
    with Namespace(('mount',), 'mount -t tmpfs tmpfs /dev/shm') as there:
        folder = Path(f'/proc/{there.pid}/root/dev/shm')

        def segments():
            return [f for f in folder.iterdir() if f.stat().st_size > SEGMENT_BYTES]

        for times in range(ROUNDS):
            start(rig, there.prefix)
            subscribe(rig, f'subscriber{times}', prefix=there.prefix)
            for name in list(rig.processes):
                rig.stop(name, signal.SIGKILL)
                if name.startswith('subscriber'):
                    del rig.processes[name]
        left = len(segments())
        print(
            f'\nfive nodes killed {ROUNDS} times: '
            f'{left} of {6 * ROUNDS} segments of shared memory are left'
        )
        assert left <= len(SEPARATE) + 1


def watched(health):
    """Count the panoramas that come in a while."""
    begin_s = time.monotonic()
    wait_for(lambda: time.monotonic() > begin_s + WATCHED_S, START_S, 'the end of the watch')
    return sum(entry.arrived_s > begin_s for entry in health.seen)


def own_mib(pid):
    """Return the memory of a process without the segments through which pictures go."""
    used = usage(pid)
    return used.resident_mib - used.shared_mib


@pytest.mark.parametrize('how', ['slow', 'frozen'])
@asked_again
def test_a_starved_subscriber_starves_nobody_else(five, how):
    usual = watched(five.health)
    stitch = five.processes['stitch'].pid
    # Frozen in the middle of a transfer, it may hold a lock until that is noticed.
    affected = ['panorama'] if how == 'frozen' else []
    with five.injured(f'a subscriber that is {how}', *affected, node='starved'):
        subscribe(five, 'starved', *(('--pause', '1') if how == 'slow' else ()))
        try:
            if how == 'frozen':
                os.kill(five.processes['starved'].pid, signal.SIGSTOP)
            watched(five.health)
            # A reader more has its buffers after a while, and other work on the machine ends.
            for _ in range(SETTLED_ROUNDS):
                before = own_mib(stitch)
                came = watched(five.health)
                grown = own_mib(stitch) - before
                if grown < FLAT_MIB and came > LIVELY * usual:
                    break
        finally:
            os.kill(five.processes['starved'].pid, signal.SIGCONT)
            five.stop('starved')
            del five.processes['starved']
    print(f'  {came} panoramas in {WATCHED_S:g} s, {usual} before; stitch grew by {grown:.1f} MiB')
    assert came > LIVELY * usual
    assert grown < FLAT_MIB


def test_who_is_stopped_in_a_transfer_holds_up_nobody_else(five):
    subscribe(five, 'stopped')

    def hardly_noticed():
        gaps_s = [gap_at_a_stop_s(five) for _ in range(STOPS)]
        print(f'\n{STOPS} stops: longest gaps {np.round(sorted(gaps_s)[-3:], 2)} s')
        return max(gaps_s) < LOCKED_S and sum(gap > NOTICED_S for gap in gaps_s) <= HELD_UP

    # Other work on the machine makes gaps that long, too, and ends some time.
    wait_for(hardly_noticed, 0 if LONG else BUSY_S, 'stops that are hardly noticed')


def gap_at_a_stop_s(five):
    """Stop the subscriber for a while; return how long no panorama came to another one, s."""
    begin_s = time.monotonic()
    five.processes['stopped'].send_signal(signal.SIGSTOP)
    try:
        wait_for(lambda: time.monotonic() > begin_s + STOPPED_S, what='the end of a stop')
    finally:
        five.processes['stopped'].send_signal(signal.SIGCONT)
    arrivals_s = [entry.arrived_s for entry in five.health.seen]
    recent_s = [arrived_s for arrived_s in arrivals_s if arrived_s > begin_s - NOTICED_S]
    return max(np.diff([*(recent_s or arrivals_s[-1:]), time.monotonic()]))


def test_two_systems_in_two_domains_do_not_meet(rig, watcher, domain, tmp_path):
    other_domain = unused_domain()
    with (
        RigProcesses(other_domain, tmp_path / 'other') as other,
        Watcher(other_domain) as other_watcher,
    ):
        rig.start('panorama', width=320, height=240)
        other.start('panorama', width=480, height=360)
        seen = {}
        for name, one in (('first', watcher), ('second', other_watcher)):
            wait_for(lambda one=one: len(one.stamps_ns) > RATE_HZ, START_S, f'the {name} system')
            wait_for(lambda one=one: one.is_measured, START_S, f'the overlap of the {name}')
            count = len(one.stamps_ns)
            wait_for(lambda one=one, n=count: len(one.stamps_ns) > n + 2, START_S, 'more of it')
            seen[name] = one.newest.width
            assert one.node.count_publishers('panorama/image') == 1
        assert seen['first'] < seen['second']
        rig.stop('panorama', signal.SIGKILL)
        count = len(other_watcher.stamps_ns)
        wait_for(lambda: len(other_watcher.stamps_ns) > count + RATE_HZ, START_S, 'the other one')
        assert other_watcher.newest.width == seen['second']
    print(f'\nwidths in two domains: {seen}; the first was killed, the other went on')
