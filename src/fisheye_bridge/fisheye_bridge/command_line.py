"""The words with which a node or a command is started."""

import sys

from rclpy.node import Node
from rclpy.utilities import remove_ros_args

from fisheye_geometry.errors import SettingError


def own_words() -> list[str]:
    """Give the words that are not for ROS.

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
    """Say how to start a node, '' if nobody asked for that."""
    if not {'-h', '--help'} & set(sys.argv):
        return ''
    name = node_class.__module__.rpartition('.')[2]
    return (
        f'usage: {name} [--ros-args [-p NAME:=VALUE] ...]\n\n{node_class.__doc__}\n\n'
        f'docs/{name.removesuffix("_node")}.md describes all parameters.'
    )
