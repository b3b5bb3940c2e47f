"""Settings: what a user gives is understood or refused by name."""

from dataclasses import dataclass
from math import isnan, nan

import pytest

from fisheye_core.errors import SettingError
from fisheye_core.settings import convert, describe_range, rules, setting


@dataclass(frozen=True)
class SampleSettings:
    """One setting of each type."""

    rate_hz: float = setting(30.0, 'rate', minimum=0.1, maximum=1000.0)
    count: int = setting(1, 'count', minimum=0)
    source: str = setting('synthetic', 'source')
    blend: str = setting('feather', 'blend', choices=('none', 'feather'), live=True)
    loop: bool = setting(True, 'loop')
    offset_px: tuple[float, ...] = setting((nan,), 'offset', nan=True)


def given(name, value):
    kind, _, rule = rules(SampleSettings)[name]
    return convert(name, value, kind, rule)


@pytest.mark.parametrize(
    ('name', 'value', 'taken'),
    [
        ('rate_hz', 15, 15.0),
        ('rate_hz', 0.1, 0.1),
        ('count', 2.0, 2),
        ('source', 0, '0'),
        ('blend', 'none', 'none'),
        ('loop', False, False),
        ('offset_px', 545, (545.0,)),
        ('offset_px', [1, 2.5], (1.0, 2.5)),
    ],
)
def test_what_can_be_meant_only_one_way_is_taken(name, value, taken):
    result = given(name, value)
    assert result == taken
    assert type(result) is type(taken)


def test_nan_is_a_value_only_where_it_means_something():
    assert isnan(given('offset_px', [nan])[0])
    with pytest.raises(SettingError, match='rate_hz is nan; expected 0'):
        given('rate_hz', nan)


@pytest.mark.parametrize(
    ('name', 'value', 'words'),
    [
        ('rate_hz', 2000, 'rate_hz is 2000; expected 0.1 to 1000'),
        ('rate_hz', 'fast', "rate_hz is 'fast'; expected a number"),
        ('rate_hz', True, 'rate_hz is True; expected a number'),
        ('count', -1, 'count is -1; expected at least 0'),
        ('count', 1.5, 'count is 1.5; expected a whole number'),
        ('blend', 'soft', "blend is 'soft'; expected one of none, feather"),
        ('loop', 1, 'loop is 1; expected true or false'),
        ('source', None, 'source is None; expected text'),
        ('offset_px', ['x'], "offset_px is 'x'; expected a number"),
    ],
)
def test_anything_else_is_refused_by_name(name, value, words):
    with pytest.raises(SettingError, match=words):
        given(name, value)


def test_ranges_in_words():
    words = {name: describe_range(rule) for name, (_, _, rule) in rules(SampleSettings).items()}
    assert words == {
        'rate_hz': '0.1 to 1000',
        'count': 'at least 0',
        'source': '',
        'blend': 'one of none, feather',
        'loop': '',
        'offset_px': 'a finite number or NaN',
    }
