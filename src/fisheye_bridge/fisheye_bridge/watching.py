"""Watching image topics for a command of the shell, until it has seen enough."""

import sys
from collections.abc import Callable
from typing import Any, TypeVar

from rclpy.exceptions import InvalidTopicNameException
from rclpy.node import Node

from fisheye_bridge.running import started
from fisheye_core.errors import SettingError

_Node = TypeVar('_Node', bound=Node)


def watch(see: Callable[[_Node], None], node_class: type[_Node], *arguments: Any) -> None:
    """Let a command see what comes, with its line of progress, until it returns or until Ctrl-C.

    What came until Ctrl-C is as good as what comes until the command has enough.

    Parameters
    ----------
    see
        Spins the node.
    node_class, *arguments
        What to build, of what.

    Raises
    ------
    SettingError
        If the name of a topic is not possible.
    """
    try:
        with started(node_class, *arguments) as node:
            see(node)
    except InvalidTopicNameException as error:
        reason, name, *_ = str(error).splitlines()
        reason = reason.removesuffix(':')
        raise SettingError(f'the topic {name.strip()} is not possible: {reason}') from error
    except KeyboardInterrupt:
        pass
    finally:
        print(file=sys.stderr)
