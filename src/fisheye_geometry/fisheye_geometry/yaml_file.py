"""YAML files that people edit: read with precise errors, never written by halves."""

import os
import sys
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import Any

import yaml

from fisheye_geometry.errors import CameraFileError

_MAX_BYTES = 1_000_000


def is_missing(path: str | Path) -> bool:
    """Whether there is no such file; of one that cannot be looked at, `read_mapping` tells."""
    with suppress(OSError):
        try:
            Path(path).stat()
        except (FileNotFoundError, ValueError):  # no file has a zero byte in its name
            return True
    return False


def read_mapping(path: str | Path) -> dict:
    """Read a YAML file that holds a mapping.

    Raises
    ------
    CameraFileError
        If there is no such file, or it is too large, not text, not YAML or not a mapping; the
        sentence names the file and, where there is one, the line.
    """
    path = Path(path)
    try:
        with path.open('rb') as file:
            content = file.read(_MAX_BYTES + 1)
    except OSError as error:
        raise CameraFileError(f'{path} cannot be read: {error.strerror}') from error
    if len(content) > _MAX_BYTES:
        raise CameraFileError(
            f'{path} is larger than {_MAX_BYTES} bytes; expected a short YAML file'
        )
    try:
        text = content.decode()
        _refuse_aliases(path, text)
        mapping = yaml.safe_load(text)
    except UnicodeDecodeError as error:
        raise CameraFileError(f'{path} is not text (byte {error.start})') from error
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        line = f' at line {mark.line + 1}' if mark else ''
        raise CameraFileError(f'{path} is not valid YAML{line}: {error.problem}') from error
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        reason = str(error).splitlines()[0]
        raise CameraFileError(f'{path} is not valid YAML: {reason}') from error
    if not isinstance(mapping, dict):
        raise CameraFileError(
            f'{path} holds {type(mapping).__name__}; expected `key: value` lines'
        )
    return mapping


def is_number(value: Any) -> bool:
    """Whether a value is a finite number that a float can hold; true and false are none."""
    return type(value) in (int, float) and abs(value) <= sys.float_info.max


def shown(value: Any) -> str:
    """Give a value as it may stand in a sentence."""
    try:
        return f'{value!r:.80}'
    except ValueError:
        return 'a number of too many digits'  # more than Python writes


def _refuse_aliases(path: Path, text: str) -> None:
    """Refuse references within a file, with which a few lines can mean more than fits."""
    for token in yaml.scan(text):
        if isinstance(token, yaml.AliasToken):
            raise CameraFileError(
                f'{path} refers to `&{token.value}` at line {token.start_mark.line + 1}; '
                'expected plain values'
            )


def write_mapping(path: str | Path, mapping: dict) -> None:
    """Write a mapping as YAML; readers see the old file or the new one, never a part.

    Raises
    ------
    CameraFileError
        If the file cannot be written.
    """
    path = Path(path)
    text = yaml.safe_dump(mapping, sort_keys=False, default_flow_style=None, width=100)
    temporary = None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        descriptor, temporary = tempfile.mkstemp(dir=path.parent, prefix=f'.{path.name}.')
        with os.fdopen(descriptor, 'w') as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
    except OSError as error:
        if temporary:
            Path(temporary).unlink(missing_ok=True)
        raise CameraFileError(f'{path} cannot be written: {error.strerror}') from error
