"""Running a node as a process: start, spin, and end without a traceback."""

import os
import signal
import sys
import threading
import traceback

import rclpy
from rclpy.exceptions import ParameterException
from rclpy.executors import SingleThreadedExecutor
from rclpy.logging import get_logger
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions

from fisheye_bridge import shared_memory
from fisheye_bridge.command_line import refuse_words, usage
from fisheye_bridge.hearing import hearing_of
from fisheye_bridge.network import Links, forget_machine, refresher
from fisheye_bridge.parameters import misspelt
from fisheye_bridge.watchdog import Watchdog
from fisheye_core import quiet_jpeg
from fisheye_core.errors import FisheyeError

_SWITCH_S = 0.0005
"""A thread that measures in the background leaves Python's lock to the frames so often."""
_LONGEST_WAIT_S = 0.2
"""A signal is noticed after so long at the latest."""
_LONGEST_END_S = 1.2
"""What is still in work so long after it, as a calibration, is left undone."""
_TRIES = 3
"""So often at most a node that hears nobody connects anew."""

_BOUND = 'FISHEYE_ENDS_WITH_PARENT'
"""Set where whoever started this process may end without telling it, as launch does at SIGTERM."""


def run(node_class: type[Node]) -> int:
    """Run a node until SIGINT or SIGTERM.

    Parameters
    ----------
    node_class
        Built without arguments; a `FisheyeError` that it raises is logged. Where it has to connect
        anew another one is built with the same parameters, and given the former one, ended, as
        the argument of its method `inherit` if it has that.

    Returns
    -------
    int
        The exit code: 0, or 1 if the node could not start.
    """
    if text := usage(node_class):
        print(text)
        return 0
    threading.excepthook = _give_up
    return _Process(node_class).run()


class _Process:
    """A node from its start to its end; connected anew where the others cannot reach it."""

    def __init__(self, node_class: type[Node]):
        self._node_class = node_class
        self._node: Node | None = None
        self._former: Node | None = None
        self._parameters: list[Parameter] = []
        self._tries = 0
        self._watchdog = Watchdog()
        self._ports = shared_memory.OwnPorts()
        self._parent = os.getppid() if os.environ.get(_BOUND) == '1' else None
        self._ended = threading.Event()
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._end)

    def run(self) -> int:
        """Return the exit code."""
        sys.setswitchinterval(_SWITCH_S)
        try:
            refuse_words()
            while not self._ended.is_set():
                self._live()
        except KeyboardInterrupt:
            pass
        except (FisheyeError, ParameterException, rclpy._rclpy_pybind11.RCLError) as error:
            _logger(self._node_class).fatal(str(error))
            return 1
        finally:
            rclpy.try_shutdown()
            self._watchdog.stop()
        return 0

    def _live(self) -> None:
        """Spin a node until the end, or until it has to connect anew."""
        executor = None
        bad_ports: set[str] = set()
        links = Links()
        self._watchdog.feed()
        begin(self._node_class)
        try:
            self._node = node = self._built()
            executor = SingleThreadedExecutor()
            executor.add_node(node)
            refresh, hearing = refresher(node), hearing_of(node)
            while not self._ended.is_set():
                executor.spin_once(timeout_sec=_LONGEST_WAIT_S)
                self._watchdog.feed()
                if self._parent not in (None, os.getppid()):
                    node.get_logger().info('ending, as the process that started this node did')
                    self._end()
                reason = links.changed(refresh)
                if (
                    not reason
                    and self._tries < _TRIES
                    and (reason := hearing.silence() or self._ports.lost())
                ):
                    self._tries += 1
                    bad_ports = self._ports.locks()
                if reason:
                    node.get_logger().warning(f'{reason}: connecting anew')
                    break
                if self._tries and hearing.is_well:
                    self._tries = 0
        finally:
            self._watchdog.ending()
            if executor:
                executor.shutdown()
            if self._node:
                names = self._node.get_parameters_by_prefix('')
                self._parameters = self._node.get_parameters(list(names))
                self._node.destroy_node()
                self._node, self._former = None, self._node
            rclpy.try_shutdown()
            forget_machine()
            self._ports.avoid(bad_ports)

    def _built(self) -> Node:
        """Build the node, with the parameters that it had before and what it has found out."""
        if self._former:
            node = self._node_class(parameter_overrides=self._parameters)
            if inherit := getattr(node, 'inherit', None):
                inherit(self._former)
            self._former = None
            return node
        node = self._node_class()
        if complaint := misspelt(node):
            node.get_logger().warning(complaint)
        return node

    def _end(self, *_) -> None:
        if self._ended.is_set():
            return
        self._ended.set()
        guard = threading.Timer(_LONGEST_END_S, os._exit, (0,))
        guard.daemon = True
        guard.start()
        if self._node is None:
            raise KeyboardInterrupt  # it may take seconds until a node is built


def _logger(node_class: type[Node]):
    """Return a logger with the name of a node that could not be made."""
    name = node_class.__module__.rpartition('.')[2].removesuffix('_node')
    try:
        rclpy.try_shutdown()
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
        nameless = Node(name, start_parameter_services=False, enable_rosout=False)
    except (rclpy._rclpy_pybind11.RCLError, RuntimeError, ValueError):
        return get_logger(name)
    return nameless.get_logger()


def begin(node_class: type[Node]) -> None:
    """Start the middleware for a node, in the order in which its steps must come."""
    complaint = shared_memory.prepare()
    # rclpy's own handlers would end the context while threads of the node still publish.
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    if complaint:
        get_logger(node_class.__name__).warning(complaint)


def _give_up(arguments) -> None:
    """End the process when one of its threads dies of a bug: a frozen picture would look alive."""
    quiet_jpeg.stop()  # what is said now would be lost
    text = ''.join(traceback.format_exception(arguments.exc_value))
    get_logger('fisheye').fatal(f'the thread {arguments.thread.name} died:\n{text}')
    os._exit(1)
