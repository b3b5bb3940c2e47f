"""Make `.venv`, in which the Makefile builds, tests and runs.

Where ROS 2 Jazzy is sourced, `.venv` holds only the Python modules of requirements.txt that are
missing there; anywhere else it holds ROS 2 Jazzy too, from wheels. A `.venv` that is as it should
be is left alone. What the machine lacks is named in one sentence.
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
VERSION = '{}.{}'.format(*sys.version_info[:2])
# Distributions whose module has another name.
MODULES = {
    'empy': 'em',
    'opencv-python-headless': 'cv2',
    'pillow': 'PIL',
    'pupil-apriltags': 'pupil_apriltags',
    'pytest-xdist': 'xdist',
    'pyyaml': 'yaml',
}


def main():
    """Make `.venv`, unless it was made from these requirements for this Python and this ROS."""
    ros = os.environ.get('ROS_DISTRO', '')
    python = Path(getattr(sys, '_base_executable', sys.executable)).resolve()
    recipe = hashlib.sha256(REQUIREMENTS.read_bytes() + Path(__file__).read_bytes()).hexdigest()
    state = '\n'.join([str(python), platform.python_version(), str(ROOT), ros, recipe])
    if DONE.exists() and DONE.read_text() == state:
        return
    check_machine(ros)
    missing = missing_beside_ros() if ros else ['-r', REQUIREMENTS]
    say(f'Making .venv for Python {VERSION} with ROS 2 {"as sourced" if ros else "from wheels"}')
    shutil.rmtree(VENV, ignore_errors=True)
    system = ['--system-site-packages'] if ros else []
    if subprocess.run([python, '-m', 'venv', *system, VENV]).returncode:
        stop('Python could not make .venv; its own words are above')
    install(missing)
    packages = VENV / 'lib' / f'python{VERSION}' / 'site-packages'
    correct_cmake_files(VENV / 'share', packages)
    (VENV / 'local_setup.bash').write_text(shell_setup(ros, packages))
    DONE.write_text(state)


def check_machine(ros):
    """Stop where something is in the way that only the user can change."""
    if re.search(r'[\s:;$\'"]', str(ROOT)):
        stop(f'colcon cannot work below a folder with such a name, rename it: {ROOT}')
    if ros not in ('', 'jazzy'):
        stop(f'ROS 2 {ros} is sourced: use a shell with ROS 2 Jazzy, or with none')
    if ros and not os.environ.get('AMENT_PREFIX_PATH'):
        stop(f'ROS_DISTRO is set, but ROS 2 is not sourced: source /opt/ros/{ros}/setup.bash')
    if ros and not serves_this_python(importlib.util.find_spec('rclpy')):
        stop(f'The sourced ROS 2 is not for Python {VERSION}: make PYTHON=/usr/bin/python3')
    machine = f'{platform.system()} {platform.machine()}'
    if not ros and machine != 'Linux x86_64':
        stop(f'There are no wheels of ROS 2 for {machine}: install ROS 2 Jazzy and source it')
    if not importlib.util.find_spec('ensurepip'):
        stop(f'Python cannot make virtual environments: sudo apt install python{VERSION}-venv')
    if not Path(sysconfig.get_paths()['include'], 'Python.h').exists():
        stop(f'The headers of Python are missing: sudo apt install python{VERSION}-dev')
    if not any(map(shutil.which, [os.environ.get('CXX', 'c++'), 'g++', 'clang++'])):
        stop('A C++ compiler is missing: sudo apt install g++')


def serves_this_python(module):
    """Whether a module's compiled parts were built for the Python that runs this."""
    binaries = f'*.{sys.implementation.cache_tag}-*.so'
    return module is not None and any(Path(module.origin).parent.glob(binaries))


def missing_beside_ros():
    """Return what pip has to add to the sourced ROS 2."""
    prefixes = os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep)
    # What is added may be older than in requirements.txt, so as to go with the NumPy of ROS.
    missing = [f'numpy=={importlib.metadata.version("numpy")}']
    lines = re.findall(r'^([\w-]+).*?==(\S+)( ; [^#\n]*)?', REQUIREMENTS.read_text(), re.M)
    for name, version, only_on in lines:
        package = name.replace('ros-jazzy-', '').replace('-', '_')
        if name.startswith('ros-jazzy-'):
            if not any(Path(prefix, 'share', package).exists() for prefix in prefixes):
                stop(f'The sourced ROS 2 lacks {package}: sudo apt install {name}')
        elif name.startswith('colcon-'):
            if not shutil.which('colcon'):
                stop('colcon is missing: sudo apt install python3-colcon-common-extensions')
        elif name == 'cmake':
            if not shutil.which('cmake'):
                stop('cmake is missing: sudo apt install cmake')
        elif not importlib.util.find_spec(MODULES.get(name, name)):
            missing.append(f'{name}<={version}{only_on.rstrip()}')
    return missing


def install(requirements):
    """Install into `.venv` with pip, and print the progress."""
    say('Installing Python packages, which takes a minute or more the first time')
    command = [VENV / 'bin' / 'python', '-m', 'pip', 'install', '--no-cache-dir', *requirements]
    command += ['--prefer-binary', '--use-pep517']  # empy has no wheel
    command += ['--disable-pip-version-check', '--progress-bar=off']
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as pip:
        collected = 0
        for line in pip.stdout:
            collected += line.startswith('Collecting')
            if line.startswith('Collecting') and collected % 25 == 0:
                say(f'  {collected} packages fetched')
            elif line.startswith('Installing collected'):
                say(f'  {collected} packages fetched, unpacking them')
    if pip.returncode:
        stop('pip could not install what requirements.txt names; its own words are above')


def correct_cmake_files(share, packages):
    """Replace the folders of another machine that the wheels' CMake files name.

    Parameters
    ----------
    share : Path
        The folder with the CMake files.
    packages : Path
        The site-packages folder that holds NumPy.
    """
    headers = re.compile(r'/opt/python/[\w-]+/include/python[\d.]+')
    numpy = re.compile(r'/opt/python/[\w-]+/lib/python[\d.]+/site-packages/numpy')
    for path in share.glob('*/cmake/*.cmake'):
        text = path.read_text()
        corrected = headers.sub(sysconfig.get_paths()['include'], text)
        corrected = numpy.sub(f'{packages}/numpy', corrected)
        if corrected != text:
            path.write_text(corrected)


def shell_setup(ros, packages):
    """Return what bash needs to find `.venv`: the script that colcon expects in a prefix."""
    lines = [prepend('PATH', VENV / 'bin')]
    if ros:
        lines += [prepend('PYTHONPATH', packages)]  # the Python of ROS does not look into .venv
    else:
        lines += [
            '[ -z "$ROS_DISTRO" ] ||',
            '  { echo "This was built without ROS 2 sourced: make build." >&2; return 1; }',
            'unset COLCON_PREFIX_PATH  # another checkout would become a part of this one',
            f'export AMENT_PREFIX_PATH="{VENV}"',
            prepend('LD_LIBRARY_PATH', VENV / 'lib', *sorted(packages.glob('ros_*.libs'))),
            '# The wheels need not start each Python twice to set it, in no order.',
            'export _ROS_WHEELS_BOOTSTRAP_COMPLETE=1',
        ]
    return '\n'.join(lines) + '\n'


def prepend(name, *folders):
    """Return bash that puts folders first in a path variable, unless they are there."""
    first = ':'.join(map(str, folders))
    return f'[[ ":${name}:" == *":{first}:"* ]] || export {name}="{first}${{{name}:+:${name}}}"'


def say(line):
    """Print a line of progress."""
    print(line, flush=True)


def stop(sentence):
    """Exit with a failure and a sentence."""
    sys.exit(f'fisheye-panorama: {sentence}.')


if __name__ == '__main__':
    try:
        main()
    except OSError as error:
        stop(f'.venv could not be made: {error}')
    except KeyboardInterrupt:
        stop('.venv is not finished: it was interrupted')
