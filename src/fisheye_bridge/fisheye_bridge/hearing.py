"""Whether a node hears the others: a process that is started again may stay deaf.

Another process that touches the shared memory of a killed one in the wrong moment can keep its
successor from opening it. The successor then sees the others, and nothing from them arrives.
"""

from collections.abc import Callable
from math import inf
from time import monotonic

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.node import Node

from fisheye_bridge.network import LEASE_S

TOPIC = '/diagnostics'
DEAF_S = 6.0
"""Within this time several reports of each node are due."""
GONE_S = LEASE_S + 2.0
"""One that was killed before its first report can be seen so long."""
_LOOK_S = 0.5
_DEPTH = 10
_ENDLESS_S = 1e6
_NAMELESS = '_NODE_NAME_UNKNOWN_'
"""What rcl calls a node that it has not been told of, or that was killed before."""


class Hearing:
    """Listens for the reports of each other node, as one may be deaf to a single one of them.

    Only publishers that promise a report by their deadline count: those of our nodes.
    """

    def __init__(self, node: Node, now_s: Callable[[], float] = monotonic):
        self._node, self._now_s = node, now_s
        self._name = node.get_fully_qualified_name()
        self._since_s: dict[bytes, float] = {}
        self._heard_s: dict[str, float] = {}
        self._due_s, self._silence = 0.0, ''
        node.create_subscription(DiagnosticArray, TOPIC, self._take, _DEPTH)

    def silence(self) -> str:
        """Return who can be seen, for some seconds, and was not heard; '' if all is well."""
        now_s = self._now_s()
        if now_s >= self._due_s:
            self._due_s = now_s + _LOOK_S
            self._silence = self._looked(now_s)
        return self._silence

    @property
    def is_well(self) -> bool:
        """Whether all others that can be seen for some seconds are heard."""
        now_s = self._now_s()
        return not self._silence and any(
            now_s - since > DEAF_S for since in self._since_s.values()
        )

    def _looked(self, now_s: float) -> str:
        others = {bytes(end.endpoint_gid): _name(end) for end in self._others()}
        self._since_s = {gid: self._since_s.get(gid, now_s) for gid in others}
        hears_any = max(self._heard_s.values(), default=-inf) > now_s - DEAF_S
        longest_s = GONE_S if hears_any else DEAF_S
        silent = {
            others[gid]
            for gid, since_s in self._since_s.items()
            if now_s - since_s > longest_s and self._heard_at_s(others[gid]) < since_s
        }
        names = ', '.join(sorted(name.lstrip('/') for name in silent))
        return f'{names} can be seen, but nothing comes from there' if names else ''

    def _heard_at_s(self, name: str) -> float:
        """Return when a node was last heard; one without a name yet may be any of those heard."""
        if name.endswith(_NAMELESS):
            return max(self._heard_s.values(), default=-inf)
        return self._heard_s.get(name, -inf)

    def _others(self) -> list:
        """Return who else promises reports."""
        return [
            end
            for end in self._node.get_publishers_info_by_topic(TOPIC)
            if end.qos_profile.deadline.nanoseconds < _ENDLESS_S * 1e9 and _name(end) != self._name
        ]

    def _take(self, message: DiagnosticArray) -> None:
        names = {status.hardware_id for status in message.status} - {self._name}
        self._heard_s.update(dict.fromkeys(names, self._now_s()))


def hearing_of(node: Node) -> Hearing:
    """Return what listens for a node: one for all who ask."""
    return vars(node).get('_hearing') or vars(node).setdefault('_hearing', Hearing(node))


def _name(end) -> str:
    return f'{end.node_namespace.rstrip("/")}/{end.node_name}'
