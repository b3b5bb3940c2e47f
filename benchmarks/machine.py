"""What the numbers were measured on."""

import os
import platform
from pathlib import Path

import cv2
import numpy as np


def describe_machine() -> dict[str, object]:
    """Return the machine's description and how busy it is with other things."""
    return {
        'processor': _processor(),
        'cores': len(os.sched_getaffinity(0)),
        'memory_mib': os.sysconf('SC_PHYS_PAGES') * os.sysconf('SC_PAGE_SIZE') // 2**20,
        'system': f'{platform.system()} {platform.machine()}',
        'python': platform.python_version(),
        'numpy': np.__version__,
        'opencv': cv2.__version__,
        'load': os.getloadavg()[0],
    }


def _processor() -> str:
    """Name the processor as the kernel does; ARM boards name themselves elsewhere."""
    for path, key in (('/proc/cpuinfo', 'model name'), ('/proc/device-tree/model', '')):
        for line in Path(path).read_text().splitlines() if Path(path).exists() else ():
            if line.startswith(key):
                return line.partition(':')[2].strip() or line.strip('\0 ')
    return platform.processor()
