"""What the tests across packages share: real pictures, real processes, and ways to hurt them."""

import fcntl
import os
import shutil
import subprocess
from pathlib import Path

import hypothesis
import pytest
from chromium import INSTALL, browser_path, chromium, driver_path
from field import Field

from fisheye_testing.data import real_data
from fisheye_testing.domains import unused_domain
from fisheye_testing.rig import RigProcesses
from fisheye_testing.watcher import Watcher


@pytest.fixture
def real_rig():
    """Return the folder of a rig of real pictures by its name."""

    return lambda name: real_data('rigs', name)


@pytest.fixture
def domain() -> int:
    """Return a ROS domain of the test's own."""
    return unused_domain()


@pytest.fixture
def rig(domain, tmp_path):
    """Return an empty rig, whose processes end with the test."""
    with RigProcesses(domain, tmp_path / 'log') as rig:
        yield rig


@pytest.fixture
def watcher(domain):
    """Return a subscriber in the rig's domain."""
    with Watcher(domain) as watcher:
        yield watcher


# Not beside the tests.
hypothesis.configuration.set_hypothesis_home_dir(
    Path(__file__).parents[1] / 'build' / 'hypothesis'
)


@pytest.fixture(scope='module')
def five(tmp_path_factory):
    """Run five nodes on two network cameras."""
    with Field(unused_domain(), tmp_path_factory.mktemp('five')) as field:
        field.start_five()
        yield field


@pytest.fixture(scope='module')
def one(tmp_path_factory):
    """Run the panorama node on two network cameras."""
    with Field(unused_domain(), tmp_path_factory.mktemp('one')) as field:
        field.start_one()
        yield field


@pytest.fixture(scope='module')
def browser(tmp_path_factory):
    """Return a headless Chromium."""
    if not (browser_path() and driver_path()):
        message = f'Chromium or its driver is missing: {INSTALL}'
        if os.environ.get('REQUIRE_BROWSER') == '1':
            pytest.fail(message)
        pytest.skip(message)
    downloads = tmp_path_factory.mktemp('downloads')
    # A machine without a graphics card still draws WebGL.
    driver = chromium(
        'hide-scrollbars',
        'use-angle=swiftshader',
        'enable-unsafe-swiftshader',
        preferences={'download.default_directory': str(downloads)},
    )
    driver.downloads = downloads
    yield driver
    driver.quit()


@pytest.fixture(scope='session')
def interfaces() -> dict[str, str]:
    """Build the message packages in interfaces/; return variables with which nodes find them."""
    root = Path(__file__).parents[1]
    build = root / 'build' / 'test_interfaces'
    build.mkdir(parents=True, exist_ok=True)
    with (build / 'lock').open('w') as lock:  # tests that run beside these want them too
        fcntl.flock(lock, fcntl.LOCK_EX)
        # Where they lie colcon ignores them, so that no workspace has them beside the real ones.
        shutil.copytree(
            root / 'test' / 'interfaces',
            build / 'src',
            ignore=shutil.ignore_patterns('COLCON_IGNORE'),
            dirs_exist_ok=True,
        )
        command = ['colcon', '--log-base', build / 'log', 'build', '--base-paths', build / 'src']
        command += ['--build-base', build / 'build', '--install-base', build / 'install']
        command += ['--cmake-args', '-DBUILD_TESTING=OFF']
        done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    shell = f'set +u; source {build}/install/local_setup.bash && env -0'
    lines = subprocess.run(['bash', '-c', shell], capture_output=True, check=True).stdout
    variables = dict(line.split('=', 1) for line in os.fsdecode(lines).split('\0') if '=' in line)
    return {name: value for name, value in variables.items() if os.environ.get(name) != value}
