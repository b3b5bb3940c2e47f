"""A rig as real processes: the installed executables in a ROS domain of their own."""

import os
import re
import signal
import subprocess
import time
from collections.abc import Sequence
from pathlib import Path

from ament_index_python.packages import get_package_prefix

from fisheye_testing.waiting import wait_for

EXECUTABLES = {
    'capture': 'fisheye_capture',
    'undistort': 'fisheye_undistort',
    'stitch': 'panorama_stitch',
    'panorama': 'panorama_stitch',
    'viewer': 'panorama_viewer',
}
SIDES = ('left', 'right')
SEPARATE = ('left/capture', 'right/capture', 'left/undistort', 'right/undistort', 'stitch')
"""The five nodes of a rig; `COMPOSED` does the same in one."""
COMPOSED = ('panorama',)
_STOP_TIMEOUT_S = 10.0


def executable(node: str) -> Path:
    """Return the path that `ros2 run` resolves for a node such as `left/capture`."""
    name = node.split('/')[-1]
    package = EXECUTABLES[name]
    return Path(get_package_prefix(package)) / 'lib' / package / f'{name}_node'


def camera_parameters(folder: Path | None) -> dict[str, dict[str, object]]:
    """Return the parameters of each side's capture for a folder of pictures; None: synthetic."""
    if folder is None:
        return {side: {} for side in SIDES}
    return {
        side: {
            'source': str(folder / f'{side}.png'),
            'camera_info_url': str(folder / f'{side}.yaml'),
        }
        for side in SIDES
    }


class RigProcesses:
    """Processes of nodes; as a context manager it ends them all.

    Attributes
    ----------
    processes : dict
        `subprocess.Popen` by node, as `left/capture`.
    """

    def __init__(self, domain: int, log_folder: Path, environment: dict[str, str] | None = None):
        self.processes: dict[str, subprocess.Popen] = {}
        self._commands: dict[str, list[str]] = {}
        self._log_folder = log_folder
        self._log_folder.mkdir(parents=True, exist_ok=True)
        self._environment = {**os.environ, 'ROS_DOMAIN_ID': str(domain), **(environment or {})}

    def __enter__(self) -> 'RigProcesses':
        return self

    def __exit__(self, *_) -> None:
        for process in self.processes.values():
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
        for node in self.processes:
            self._wait(node)

    def start(self, node: str, prefix: tuple[str, ...] = (), **parameters: object) -> None:
        """Start a node with parameters; the words of `prefix` go before the command."""
        namespace = node.rpartition('/')[0]
        command = [*prefix, str(executable(node)), '--ros-args', '-r', f'__ns:=/{namespace}']
        for name, value in parameters.items():
            command += ['-p', f'{name}:={value}']
        self.run(node, command)

    def run(self, name: str, command: Sequence[str]) -> None:
        """Start any other process that belongs to the rig."""
        self._commands[name] = list(command)
        self.start_again(name)

    def start_again(self, node: str) -> None:
        """Start a node that ended, as it was started before."""
        with self.log(node).open('ab') as log:
            self.processes[node] = subprocess.Popen(
                self._commands[node],
                stdout=log,
                stderr=log,
                env=self._environment,
                stdin=subprocess.DEVNULL,
            )

    def start_all(
        self,
        composed: bool,
        cameras: dict[str, dict[str, object]],
        prefix: tuple[str, ...] = (),
        **capture: object,
    ) -> None:
        """Start a whole rig: `cameras` of `camera_parameters`, `capture` for both captures."""
        shared = {'cameras': f'[{", ".join(cameras)}]'}
        if composed:
            own = {
                f'{s}.{name}': v for s, entries in cameras.items() for name, v in entries.items()
            }
            self.start('panorama', prefix, **shared, **own, **capture)
            return
        for side, entries in cameras.items():
            self.start(f'{side}/capture', prefix, **entries, **capture)
            self.start(f'{side}/undistort', prefix)
        self.start('stitch', prefix, **shared)

    def stop(self, node: str, with_signal: signal.Signals = signal.SIGINT) -> tuple[int, float]:
        """End a node; give its exit code and how long it took, s."""
        begin = time.monotonic()
        self.processes[node].send_signal(with_signal)
        return self._wait(node), time.monotonic() - begin

    def log(self, node: str) -> Path:
        """Return the file that holds what a node prints."""
        return self._log_folder / f'{node.replace("/", "_")}.log'

    def check_alive(self) -> None:
        """Raise a `RuntimeError` with the last words of a node that ended."""
        for node, process in self.processes.items():
            if process.poll() is not None:
                words = self.log(node).read_text(errors='replace').strip()[-2000:]
                raise RuntimeError(f'{node} ended with code {process.returncode}:\n{words}')

    def page_url(self, timeout_s: float) -> str:
        """Wait until the viewer says where it serves the panorama, and return that address."""

        def said() -> str | None:
            self.check_alive()
            found = re.search(r'the panorama is at (\S+)', self.log('viewer').read_text())
            return found and found[1]

        return str(wait_for(said, timeout_s, 'the address of the page'))

    def last_warnings(self) -> str:
        """Return the last warning of each node that gave one, and where all are."""
        lines = [f'The logs are in {self._log_folder}.']
        for node in self.processes:
            words = self.log(node).read_text(errors='replace').splitlines()
            said = [line for line in words if re.match(r'\[(WARN|ERROR|FATAL)\]', line)]
            lines += [f'{node}: {line}' for line in said[-1:]]
        return '\n'.join(lines)

    def _wait(self, node: str) -> int:
        process = self.processes[node]
        try:
            return process.wait(_STOP_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            process.kill()
            return process.wait()
