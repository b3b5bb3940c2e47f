"""Running a node as a process: start, spin, and end without a traceback."""

import os
import threading
import traceback

import rclpy
from rclpy.exceptions import ParameterException
from rclpy.executors import (
    ExternalShutdownException,
    MultiThreadedExecutor,
    SingleThreadedExecutor,
)
from rclpy.logging import get_logger
from rclpy.node import Node

from fisheye_geometry.errors import FisheyeError


def run(node_class: type[Node], *, threads: int = 1) -> int:
    """Run a node until SIGINT or SIGTERM.

    Parameters
    ----------
    node_class
        Built without arguments; a `FisheyeError` that it raises is logged.
    threads
        How many callbacks may run at once, if they are in groups that allow it.

    Returns
    -------
    int
        The exit code: 0, or 1 if the node could not start.
    """
    node = executor = None
    threading.excepthook = _give_up
    try:
        rclpy.init()
        node = node_class()
        executor = MultiThreadedExecutor(threads) if threads > 1 else SingleThreadedExecutor()
        executor.add_node(node)
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
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


def _give_up(arguments) -> None:
    """End the process when one of its threads dies of a bug: a frozen picture would look alive."""
    text = ''.join(traceback.format_exception(arguments.exc_value))
    get_logger('fisheye').fatal(f'the thread {arguments.thread.name} died:\n{text}')
    os._exit(1)
