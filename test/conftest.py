"""What the tests across packages share: real pictures, real processes, and ways to hurt them."""

import os
import shutil
from pathlib import Path

import hypothesis
import pytest
from field import Field
from selenium import webdriver

from fisheye_testing.data import real_data
from fisheye_testing.rig import RigProcesses, unused_domain
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
    """Return a headless Chromium, as packaged by Debian."""
    if missing := [name for name in ('chromium', 'chromedriver') if not shutil.which(name)]:
        message = f'{" and ".join(missing)} missing: sudo apt install chromium chromium-driver'
        if os.environ.get('REQUIRE_BROWSER') == '1':
            pytest.fail(message)
        pytest.skip(message)
    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which('chromium')
    for switch in ('headless=new', 'hide-scrollbars', 'use-angle=swiftshader'):
        options.add_argument(f'--{switch}')
    # A machine without a graphics card still draws WebGL; root cannot have Chromium's sandbox.
    options.add_argument('--enable-unsafe-swiftshader')
    if os.geteuid() == 0:
        options.add_argument('--no-sandbox')
    options.accept_insecure_certs = True
    downloads = tmp_path_factory.mktemp('downloads')
    options.add_experimental_option('prefs', {'download.default_directory': str(downloads)})
    driver = webdriver.Chrome(options, webdriver.ChromeService(shutil.which('chromedriver')))
    driver.downloads = downloads
    yield driver
    driver.quit()
