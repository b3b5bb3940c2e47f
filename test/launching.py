"""`ros2 launch` for tests: the real launch where it is installed, else its rules, written anew.

As a program: FILE [NAME:=VALUE ...]. REAL_LAUNCH=0 keeps to the rules written here.
"""

import importlib.util
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from types import ModuleType, SimpleNamespace

import yaml
from ament_index_python.packages import get_package_prefix

_POLL_S = 0.05


def has_launch() -> bool:
    """Return whether the real launch and launch_ros can be imported."""
    return bool(importlib.util.find_spec('launch') and importlib.util.find_spec('launch_ros'))


class Rules:
    """What launch and launch_ros do with the entities of a launch file.

    A dictionary of parameters goes to the node as a YAML file, in which text stays text. SIGINT is
    passed on; at SIGTERM launch ends without a word to its nodes. Who dies is started again.
    """

    def __init__(self, words: list[str]):
        self.argv = words
        self.launch_configurations = dict(word.split(':=', 1) for word in words)
        self._everywhere: list[str] = []
        self._namespace: tuple[str, ...] = ()
        self._files = tempfile.TemporaryDirectory()
        self._processes: dict[subprocess.Popen, tuple[list[str], SimpleNamespace]] = {}
        self._is_ended = False

    def modules(self) -> dict[str, dict]:
        """Return what takes the place of launch's modules."""

        def entity(kind):
            return lambda *words, **options: SimpleNamespace(kind=kind, words=words, **options)

        log = SimpleNamespace(warning=lambda text: print(f'[WARNING] {text}', file=sys.stderr))
        return {
            'launch': {
                'LaunchDescription': list,
                'logging': SimpleNamespace(get_logger=lambda _: log),
            },
            'launch.actions': {
                name: entity(name)
                for name in (
                    *('DeclareLaunchArgument', 'OpaqueFunction', 'SetEnvironmentVariable'),
                    *('GroupAction', 'IncludeLaunchDescription'),
                )
            },
            'launch.launch_description_sources': {'PythonLaunchDescriptionSource': str},
            'launch_ros': {},
            'launch_ros.actions': {
                name: entity(name) for name in ('Node', 'SetParameter', 'PushRosNamespace')
            },
        }

    def visit(self, entity: SimpleNamespace) -> None:
        """Carry out one entity."""
        if entity.kind == 'DeclareLaunchArgument':
            self.launch_configurations.setdefault(entity.words[0], entity.default_value)
        elif entity.kind == 'SetEnvironmentVariable':
            os.environ[entity.words[0]] = entity.words[1]
        elif entity.kind == 'SetParameter':
            self._everywhere.append(self._file(dict([entity.words])))
        elif entity.kind == 'OpaqueFunction':
            for made in entity.function(self):
                self.visit(made)
        elif entity.kind == 'PushRosNamespace':
            self._namespace += entity.words
        elif entity.kind == 'IncludeLaunchDescription':
            self.launch_configurations.update(entity.launch_arguments)
            self.include(entity.words[0])
        elif entity.kind == 'GroupAction':
            outside = self.launch_configurations, self._everywhere, self._namespace
            self.launch_configurations, self._everywhere = dict(outside[0]), [*outside[1]]
            for inner in entity.words[0]:
                self.visit(inner)
            self.launch_configurations, self._everywhere, self._namespace = outside
        else:
            self._start(self._command(entity), entity)

    def include(self, path: str) -> None:
        """Carry out what a launch file describes."""
        spec = importlib.util.spec_from_file_location('launched', path)
        file = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(file)
        for entity in file.generate_launch_description():
            self.visit(entity)

    def run(self) -> None:
        """Wait for the end."""
        signal.signal(signal.SIGINT, self._end)
        while self._processes and not self._is_ended:
            time.sleep(_POLL_S)
            for process in [one for one in self._processes if one.poll() is not None]:
                command, node = self._processes.pop(process)
                if node.respawn and not self._is_ended:
                    time.sleep(node.respawn_delay)
                    self._start(command, node)
        for process in self._processes:
            process.wait()

    def _end(self, *_) -> None:
        self._is_ended = True
        for process in self._processes:
            process.send_signal(signal.SIGINT)

    def _start(self, command: list[str], node: SimpleNamespace) -> None:
        self._processes[subprocess.Popen(command)] = command, node

    def _command(self, node: SimpleNamespace) -> list[str]:
        folder = Path(get_package_prefix(node.package)) / 'lib' / node.package
        files = [f if isinstance(f, str) else self._file(f) for f in node.parameters]
        namespace = '/'.join(('', *self._namespace, *filter(None, [node.namespace])))
        return [
            str(folder / node.executable),
            *('--ros-args', '-r', f'__node:={node.name}', '-r', f'__ns:={namespace or "/"}'),
            *(word for file in (*self._everywhere, *files) for word in ('--params-file', file)),
        ]

    def _file(self, parameters: dict) -> str:
        with tempfile.NamedTemporaryFile('w', dir=self._files.name, delete=False) as file:
            yaml.dump({'/**': {'ros__parameters': parameters}}, file)
        return file.name


def run_rules(path: str, words: list[str]) -> None:
    """Do as launch does, without it."""
    rules = Rules(words)
    for name, content in rules.modules().items():
        module = sys.modules[name] = ModuleType(name)
        vars(module).update(content)
    rules.include(path)
    rules.run()


def run_launch(path: str, words: list[str]) -> int:
    """Do as `ros2 launch` does."""
    if not importlib.util.find_spec('composition_interfaces'):
        # Not among the wheels, and used for component containers only.
        for name in ('composition_interfaces', 'composition_interfaces.srv'):
            sys.modules[name] = ModuleType(name)
        load = SimpleNamespace(Request=object, Response=object)
        sys.modules['composition_interfaces.srv'].LoadNode = load
    from launch.actions import IncludeLaunchDescription
    from launch.launch_description_sources import PythonLaunchDescriptionSource

    from launch import LaunchDescription, LaunchService

    arguments = [tuple(word.split(':=', 1)) for word in words]
    source = PythonLaunchDescriptionSource(path)
    included = IncludeLaunchDescription(source, launch_arguments=arguments)
    service = LaunchService(argv=words)
    service.include_launch_description(LaunchDescription([included]))
    return service.run()


if __name__ == '__main__':
    is_real = has_launch() and os.environ.get('REAL_LAUNCH') != '0'
    sys.exit((run_launch if is_real else run_rules)(sys.argv[1], sys.argv[2:]))
