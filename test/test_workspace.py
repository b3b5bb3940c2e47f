"""The packages agree with each other, and env.bash gives a shell in which they run."""

import ast
import os
import subprocess
from pathlib import Path
from xml.etree import ElementTree

import pytest

ROOT = Path(__file__).resolve().parent.parent
MANIFESTS = sorted(ROOT.glob('src/*/package.xml'))
SETUPS = sorted(ROOT.glob('src/*/setup.py'))


def shell(script, folder=ROOT, **environment):
    return subprocess.run(
        ['bash', '-c', script],
        cwd=folder,
        env={'PATH': os.environ['PATH'], 'HOME': os.environ['HOME'], **environment},
        capture_output=True,
        text=True,
    )


def keywords(setup):
    call = ast.parse(setup.read_text()).body[-1].value
    return {keyword.arg: keyword.value for keyword in call.keywords}


@pytest.mark.parametrize('tag', ['version', 'license', 'maintainer'])
def test_packages_agree(tag):
    assert len({ElementTree.parse(path).findtext(tag) for path in MANIFESTS}) == 1


@pytest.mark.parametrize('setup', SETUPS, ids=lambda path: path.parent.name)
def test_setup_says_what_the_manifest_says(setup):
    manifest, told = ElementTree.parse(setup.with_name('package.xml')), keywords(setup)
    for tag in ('version', 'maintainer', 'description', 'license'):
        assert told[tag].value == manifest.findtext(tag)
    assert told['maintainer_email'].value == manifest.find('maintainer').get('email')
    assert (setup.parent / setup.parent.name / 'py.typed').exists()
    assert 'py.typed' in ast.unparse(told['package_data'])


@pytest.mark.parametrize('setup', SETUPS, ids=lambda path: path.parent.name)
def test_a_package_changes_nothing_for_the_tests_of_others(setup):
    entries = keywords(setup).get('entry_points')
    assert set(ast.literal_eval(entries or '{}')) <= {'console_scripts'}


def test_plugins_are_loaded_for_our_own_tests(pytestconfig):
    for plugin in ('own_domain', 'unhurried'):
        assert pytestconfig.pluginmanager.has_plugin(f'fisheye_testing.{plugin}')


@pytest.mark.parametrize('manifest', MANIFESTS, ids=lambda path: path.parent.name)
def test_a_package_brings_its_license_and_changelog(manifest):
    folder = manifest.parent
    assert (folder / 'LICENSE').read_bytes() == (ROOT / 'LICENSE').read_bytes()
    assert not (folder / 'LICENSE').is_symlink()
    first, title, last = (folder / 'CHANGELOG.rst').read_text().splitlines()[:3]
    assert title == f'Changelog for package {folder.name}'
    assert first == last == '^' * len(title)


def test_what_a_user_edits_is_what_the_packages_install():
    links = sorted((ROOT / 'config').iterdir())
    assert [link.name for link in links] == [
        'calibration',
        'fastdds.xml',
        'fastdds_small.xml',
        'panorama.yaml',
    ]
    for link in links:
        assert not link.readlink().is_absolute()
        package = link.resolve(strict=True).relative_to(ROOT / 'src').parts[0]
        installed = ROOT / 'install' / package / 'share' / package / 'config' / link.name
        pairs = [(link, installed)] if link.is_file() else []
        pairs += [(file, installed / file.name) for file in link.glob('*')]
        for ours, theirs in pairs:
            assert ours.read_bytes() == theirs.read_bytes()


@pytest.mark.parametrize('setup', SETUPS, ids=lambda path: path.parent.name)
def test_every_executable_is_installed_and_has_a_main(setup):
    entries = keywords(setup).get('entry_points')
    for script in ast.literal_eval(entries or '{}').get('console_scripts', []):
        name, module = script.removesuffix(':main').split(' = ')
        package = setup.parent.name
        assert os.access(ROOT / 'install' / package / 'lib' / package / name, os.X_OK)
        body = ast.parse((setup.parent / f'{module.replace(".", "/")}.py').read_text()).body
        assert 'main' in [node.name for node in body if isinstance(node, ast.FunctionDef)]


def test_environment_works_anywhere_and_twice(tmp_path):
    source = f'source "{ROOT}/env.bash"'
    once = shell(f'set -eu; {source}; env', tmp_path)
    twice = shell(f'set -eu; {source}; {source}; env', tmp_path)
    assert once.returncode == 0, once.stderr
    assert sorted(once.stdout.splitlines()) == sorted(twice.stdout.splitlines())
    assert 'ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST' in once.stdout
    assert 'fastdds.xml' in once.stdout


def test_environment_keeps_what_the_user_chose():
    chosen = {
        'FASTRTPS_DEFAULT_PROFILES_FILE': '/my/profile.xml',
        'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET',
        'ROS_LOG_DIR': '/my/log',
    }
    lines = shell('source env.bash; env', **chosen).stdout.splitlines()
    assert {f'{name}={value}' for name, value in chosen.items()} <= set(lines)


def test_what_is_installed_stays_on_this_machine():
    printed = shell('source install/setup.bash; env').stdout
    assert 'ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST' in printed
    assert 'fastdds.xml' in printed


def test_no_thread_waits_for_matrices_to_share_out():
    # Theirs are small here; threads that wait for the next one take the cores from the frames.
    count = 'import numpy, pathlib; print(len(list(pathlib.Path("/proc/self/task").iterdir())))'
    assert shell(f"source install/setup.bash; python -c '{count}'").stdout.strip() == '1'


def test_environment_says_that_nothing_is_built(tmp_path):
    (tmp_path / 'env.bash').write_text((ROOT / 'env.bash').read_text())
    result = shell('source ./env.bash', tmp_path)
    assert result.returncode != 0
    assert 'make build' in result.stderr
