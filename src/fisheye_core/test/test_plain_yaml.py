"""YAML of plain values: what each text means, and that nothing else comes of any text."""

import math

import pytest

from fisheye_core.errors import FileContentError
from fisheye_core.plain_yaml import parse_mapping


@pytest.mark.parametrize(
    ('text', 'value'),
    [
        ('12', 12),
        ('-0', 0),
        ('1e-05', 1e-05),
        ('1e5', 1e5),
        ('2.2e2', 220.0),
        ('1.', 1.0),
        ('.5', 0.5),
        ('+1.5E+3', 1500.0),
        ('-.inf', -math.inf),
        ('1e400', math.inf),
        ('9' * 400, math.inf),
        ('true', True),
        ('~', None),
        ('', None),
        ('yes', 'yes'),
        ('0123', '0123'),
        ('0x1f', '0x1f'),
        ('1_000', '1_000'),
        ('12:30', '12:30'),
        ('2026-01-01', '2026-01-01'),
        ('"1e5"', '1e5'),
        ("'true'", 'true'),
        ('"hi \\U00000041"', 'hi A'),
        ('[1, -2.5, left]', [1, -2.5, 'left']),
        ('[1,\t2\t, 3]', [1, 2, 3]),
        ('\tleft\t# a tab before and behind', 'left'),
        ('{b: {c: 1}}', {'b': {'c': 1}}),
        ('&x [1, 2]\nb: *x', [1, 2]),
        ('!!opencv-matrix\n  rows: 1', {'rows': 1}),
        ('1\n---\na: 2\n---\na: !!bool x', 1),
        ('1\n...\n', 1),
        ('1\n\t\n# an empty line of a tab', 1),
    ],
)
def test_what_is_written_is_meant(text, value):
    result = parse_mapping(f'a: {text}')['a']
    assert result == value
    assert type(result) is type(value) or isinstance(value, dict)


def test_keys_are_texts_and_lines_are_known():
    mapping = parse_mapping('%YAML:1.0\n---\n1: a\ntrue: 1.50\nc: []\n')
    assert mapping == {'1': 'a', 'true': 1.5, 'c': []}
    assert mapping.lines == {'1': 3, 'true': 4, 'c': 5}
    assert mapping.texts == {'1': 'a', 'true': '1.50'}


@pytest.mark.parametrize(
    ('text', 'words'),
    [
        ('found: !!bool maybe', 'line 1: it has the tag .!!bool'),
        ('a: 1\n!!timestamp b: 2', 'line 2: it has the tag .!!timestamp'),
        ('a: !!int ""', 'the tag .!!int'),
        ('a: !!python/object/apply:os.system [x]', r'the tag .!!python/object/apply'),
        ('a: "\\UFFFFFFFF"', 'not valid YAML'),
        ('a: "\\ud800"', 'not valid YAML'),
        ('a: ' + '[' * 20_000, 'line 1: it is more than 20 levels deep'),
        ('a:\n  ' + '- ' * 20_000, 'line 2: it is more than 20 levels deep'),
        ('a: [1, *b]', 'line 1: it refers to `&b`, which is not defined before'),
        ('a: &a [*a]', 'line 1: it refers to `&a`, which'),
        ('a: 1\nb:\n\tc: 1', 'at line 3: a tab indents the line; expected spaces'),
        ('? [1]\n: 2', 'line 1: a key is not plain text'),
        ('', 'it is empty'),
        ('# nothing', 'it is empty'),
        ('- 1', 'it holds a list'),
        ('just text', 'it holds a single value'),
        ('a: 1\n]', 'not valid YAML at line 2'),
    ],
)
def test_what_is_not_plain_is_refused(text, words):
    with pytest.raises(FileContentError, match=words):
        parse_mapping(text)


def test_aliases_cannot_blow_up():
    lines = ['a0: &a0 [x, x, x, x, x, x, x, x, x]']
    lines += [f'a{n}: &a{n} [{", ".join([f"*a{n - 1}"] * 9)}]' for n in range(1, 9)]
    with pytest.raises(FileContentError, match='aliases repeat too much'):
        parse_mapping('\n'.join(lines))
    with pytest.raises(FileContentError, match='aliases repeat too much'):
        parse_mapping(f'a: &a {"x" * 50_000}\nb: [{"*a," * 9}]')
