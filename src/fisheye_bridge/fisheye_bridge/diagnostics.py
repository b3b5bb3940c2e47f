"""The node's state on /diagnostics, once a second."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from fisheye_bridge.hearing import TOPIC, hearing_of
from fisheye_bridge.qos import HEARTBEAT
from fisheye_core.errors import FisheyeError

OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR
WARNING_PAUSE_S = 5.0
"""Between two warnings of the same kind in the log."""
_CONTAINERS = (
    '(nodes in several containers of one machine must share /dev/shm: docker run --ipc=host)'
)
_SHED_SHARE = 0.1
"""Of what comes; less is not worth a warning."""


@dataclass
class Report:
    """What a node says of itself: the worst level with the sentences that explain it."""

    level: bytes = OK
    reasons: list[str] = field(default_factory=list)
    values: dict[str, Any] = field(default_factory=dict)

    def add(self, level: bytes, reason: str) -> None:
        """Add a sentence; the level rises to its level."""
        self.level = max(self.level, level)
        self.reasons.append(reason)


class OverloadMonitor:
    """Warns while more comes than the machine handles."""

    def __init__(self, things: str):
        """Start; `things` are what is handled, or shed."""
        self._things = things
        self._former = 0, 0

    def tell(self, report: Report, handled: int, shed: int) -> None:
        """Warn if much was shed since the last report; the numbers count from the start."""
        former, self._former = self._former, (handled, shed)
        handled, shed = handled - former[0], shed - former[1]
        if shed > _SHED_SHARE * (handled + shed):
            report.add(
                WARN,
                f'{shed} of the last {handled + shed} {self._things} were shed: '
                'they come faster than this machine handles them',
            )


class DropCounter:
    """Counts what could not be used; says why, in the log and while there is more of it.

    Attributes
    ----------
    count : int
        Since the start.
    """

    def __init__(self, node: Node, what: str, key: str):
        """Start; `what` is dropped, `key` names the number in the report."""
        self.count = 0
        self._node, self._what, self._key = node, what, key
        self._sentence, self._told = '', 0

    def add(self, error: FisheyeError) -> None:
        """Count one more."""
        self.count += 1
        self._sentence = f'{self._what} was dropped: {error}'
        self._node.get_logger().warning(self._sentence, throttle_duration_sec=WARNING_PAUSE_S)

    def tell(self, report: Report) -> None:
        """Report the number, and warn if it has grown since the last report."""
        report.values[self._key] = self.count
        if self.count > self._told:
            report.add(WARN, self._sentence)
        self._told = self.count


class Diagnostics:
    """Publishes a node's report each second."""

    def __init__(self, node: Node, fill: Callable[[Report], None]):
        """Start; `fill` is called with an empty report each second."""
        self._node = node
        self._fill = fill
        self._publisher = node.create_publisher(DiagnosticArray, TOPIC, HEARTBEAT)
        self._hearing = hearing_of(node)
        # A node is heard while a recording, and with it the time of ROS, stands still.
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._timer = node.create_timer(1.0, self._publish, clock=steady)

    def _publish(self) -> None:
        report = Report()
        self._fill(report)
        if silence := self._hearing.silence():
            report.add(WARN, f'{silence} {_CONTAINERS}')
        name = self._node.get_fully_qualified_name()
        status = DiagnosticStatus(
            level=report.level,
            name=name.lstrip('/'),
            hardware_id=name,
            message='; '.join(report.reasons) or 'running',
            values=[KeyValue(key=key, value=_text(value)) for key, value in report.values.items()],
        )
        message = DiagnosticArray(status=[status])
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(message)


def _text(value: Any) -> str:
    return f'{value:.4g}' if isinstance(value, float) else str(value)
