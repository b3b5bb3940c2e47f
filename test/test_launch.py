"""The launch file with real nodes: under launch itself where it is installed, and by its rules."""

import os
import signal
import sys
from pathlib import Path

import launching
import pytest
from ament_index_python.packages import PackageNotFoundError, get_package_prefix
from field import START_S

from fisheye_testing.health import Health
from fisheye_testing.rig import RigProcesses
from fisheye_testing.waiting import wait_for

FILE = Path(__file__).parents[1] / 'src' / 'panorama_stitch' / 'launch' / 'panorama.launch.py'
CAPTURES = ('left/capture', 'right/capture')
OK = b'\0'


class Launched(RigProcesses):
    """A process that launches, and what its nodes say."""

    def __init__(self, domain, folder, is_real):
        super().__init__(domain, folder / 'log', {'REAL_LAUNCH': '01'[is_real]})
        self.health = Health(domain)

    def __exit__(self, *arguments):
        super().__exit__(*arguments)
        self.health.__exit__()

    def launch(self, **arguments):
        words = [f'{name}:={value}' for name, value in arguments.items()]
        program = str(Path(launching.__file__))
        self.run('launch', [sys.executable, program, str(FILE), *words])

    @property
    def pid(self):
        return self.processes['launch'].pid

    def nodes(self):
        """Return the process ids of the nodes."""
        children = Path(f'/proc/{self.pid}/task/{self.pid}/children').read_text().split()
        return [int(pid) for pid in children]

    def wait_for(self, *nodes):
        wait_for(
            lambda: self.check_alive() or all(self.health.level(node) == OK for node in nodes),
            START_S,
            ', '.join(nodes),
        )


@pytest.fixture(params=[False, True], ids=['rules', 'launch'])
def launched(request, domain, tmp_path):
    if request.param and not launching.has_launch():
        pytest.skip(
            'launch and launch_ros are not installed (sudo apt install ros-jazzy-launch-ros)'
        )
    with Launched(domain, tmp_path, request.param) as launched:
        yield launched


def test_a_number_reaches_the_nodes_as_a_number(launched):
    launched.launch(robot='yes', frame_rate_hz='10')
    launched.wait_for(*CAPTURES)
    for node in CAPTURES:
        wait_for(
            lambda node=node: float(launched.health.value(node, 'rate Hz') or 0) > 0,
            START_S,
            f'a rate of {node}',
        )
        assert float(launched.health.value(node, 'rate Hz')) < 15.0


@pytest.mark.parametrize('with_signal', [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_the_nodes_end_with_their_launch(launched, with_signal):
    launched.launch(robot='true')
    launched.wait_for(*CAPTURES)
    nodes = launched.nodes()
    assert len(nodes) == len(CAPTURES)
    if with_signal == signal.SIGINT:
        for pid in nodes:  # a terminal sends it to all
            os.kill(pid, with_signal)
    launched.stop('launch', with_signal)
    wait_for(
        lambda: not any(Path(f'/proc/{pid}').exists() for pid in nodes), START_S, 'the end of all'
    )


def test_a_node_that_died_is_started_again(launched):
    launched.launch(composed='on')
    launched.wait_for('panorama')
    (former,) = launched.nodes()
    os.kill(former, signal.SIGKILL)
    wait_for(lambda: launched.nodes() not in ([], [former]), START_S, 'another process')
    launched.health.status.clear()
    launched.wait_for('panorama')


def test_transforms_without_tf2_start_nothing(launched):
    try:
        get_package_prefix('tf2_ros')
    except PackageNotFoundError:
        launched.launch(transforms='true', yaw_deg='140')
        process = launched.processes['launch']
        wait_for(lambda: process.poll() is not None, START_S, 'the refusal')
        words = launched.log('launch').read_text()
        assert process.returncode != 0
        assert 'needs the package tf2_ros' in words
        assert 'process started' not in words
        assert launched.health.node.count_publishers('/diagnostics') == 0
    else:
        pytest.skip('tf2_ros is installed')
