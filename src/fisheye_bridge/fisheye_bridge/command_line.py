"""The words with which a node or a command is started."""

import sys
from textwrap import wrap
from typing import Any

from rclpy.node import Node
from rclpy.utilities import remove_ros_args

from fisheye_core.errors import SettingError
from fisheye_core.settings import Rule, describe_range, rules


def own_words() -> list[str]:
    """Return the arguments that are not for ROS.

    Raises
    ------
    SettingError
        If those for ROS cannot be understood.
    """
    try:
        return remove_ros_args(sys.argv)[1:]
    except RuntimeError as error:
        raise SettingError(f'what follows --ros-args cannot be understood: {error}') from error


def refuse_words() -> None:
    """Refuse words that are not for ROS: a node takes none."""
    if words := own_words():
        raise SettingError(
            f"'{' '.join(words)}' has no meaning here; expected --ros-args -p NAME:=VALUE"
        )


def usage(node_class: type[Node]) -> str:
    """Return how to start a node and its parameters, '' if nobody asked for that.

    Parameters
    ----------
    node_class
        Its `SETTINGS`, if it has any, are pairs of a prefix and a settings dataclass.
    """
    if not {'-h', '--help'} & set(sys.argv):
        return ''
    name = node_class.__module__.rpartition('.')[2]
    parameters = [
        _described(prefix + setting, *entry)
        for prefix, settings in getattr(node_class, 'SETTINGS', ())
        for setting, entry in rules(settings).items()
    ]
    return '\n'.join(
        [
            f'usage: {name} [--ros-args [-p NAME:=VALUE] ...]\n\n{node_class.__doc__}\n',
            'parameters [default] (those with * can be changed while the node runs):',
            *parameters,
            f'\ndocs/{name.removesuffix("_node")}.md says more.',
        ]
    )


def _described(name: str, kind: type, default: Any, rule: Rule) -> str:
    values = describe_range(rule)
    head = f'  {name}{"*" if rule.live else ""} [{_text(default)}]{values and f": {values}"}'
    meaning = wrap(rule.help, 92, initial_indent=_INDENT, subsequent_indent=_INDENT)
    return '\n'.join([head, *meaning])


def _text(default: Any) -> str:
    if isinstance(default, tuple):
        return '[' + ', '.join(map(_text, default)) + ']'
    return str(default).lower() if isinstance(default, bool) else str(default)


_INDENT = ' ' * 6
