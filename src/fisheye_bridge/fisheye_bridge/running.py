"""Running a node as a process: start, spin, and end without a traceback."""

import os
import signal
import threading
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic
from typing import Any, TypeVar

import rclpy
from rclpy.exceptions import ParameterException
from rclpy.executors import SingleThreadedExecutor
from rclpy.logging import get_logger
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from fisheye_bridge import shared_memory
from fisheye_bridge.command_line import refuse_words, usage
from fisheye_bridge.parameters import misspelt
from fisheye_geometry.errors import FisheyeError

_Node = TypeVar('_Node', bound=Node)

_LONGEST_WAIT_S = 0.2
"""A signal is noticed after so long at the latest."""
_LONGEST_END_S = 1.2
"""What is still in work so long after it, as a calibration, is left undone."""


def run(node_class: type[Node]) -> int:
    """Run a node until SIGINT or SIGTERM.

    Parameters
    ----------
    node_class
        Built without arguments; a `FisheyeError` that it raises is logged.

    Returns
    -------
    int
        The exit code: 0, or 1 if the node could not start.
    """
    if text := usage(node_class):
        print(text)
        return 0
    node = executor = None
    threading.excepthook = _give_up
    ended = threading.Event()

    def end(*_):
        if ended.is_set():
            return
        ended.set()
        guard = threading.Timer(_LONGEST_END_S, os._exit, (0,))
        guard.daemon = True
        guard.start()
        if node is None:
            raise KeyboardInterrupt  # it may take seconds until a node is built

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, end)
    try:
        refuse_words()
        _init(node_class)
        node = node_class()
        if complaint := misspelt(node):
            node.get_logger().warning(complaint)
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        while not ended.is_set():
            executor.spin_once(timeout_sec=_LONGEST_WAIT_S)
    except KeyboardInterrupt:
        pass
    except (FisheyeError, ParameterException, rclpy._rclpy_pybind11.RCLError) as error:
        get_logger(node_class.__name__).fatal(str(error))
        return 1
    finally:
        if executor:
            executor.shutdown()
        if node:
            node.destroy_node()
        rclpy.try_shutdown()
    return 0


@contextmanager
def started(node_class: type[_Node], *arguments: Any) -> Iterator[_Node]:
    """Give a node to a command, which spins it itself and is ended by a KeyboardInterrupt.

    Parameters
    ----------
    node_class, *arguments
        What to build, of what.
    """
    node = None
    try:
        _init(node_class)
        node = node_class(*arguments)
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


def _init(node_class: type[Node]) -> None:
    """Make the first steps, in the order in which they must come."""
    complaint = shared_memory.prepare()
    # rclpy's own handlers would end the context while threads of the node still publish.
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    if complaint:
        get_logger(node_class.__name__).warning(complaint)


def _give_up(arguments) -> None:
    """End the process when one of its threads dies of a bug: a frozen picture would look alive."""
    text = ''.join(traceback.format_exception(arguments.exc_value))
    get_logger('fisheye').fatal(f'the thread {arguments.thread.name} died:\n{text}')
    os._exit(1)
