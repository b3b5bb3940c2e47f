"""Make `.venv`, the environment that the Makefile builds, tests and runs in.

Where ROS 2 Jazzy is sourced, `.venv` holds only the Python modules of requirements.txt that are
missing there; anywhere else it holds ROS 2 Jazzy too, from wheels. A `.venv` that is already what
it should be is left alone. What is missing on the machine is named in one sentence.
"""

import hashlib
import importlib.metadata
import importlib.util
import os
import platform
import re
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
VENV = ROOT / '.venv'
REQUIREMENTS = ROOT / 'requirements.txt'
DONE = VENV / '.done'
OLDEST, NEWEST = (3, 10), (3, 13)
# Distributions whose module is not called like them.
MODULES = {'opencv-python-headless': 'cv2', 'pyyaml': 'yaml'}
# The wheels' CMake files name two directories of the machine that built them.
FOREIGN_INCLUDE = re.compile(r'/opt/python/cp\d+-cp\d+/include/python3\.\d+')
FOREIGN_NUMPY = re.compile(r'/opt/python/cp\d+-cp\d+/lib/python3\.\d+/site-packages/numpy/')


def main():
    """Make `.venv` unless it is there, made by this script from these requirements."""
    ros = os.environ.get('ROS_DISTRO')
    python = Path(getattr(sys, '_base_executable', sys.executable)).resolve()
    sources = REQUIREMENTS.read_bytes() + Path(__file__).read_bytes()
    state = '\n'.join(
        [f'{python} {platform.python_version()}', str(ROOT), str(ros)]
        + [hashlib.sha256(sources).hexdigest()]
    )
    if DONE.exists() and DONE.read_text() == state:
        return
    check_machine(ros)
    origin = 'the sourced ROS 2' if ros else 'wheels of ROS 2'
    say(f'Setting up .venv with Python {platform.python_version()} and {origin} ...')
    shutil.rmtree(VENV, ignore_errors=True)
    run([python, '-m', 'venv', *(['--system-site-packages'] if ros else []), VENV])
    if ros:
        install(missing_beside_ros())
    else:
        install(['-r', REQUIREMENTS])
        correct_cmake_files()
    write_shell_setup(ros)
    DONE.write_text(state)


def check_machine(ros):
    """Stop with a sentence where something is missing that only the user can install."""
    version = '{}.{}'.format(*sys.version_info[:2])
    if not OLDEST <= sys.version_info[:2] <= NEWEST:
        stop(f'Python 3.10 to 3.13 is needed, this is {version}: make PYTHON=python3.12 ...')
    if ros not in (None, 'jazzy'):
        stop(f'ROS 2 Jazzy is needed, {ros} is sourced: use a shell with Jazzy or with none.')
    if not ros and (platform.system(), platform.machine()) != ('Linux', 'x86_64'):
        stop(
            f'There are no wheels of ROS 2 for {platform.system()} on {platform.machine()}: '
            'install ROS 2 Jazzy and source it.'
        )
    if not importlib.util.find_spec('ensurepip'):
        stop(f'The venv module of Python is missing: sudo apt install python{version}-venv')
    if not Path(sysconfig.get_paths()['include'], 'Python.h').exists():
        stop(f'The headers of Python are missing: sudo apt install python{version}-dev')
    if not any(map(shutil.which, ['c++', os.environ.get('CXX', 'g++')])):
        stop('A C++ compiler is missing: sudo apt install g++')


def missing_beside_ros():
    """Return what pip must add to the sourced ROS 2, with limits that leave its NumPy alone."""
    wanted = []
    for name, version in re.findall(r'^([\w-]+).*==([\d.]+)', REQUIREMENTS.read_text(), re.M):
        if name.startswith('ros-jazzy-'):
            package = name.replace('ros-jazzy-', '').replace('-', '_')
            prefixes = os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep)
            if not any(Path(prefix, 'share', package).exists() for prefix in prefixes):
                stop(f'The sourced ROS 2 lacks {package}: sudo apt install {name}')
        elif name.startswith('colcon-'):
            if not shutil.which('colcon'):
                stop('colcon is missing: sudo apt install python3-colcon-common-extensions')
        elif name == 'cmake':
            if not shutil.which('cmake'):
                stop('cmake is missing: sudo apt install cmake')
        elif not importlib.util.find_spec(MODULES.get(name, name)):
            # A newer one may want a newer NumPy than the one that ROS was built with.
            wanted.append(f'{name}<={version}')
    if importlib.util.find_spec('numpy'):
        wanted.append(f'numpy=={importlib.metadata.version("numpy")}')
    return wanted


def install(arguments):
    """Have pip install wheels into `.venv`, saying how far it is."""
    say('Installing what requirements.txt names (some minutes the first time) ...')
    command = [VENV / 'bin' / 'python', '-m', 'pip', 'install', '--prefer-binary']
    command += ['--no-cache-dir', '--disable-pip-version-check', '--progress-bar=off', *arguments]
    with subprocess.Popen(list(map(str, command)), stdout=subprocess.PIPE, text=True) as pip:
        found = 0
        for line in pip.stdout:
            found += line.startswith('Collecting')
            if line.startswith('Collecting') and found % 25 == 0:
                say(f'  {found} wheels fetched ...')
            elif line.startswith('Installing'):
                say(f'  {found} wheels fetched, unpacking ...')
    if pip.returncode:
        stop('pip could not install what requirements.txt names; its own words are above.')


def correct_cmake_files():
    """Let the wheels' CMake files name this Python's headers and this NumPy's."""
    include = sysconfig.get_paths()['include']
    packages = sysconfig.get_paths(vars={'base': str(VENV)})['purelib']
    for path in VENV.glob('share/*/cmake/*.cmake'):
        text = path.read_text()
        corrected = FOREIGN_NUMPY.sub(f'{packages}/numpy/', FOREIGN_INCLUDE.sub(include, text))
        if corrected != text:
            path.write_text(corrected)


def write_shell_setup(ros):
    """Write what a shell needs to find `.venv`, under the name that colcon looks for in a prefix."""
    packages = sysconfig.get_paths(vars={'base': str(VENV)})['purelib']
    lines = [f'[[ ":$PATH:" == *":{VENV}/bin:"* ]] || export PATH="{VENV}/bin:$PATH"']
    if ros:
        lines.append(f'export PYTHONPATH="$PYTHONPATH:{packages}"')
    else:
        lines.append(f'export AMENT_PREFIX_PATH="{VENV}"')
    Path(VENV, 'local_setup.bash').write_text('\n'.join(lines) + '\n')


def run(command):
    """Run a command whose failure stops the set-up."""
    if subprocess.run(list(map(str, command))).returncode:
        stop(f'This failed: {" ".join(map(str, command))}')


def say(line):
    """Print one line of progress."""
    print(line, flush=True)


def stop(sentence):
    """End with a sentence and a failure."""
    sys.exit(f'fisheye-panorama: {sentence}')


if __name__ == '__main__':
    main()
