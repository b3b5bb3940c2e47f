"""Each package by itself: it builds and runs in a workspace that holds only what it depends on.

What is committed is tried. LONG=1 also builds the messages anew and runs the tests of packages.
"""

import os
import subprocess
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
MANIFESTS = {path.parent.name: path for path in sorted(ROOT.glob('src/*/package.xml'))}
IS_LONG = os.environ.get('LONG') == '1'
MESSAGES = 'fisheye_msgs'
"""Its build takes a minute, and differs in nothing from that of the checkout."""
RUN, TEST = ('depend', 'exec_depend'), ('test_depend',)
IMPORT_ALL = """
import importlib, pkgutil, sys
package = importlib.import_module(sys.argv[1])
for module in pkgutil.walk_packages(package.__path__, f'{package.__name__}.'):
    importlib.import_module(module.name)
"""


def needed(package, kinds=RUN):
    """Return those of our packages that one needs, directly or through others, lowest first."""
    found = []
    for entry in ElementTree.parse(MANIFESTS[package]).getroot():
        if entry.tag in kinds and entry.text in MANIFESTS:
            found += [*needed(entry.text), entry.text]
    return list(dict.fromkeys(found))


class Workspaces:
    """A workspace for each package, made when it is asked for."""

    def __init__(self, folder):
        self._folder = folder
        self._installed = {} if IS_LONG else {MESSAGES: ROOT / 'install' / MESSAGES}

    def folder(self, package):
        """Return the workspace of a package."""
        return self._folder / package

    def installed(self, package):
        """Return where a package is installed, built from its archive on what it depends on."""
        if package not in self._installed:
            below, folder = needed(package), self.folder(package)
            folder.mkdir()
            self.check('git archive HEAD "src/$0" | tar x -C "$1"', package, folder, where=ROOT)
            self.check(
                'colcon build --base-paths src --metas "$0"',
                ROOT / 'colcon.meta',
                where=folder,
                packages=below,
            )
            self._installed[package] = folder / 'install' / package
        return self._installed[package]

    def check(self, script, *words, where, packages=()):
        """Run bash where only some packages, and ROS, can be found."""
        own = ('HOME', 'PATH', 'FISHEYE_DATA', 'REQUIRE_DATA', 'ROS_DOMAIN_ID', 'ROS_DISTRO')
        kept = {name: os.environ[name] for name in own if name in os.environ}
        prefixes = [self.installed(package) / 'share' / package for package in packages]
        sources = [ROOT / '.venv' / 'local_setup.bash', *(p / 'package.bash' for p in prefixes)]
        if 'ROS_DISTRO' in kept:
            sources.insert(0, Path('/opt/ros', kept['ROS_DISTRO'], 'setup.bash'))
        lines = [f'source "{path}"' for path in sources]
        result = subprocess.run(
            ['bash', '-c', '\n'.join([*lines, 'set -e', script]), *map(str, words)],
            cwd=where,
            env={**kept, 'PYTHONDONTWRITEBYTECODE': '1'},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
        )
        assert result.returncode == 0, f'{result.stdout}\n{result.stderr}'
        return result.stdout


@pytest.fixture(scope='module')
def workspaces(tmp_path_factory):
    return Workspaces(tmp_path_factory.mktemp('whole'))


def shared_files(installed, package):
    """Return what a package installs beside its code, without what colcon writes."""
    share = installed / 'share' / package
    files = (path.relative_to(share) for path in share.rglob('*') if path.is_file())
    return sorted(
        str(path) for path in files if path.stem != 'package' and path.parts[0] != 'hook'
    )


@pytest.mark.parametrize('package', MANIFESTS)
def test_a_package_builds_and_imports_on_its_dependencies_alone(workspaces, package):
    installed = workspaces.installed(package)
    assert shared_files(installed, package) == shared_files(ROOT / 'install' / package, package)
    everything = [*needed(package), package]
    found = workspaces.check('echo "$AMENT_PREFIX_PATH"', where=ROOT, packages=everything)
    assert all(f'/{other}' not in found for other in MANIFESTS if other not in everything)
    workspaces.check(
        'python -c "$0" "$1"', IMPORT_ALL, package, where=installed, packages=everything
    )
    for executable in (installed / 'lib' / package).glob('*'):
        if os.access(executable, os.X_OK) and executable.is_file():
            told = workspaces.check('"$0" --help', executable, where=ROOT, packages=everything)
            assert 'usage' in told.lower() or executable.name in told


@pytest.mark.skipif(not IS_LONG, reason='takes minutes: LONG=1')
@pytest.mark.parametrize(
    'package', [name for name in MANIFESTS if (ROOT / 'src' / name / 'test').is_dir()]
)
def test_a_package_passes_its_own_tests_on_its_dependencies_alone(workspaces, package):
    installed = workspaces.installed(package)
    everything = dict.fromkeys([*needed(package, RUN + TEST), package])
    workspaces.check(
        'python -m pytest -q -p no:cacheprovider '
        '-p fisheye_testing.own_domain -p fisheye_testing.unhurried',
        where=workspaces.folder(package) / 'src' / package,
        packages=everything,
    )
    assert installed.is_dir()
