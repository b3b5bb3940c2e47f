"""YAML files that people edit: read with precise errors, never written by halves."""

import sys
from pathlib import Path
from typing import Any

import yaml

from fisheye_core.errors import FileAccessError, FileContentError
from fisheye_core.plain_yaml import Mapping, parse_mapping
from fisheye_core.regular_file import is_missing, read_regular, replace_regular

__all__ = ['is_missing', 'is_number', 'read_mapping', 'read_text', 'shown', 'write_mapping']

_MAX_BYTES = 100_000
"""Many times what a calibration or an overlap takes."""


def read_mapping(path: str | Path) -> Mapping:
    """Read a YAML file whose first document is a mapping.

    Raises
    ------
    FileAccessError
        If it cannot be read.
    FileContentError
        If it is too large, not text, not YAML or not a mapping; the sentence names the file and,
        where there is one, the line.
    """
    text = read_text(path)
    try:
        return parse_mapping(text)
    except FileContentError as error:
        raise FileContentError(error.reason, path) from error


def read_text(path: str | Path, max_bytes: int = _MAX_BYTES) -> str:
    """Read a short text file; of a longer one the YAML documents that begin it.

    Parameters
    ----------
    path
        Of the file.
    max_bytes
        What is still short.

    Raises
    ------
    FileAccessError
        If it cannot be read.
    FileContentError
        If it is too large or not text.
    """
    try:
        content = read_regular(path, max_bytes)
    except OSError as error:
        raise FileAccessError(path, 'read', error.strerror) from error
    if len(content) > max_bytes:
        # A topic that was echoed into a file: its first message is enough.
        content = content[: content.rfind(b'\n---') + 1]
        if not content:
            raise FileContentError(
                f'it is larger than {max_bytes} bytes; expected a short YAML file', path
            )
    try:
        return content.decode()
    except UnicodeDecodeError as error:
        raise FileContentError(f'it is not text (byte {error.start})', path) from error


def is_number(value: Any) -> bool:
    """Whether a value is a finite number that a float can hold; true and false are none."""
    return type(value) in (int, float) and abs(value) <= sys.float_info.max


def shown(value: Any) -> str:
    """Return a value as it may stand in a sentence."""
    return f'{value!r:.80}'


def write_mapping(path: str | Path, mapping: dict, comment: str = '') -> None:
    """Write a mapping as YAML; readers see the old file or the new one, never a part.

    Parameters
    ----------
    path
        Where to.
    mapping
        What.
    comment
        Lines that stand before it.

    Raises
    ------
    FileAccessError
        If the file cannot be written.
    """
    text = yaml.safe_dump(mapping, sort_keys=False, default_flow_style=None, width=100)
    text = ''.join(f'# {line}\n' for line in comment.splitlines()) + text
    try:
        replace_regular(path, text)
    except OSError as error:
        raise FileAccessError(path, 'written', error.strerror) from error
