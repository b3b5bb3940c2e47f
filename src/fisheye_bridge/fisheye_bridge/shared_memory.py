"""Shared memory, over which Fast DDS exchanges pictures on one machine: enough, and clean."""

import fcntl
import os
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from ament_index_python.packages import get_package_share_directory

FOLDER = Path('/dev/shm')
_PROFILE, _SMALL_PROFILE = 'fastdds.xml', 'fastdds_small.xml'
_MIB = 1 << 20
_NEEDED, _NEEDED_SMALL = 72 * _MIB, 12 * _MIB
"""What a process takes with each of the two profiles, and some room."""
_VARIABLE = 'FASTRTPS_DEFAULT_PROFILES_FILE'
_REMEDY = 'in a container: --shm-size=1g'
_YOUNG_S = 1.0
"""Whoever makes a lock needs a moment until it is locked."""
_LOOK_S = 1.0


def prepare(folder: Path = FOLDER) -> str:
    """Clear what killed processes left and use the profile that fits the room.

    To be called before the first node is made. A profile that the environment names is kept; where
    it names none, as in an installed Debian package, this package's own is taken.

    Parameters
    ----------
    folder
        Where shared memory is.

    Returns
    -------
    str
        What is not as it should be; '' if nothing.
    """
    if not is_fast_dds():
        return ''
    _clear(folder)
    own = Path(get_package_share_directory('fisheye_bridge'), 'config', _PROFILE)
    os.environ.setdefault(_VARIABLE, str(own))
    room = _room(folder)
    if room >= _NEEDED:
        return ''
    profile = Path(os.environ[_VARIABLE])
    small = profile.with_name(_SMALL_PROFILE) if profile.name == _PROFILE else profile
    has = f'{folder} has room for {room // _MIB} MiB; expected {_NEEDED // _MIB} for each process'
    if room >= _NEEDED_SMALL and small.is_file():
        os.environ[_VARIABLE] = str(small)
        return f'{has}: pictures of more than 2 million pixels may be lost ({_REMEDY})'
    return f'{has}: pictures go over UDP, and some may be lost ({_REMEDY})'


def is_fast_dds() -> bool:
    """Whether the environment leaves the middleware at Fast DDS."""
    return os.environ.get('RMW_IMPLEMENTATION', 'rmw_fastrtps_cpp') == 'rmw_fastrtps_cpp'


class OwnPorts:
    """The ports at which this process listens, each with a lock that it holds."""

    def __init__(self, now_s: Callable[[], float] = time.monotonic):
        self._now_s = now_s
        self._due_s = now_s() + _LOOK_S
        self._suspect: set[str] = set()
        self._avoided: set[str] = set()

    def locks(self) -> set[str]:
        """Return the locks of the ports, which are files beside those of the ports themselves."""
        held = set()
        for link in Path('/proc/self/fd').iterdir():
            with suppress(OSError):
                target = str(link.readlink())
                if Path(target).name.startswith('fastrtps_port') and target.endswith('_el'):
                    held.add(target)
        return held - self._avoided

    def lost(self) -> str:
        """Return that a port is lost, as seen in two looks a second apart; '' if none is.

        Who clears up after a killed process may do so just when its successor has made a port of
        the same name: the successor keeps a file without a name, and hears of nobody. It cannot
        miss whom it does not know.
        """
        if self._now_s() < self._due_s:
            return ''
        self._due_s = self._now_s() + _LOOK_S
        former, self._suspect = self._suspect, _without_file(self.locks())
        lost = former & self._suspect
        return f'others cannot find {", ".join(sorted(lost))}' if lost else ''

    def avoid(self, locks: set[str]) -> None:
        """Hold locks, so that Fast DDS opens other ports; call it while no context is up.

        Whoever has a wrong view of a port keeps it: its next owner would be as deaf. A port whose
        lock is held is passed over.
        """
        for lock in locks:
            with suppress(OSError):
                file = os.open(lock, os.O_RDONLY | os.O_CREAT | os.O_CLOEXEC, 0o666)
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)  # until the process ends
        self._avoided |= locks


def _without_file(locks: set[str]) -> set[str]:
    """Return the ports whose name is that of another file than this process has mapped."""
    ports = {lock.removesuffix('_el') for lock in locks}
    mapped = set()
    for line in Path('/proc/self/maps').read_text().splitlines():
        fields = line.removesuffix(' (deleted)').split(maxsplit=5)
        if fields[-1] in ports:
            mapped.add((fields[-1], int(fields[-2])))
    return {port for port in ports if (port, _inode(port)) not in mapped}


def _inode(path: str) -> int:
    try:
        return Path(path).stat().st_ino
    except OSError:
        return 0


def _room(folder: Path) -> int:
    """Return how many bytes can still be taken; 0 where nothing can be written."""
    try:
        state = os.statvfs(folder)
    except OSError:
        return 0
    is_writable = not state.f_flag & os.ST_RDONLY and os.access(folder, os.W_OK)
    return state.f_bavail * state.f_frsize if is_writable else 0


def _clear(folder: Path) -> None:
    """Remove segments whose lock nobody holds: their owners were killed."""
    for lock in folder.glob('fastrtps_' + '[0-9a-f]' * 16 + '_el'):
        with suppress(OSError), lock.open('rb') as file:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if time.time() - os.fstat(file.fileno()).st_mtime > _YOUNG_S:
                lock.with_name(lock.name.removesuffix('_el')).unlink(missing_ok=True)
                lock.unlink()
