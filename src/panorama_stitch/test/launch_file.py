"""The launch file with stubs in the place of launch: which nodes it would start."""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

FILE = Path(__file__).parents[1] / 'launch' / 'panorama.launch.py'
CAPTURES = {'left/capture', 'right/capture'}
REST = {'left/undistort', 'right/undistort', 'stitch'}


def loaded():
    spec = importlib.util.spec_from_file_location('panorama_launch', FILE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class LaunchFile:
    """The launch file with stubs in the place of launch."""

    def __init__(self, monkeypatch):
        self.warnings = []
        logger = SimpleNamespace(warning=self.warnings.append)
        stubs = {
            'launch': {
                'LaunchDescription': list,
                'logging': SimpleNamespace(get_logger=lambda _: logger),
            },
            'launch.actions': {
                'DeclareLaunchArgument': lambda name, **_: name,
                'OpaqueFunction': dict,
                'SetEnvironmentVariable': lambda *words: words,
            },
            'launch_ros': {},
            'launch_ros.actions': {'Node': SimpleNamespace, 'SetParameter': lambda *words: words},
        }
        for name, content in stubs.items():
            module = ModuleType(name)
            vars(module).update(content)
            monkeypatch.setitem(sys.modules, name, module)
        self.file = loaded()
        monkeypatch.setattr(self.file, 'get_package_prefix', lambda _: '/usr')

    def start(self, **given):
        """Return the nodes by name and the value of use_sim_time."""
        values = {name: value for name, (value, _) in self.file.ARGUMENTS.items()}
        words = [f'{name}:={value}' for name, value in given.items()]
        context = SimpleNamespace(argv=words, launch_configurations={**values, **given})
        (_, sim_time), *nodes = self.file.start(context)
        return {f'{vars(n).get("namespace", "")}/{n.name}'.strip('/'): n for n in nodes}, sim_time

    def given(self, node):
        """Return the parameters of a node beside its file."""
        return node.parameters[1]
