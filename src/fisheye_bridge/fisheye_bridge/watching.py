"""Nodes of commands of the shell, which watch topics until they have seen enough."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic
from typing import Any, TypeVar

import rclpy
from rclpy.exceptions import InvalidTopicNameException, ParameterException
from rclpy.node import Node

from fisheye_bridge.running import begin
from fisheye_core.errors import SettingError

_Node = TypeVar('_Node', bound=Node)

_LONGEST_WAIT_S = 0.2
"""A condition is looked at so often, and a signal noticed."""


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
        If the name of a topic is not possible, or as of `started`.
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


@contextmanager
def started(node_class: type[_Node], *arguments: Any) -> Iterator[_Node]:
    """Lend a node to a command, which spins it itself and is ended by a KeyboardInterrupt.

    Parameters
    ----------
    node_class, *arguments
        What to build, of what.

    Raises
    ------
    SettingError
        If the environment or a parameter of ROS does not let it start.
    """
    node = None
    try:
        try:
            begin(node_class)
            node = node_class(*arguments)
        except (ParameterException, rclpy._rclpy_pybind11.RCLError) as error:
            raise SettingError(str(error)) from error
        yield node
    finally:
        if node:
            node.destroy_node()
        rclpy.try_shutdown()


def spin_until(node: Node, condition: Callable[[], bool], timeout_s: float) -> bool:
    """Spin until a condition holds; tell whether it did within `timeout_s`."""
    deadline_s = monotonic() + timeout_s
    while not condition():
        if monotonic() > deadline_s:
            return False
        rclpy.spin_once(node, timeout_sec=_LONGEST_WAIT_S)
    return True
