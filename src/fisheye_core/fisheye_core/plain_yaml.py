"""YAML of plain values: mappings, lists, numbers, texts; nothing that can build anything else.

Read in one pass over the events of PyYAML's parser, bounded in depth and in size. Numbers are
those of YAML 1.2 and of yaml-cpp, so that `1e-05` is one; keys are texts.
"""

import re
from typing import Any

import yaml

from fisheye_core.errors import FileContentError

_MAX_DEPTH = 20
_MAX_SIZE = 300_000
"""Values and their characters, with all that aliases repeat: more than a file may hold without."""
_WORDS = {
    **dict.fromkeys(('', '~', 'null', 'Null', 'NULL'), None),
    **dict.fromkeys(('true', 'True', 'TRUE'), True),
    **dict.fromkeys(('false', 'False', 'FALSE'), False),
}
_INTEGER = re.compile('[-+]?(0|[1-9][0-9]{0,17})')
_DECIMAL = re.compile(r'[-+]?(0|[1-9][0-9]*|(?=\.[0-9]))(\.[0-9]*)?([eE][-+]?[0-9]+)?')
_SPECIAL = re.compile(r'([-+]?)\.(inf|Inf|INF|nan|NaN|NAN)')
_IGNORED_TAG = 'tag:yaml.org,2002:opencv-matrix'
_OPENCV_HEAD = re.compile('\ufeff?%YAML:1.0')


class Mapping(dict):
    """Entries of a mapping, and how they stand in the file.

    Attributes
    ----------
    lines : dict of str to int
        Line of each key, counted from 1.
    texts : dict of str to str
        Values that are no lists or mappings, as they were written.
    """

    def __init__(self) -> None:
        super().__init__()
        self.lines: dict[str, int] = {}
        self.texts: dict[str, str] = {}

    def at(self, key: str) -> str:
        """Return how a sentence about a key begins: with its line, or '' where it has none."""
        return f'line {self.lines[key]}: ' if key in self.lines else ''


def parse_mapping(text: str) -> Mapping:
    """Read the first document of a text, which must be a mapping.

    Parameters
    ----------
    text
        YAML; a head as OpenCV's FileStorage writes it, its matrices, tabs between values and
        aliases are taken; other tags are not.

    Raises
    ------
    FileContentError
        If it is something else; the sentence names the line.
    """
    try:
        return _Builder(_OPENCV_HEAD.sub('#', text, count=1)).document()
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        line = f' at line {mark.line + 1}' if mark else ''
        raise FileContentError(f'not valid YAML{line}: {error.problem:.200}') from error
    except (yaml.YAMLError, ValueError, OverflowError) as error:  # of characters that are none
        reason = str(error).splitlines()[0]
        raise FileContentError(f'not valid YAML: {reason}') from error


class _Events(yaml.reader.Reader, yaml.scanner.Scanner, yaml.parser.Parser):
    """PyYAML's parser without what would resolve or construct; tabs may stand between values."""

    def __init__(self, text: str):
        yaml.reader.Reader.__init__(self, text)
        yaml.scanner.Scanner.__init__(self)
        yaml.parser.Parser.__init__(self)

    def scan_to_next_token(self) -> None:
        """Skip white space, tabs too but where they would indent."""
        super().scan_to_next_token()
        while self.peek() == '\t':
            count = 1
            while self.peek(count) in ' \t':
                count += 1
            is_indent = self.allow_simple_key and not self.flow_level
            if is_indent and self.peek(count) not in '\0\r\n#':
                raise yaml.scanner.ScannerError(
                    None, None, 'a tab indents the line; expected spaces', self.get_mark()
                )
            self.forward(count)
            super().scan_to_next_token()


class _Builder:
    """Builds the values of one document."""

    def __init__(self, text: str):
        self._events = _Events(text)
        self._anchors: dict[str, tuple[Any, int]] = {}
        self._size = 0

    def document(self) -> Mapping:
        events = self._events
        events.get_event()  # the stream's start
        if events.check_event(yaml.StreamEndEvent):
            raise FileContentError('it is empty; expected `key: value` lines')
        events.get_event()
        value = self._value(events.get_event(), 0)
        events.get_event()
        events.peek_event()  # anything but another document is an error
        if not isinstance(value, Mapping):
            kind = 'a list' if isinstance(value, list) else 'a single value'
            raise FileContentError(f'it holds {kind}; expected `key: value` lines')
        return value

    def _value(self, event: Any, depth: int) -> Any:
        line = event.start_mark.line + 1
        before = self._size
        self._count(1, line)
        if isinstance(event, yaml.AliasEvent):
            if event.anchor not in self._anchors:
                raise FileContentError(
                    f'line {line}: it refers to `&{event.anchor:.40}`, which is not defined before'
                )
            value, count = self._anchors[event.anchor]
            self._count(count, line)
            return value
        _refuse_tag(event)
        if depth > _MAX_DEPTH:
            raise FileContentError(
                f'line {line}: it is more than {_MAX_DEPTH} levels deep; expected plain values'
            )
        if isinstance(event, yaml.ScalarEvent):
            self._count(len(event.value), line)
            value = _scalar(event.value) if event.implicit[0] else _text(event.value)
        elif isinstance(event, yaml.SequenceStartEvent):
            value = self._sequence(depth)
        else:
            value = self._mapping(depth)
        if event.anchor is not None:
            self._anchors[event.anchor] = value, self._size - before
        return value

    def _sequence(self, depth: int) -> list:
        values = []
        while not isinstance(event := self._events.get_event(), yaml.SequenceEndEvent):
            values.append(self._value(event, depth + 1))
        return values

    def _mapping(self, depth: int) -> Mapping:
        mapping = Mapping()
        while not isinstance(event := self._events.get_event(), yaml.MappingEndEvent):
            line = event.start_mark.line + 1
            if not isinstance(event, yaml.ScalarEvent):
                raise FileContentError(f'line {line}: a key is not plain text')
            _refuse_tag(event)
            key = _text(event.value)
            mapping.lines[key] = line
            event = self._events.get_event()
            mapping[key] = self._value(event, depth + 1)
            if isinstance(event, yaml.ScalarEvent):
                mapping.texts[key] = event.value
        return mapping

    def _count(self, count: int, line: int) -> None:
        self._size += count
        if self._size > _MAX_SIZE:
            raise FileContentError(f'line {line}: aliases repeat too much; expected plain values')


def _refuse_tag(event: Any) -> None:
    if event.tag not in (None, _IGNORED_TAG):
        tag, line = event.tag.replace('tag:yaml.org,2002:', '!!'), event.start_mark.line + 1
        raise FileContentError(f'line {line}: it has the tag {tag!r:.60}; expected plain values')


def _scalar(text: str) -> Any:
    """Resolve what stands without quotes: a word, a number, or else the text itself."""
    if text in _WORDS:
        return _WORDS[text]
    if _INTEGER.fullmatch(text):
        return int(text)
    if _DECIMAL.fullmatch(text):
        return float(text)
    if special := _SPECIAL.fullmatch(text):
        return float(special[1] + special[2])
    return _text(text)


def _text(text: str) -> str:
    """Return a text after a look whether others can write it: half a surrogate pair cannot be."""
    text.encode()
    return text
