"""The house rules, read from the syntax tree: who may import whom, and that it is declared."""

import ast
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

SOURCE = Path(__file__).parents[1] / 'src'
OURS = (
    'fisheye_core',
    'fisheye_geometry',
    'fisheye_bridge',
    'fisheye_capture',
    'fisheye_undistort',
    'panorama_stitch',
    'panorama_viewer',
)
BELOW = {
    'fisheye_core': set(),
    'fisheye_geometry': {'fisheye_core'},
    'fisheye_bridge': {'fisheye_core', 'fisheye_geometry'},
    'fisheye_capture': {'fisheye_core', 'fisheye_geometry', 'fisheye_bridge'},
    'fisheye_undistort': {'fisheye_core', 'fisheye_geometry', 'fisheye_bridge'},
    'panorama_stitch': {
        'fisheye_core',
        'fisheye_geometry',
        'fisheye_bridge',
        'fisheye_capture',
        'fisheye_undistort',
    },
    'panorama_viewer': {'fisheye_core', 'fisheye_geometry', 'fisheye_bridge'},
}
ROS = {
    'rclpy',
    'rcl_interfaces',
    'sensor_msgs',
    'std_msgs',
    'diagnostic_msgs',
    'builtin_interfaces',
    'fisheye_msgs',
    'geometry_msgs',
    'std_srvs',
    'tf2_msgs',
    'fisheye_bridge',
}
KEYS = {
    'numpy': 'python3-numpy',
    'PIL': 'python3-pil',
    'cv2': 'python3-opencv',
    'yaml': 'python3-yaml',
    'scipy': 'python3-scipy',
    'aiohttp': 'python3-aiohttp',
    'cryptography': 'python3-cryptography',
    'matplotlib': 'python3-matplotlib',
    'ament_index_python': 'ament_index_python',
    'av': 'python3-av',
    'pytest': 'python3-pytest',
    'hypothesis': 'python3-hypothesis',
}
SHARED_SHELL = 'panorama_stitch.nodes.base_node'
"""The one node module that others build on: what stitch_node and panorama_node share."""

MODULES = [
    pytest.param(package, path, id=f'{package}.{path.stem}')
    for package in OURS
    for path in sorted((SOURCE / package / package).rglob('*.py'))
]
TESTS = sorted([*SOURCE.glob('*/test/**/test_*.py'), *Path(__file__).parent.glob('*.py')])


def imports(path):
    """Dotted names that a module imports, anywhere in it."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f'{path}: imports are absolute'
            yield node.module
            # `from package import module` names a module too.
            yield from (f'{node.module}.{a.name}' for a in node.names if node.module in OURS)


def is_shell(package, path):
    return (
        package == 'fisheye_bridge' or path.stem.endswith('_node') or path.parent.stem == 'nodes'
    )


@pytest.mark.parametrize(('package', 'path'), MODULES)
def test_a_package_imports_only_what_lies_below(package, path):
    used = {name.split('.')[0] for name in imports(path)} & set(OURS) - {package}
    assert used <= BELOW[package]


@pytest.mark.parametrize(('package', 'path'), MODULES)
def test_only_shells_know_ros(package, path):
    if not is_shell(package, path):
        assert {name.split('.')[0] for name in imports(path)} & ROS == set()


@pytest.mark.parametrize(('package', 'path'), MODULES)
def test_node_files_do_not_import_each_other(package, path):
    nodes = {name for name in imports(path) if name.split('.')[0] in OURS and '_node' in name}
    allowed = {SHARED_SHELL, f'{SHARED_SHELL}.PanoramaBase'} if is_shell(package, path) else set()
    if path.stem == 'calibrate_lens':
        # The command line starts the live collection, and only that needs ROS.
        allowed.add('fisheye_undistort.collect_node')
    assert {name for name in nodes if name.count('.') == 1} <= allowed


@pytest.mark.parametrize('package', OURS)
def test_every_import_is_declared_in_package_xml(package):
    declared = {
        entry.text
        for entry in ElementTree.parse(SOURCE / package / 'package.xml').getroot()
        if entry.tag in ('depend', 'exec_depend')
    }
    tops = {
        name.split('.')[0]
        for path in (SOURCE / package / package).rglob('*.py')
        for name in imports(path)
    }
    known = ROS | set(OURS) | set(KEYS)
    needed = {KEYS.get(name, name) for name in tops & known} - {package}
    assert needed <= declared


@pytest.mark.parametrize('folder', sorted(SOURCE.iterdir()), ids=lambda folder: folder.name)
def test_every_import_of_tests_and_launch_files_is_declared(folder):
    files = [path for part in ('test', 'launch') for path in (folder / part).rglob('*.py')]
    if folder.name not in OURS:
        files += folder.rglob('*.py')  # what helps tests is held to less, but declares as much
    declared = {
        entry.text
        for entry in ElementTree.parse(folder / 'package.xml').getroot()
        if entry.tag.endswith('depend')
    }
    own = (
        {path.stem for path in files} | {folder.name, 'setuptools'} | set(sys.stdlib_module_names)
    )
    tops = {name.split('.')[0] for path in files for name in imports(path)} - own
    assert {KEYS.get(name, name) for name in tops} <= declared


@pytest.mark.parametrize('path', TESTS, ids=lambda path: path.stem)
def test_tests_reach_into_nothing_private(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Attribute) and node.attr.startswith('_') and node.attr[1] != '_':
            assert ast.unparse(node.value) == 'self', ast.unparse(node)
        elif isinstance(node, ast.ImportFrom):
            private = [a.name for a in node.names if a.name[0] == '_' and a.name[:2] != '__']
            assert not private, f'{node.module}: {private}'


def test_no_other_library_is_imported():
    tops = {name.split('.')[0] for p in MODULES for name in imports(p.values[1])}
    assert tops - set(sys.stdlib_module_names) - ROS - set(OURS) - set(KEYS) == set()
