"""Settings: dataclass fields that know their meaning, range and choices.

One frozen dataclass a node is the only home of its parameters: the nodes declare them from it, the
command lines and the documentation read it. A field's name is the parameter's name and carries
its unit.
"""

from dataclasses import MISSING, dataclass, field, fields
from math import isfinite, isnan, nan
from typing import Any, get_args, get_origin, get_type_hints

from fisheye_core.errors import SettingError


@dataclass(frozen=True)
class Rule:
    """What a setting means and which values it takes."""

    help: str
    minimum: float | None = None
    maximum: float | None = None
    choices: tuple[str, ...] = ()
    live: bool = False
    """Whether a change applies while the node runs."""
    nan: bool = False
    """Whether NaN is a value, with the meaning that `help` gives."""
    empty: bool = False
    """Whether a list may have nothing in it."""


def setting(default: Any, help: str, **rule: Any) -> Any:
    """Declare a field of a settings dataclass; `rule` as in `Rule`."""
    if isinstance(default, list):
        raise TypeError('a default must not be mutable: use a tuple')
    return field(default=default, metadata={'rule': Rule(help, empty=default == (), **rule)})


def rules(settings: type) -> dict[str, tuple[type, Any, Rule]]:
    """Return type, default and rule of each setting of a dataclass, in order."""
    types = get_type_hints(settings)
    return {
        entry.name: (types[entry.name], entry.default, entry.metadata['rule'])
        for entry in fields(settings)
        if entry.default is not MISSING and 'rule' in entry.metadata
    }


def convert(name: str, value: Any, kind: type, rule: Rule) -> Any:
    """Turn a value that a user gave into the setting's type, and check it.

    What can be meant only one way is taken: a whole number for a float or a string, one value
    where a list is expected, the word that `ros2 param load` makes of NaN.

    Raises
    ------
    SettingError
        Naming the setting, the value and what was expected.
    """
    if get_origin(kind) is tuple:
        (item, _) = get_args(kind)
        values = value if isinstance(value, (list, tuple)) or hasattr(value, 'tolist') else [value]
        if not len(values) and not rule.empty:
            raise SettingError(f'{name} is empty; expected at least one value')
        return tuple(convert(name, one, item, rule) for one in values)
    if kind is float and value in _NAN_WORDS:
        value = nan
    whole = isinstance(value, int) and not isinstance(value, bool)
    if kind is float and (whole or isinstance(value, float)):
        return _within(name, float(value), rule)
    if kind is int and (whole or (isinstance(value, float) and value.is_integer())):
        return _within(name, int(value), rule)
    if kind is bool and isinstance(value, bool):
        return value
    if kind is str and (whole or isinstance(value, str)):
        return _chosen(name, str(value), rule)
    raise SettingError(f'{name} is {value!r}; expected {_TYPE_NAMES[kind]}')


_NAN_WORDS = 'nan', '.nan', 'NaN', '.NaN'
_TYPE_NAMES = {float: 'a number', int: 'a whole number', bool: 'true or false', str: 'text'}


def _within(name: str, value: float, rule: Rule) -> float:
    if isnan(value) and rule.nan:
        return value
    low = rule.minimum is None or value >= rule.minimum
    high = rule.maximum is None or value <= rule.maximum
    if low and high and isfinite(value):
        return value
    raise SettingError(f'{name} is {value:g}; expected {describe_range(rule)}')


def describe_range(rule: Rule) -> str:
    """Describe the values that a rule allows; '' for any."""
    nan = ' or NaN' if rule.nan else ''
    if rule.choices:
        return 'one of ' + ', '.join(rule.choices)
    if rule.minimum is not None and rule.maximum is not None:
        return f'{rule.minimum:g} to {rule.maximum:g}{nan}'
    if rule.minimum is not None:
        return f'at least {rule.minimum:g}{nan}'
    if rule.maximum is not None:
        return f'at most {rule.maximum:g}{nan}'
    return f'a finite number{nan}' if rule.nan else ''


def _chosen(name: str, value: str, rule: Rule) -> str:
    if rule.choices and value not in rule.choices:
        raise SettingError(f"{name} is '{value}'; expected {describe_range(rule)}")
    return value
