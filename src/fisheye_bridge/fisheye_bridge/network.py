"""The network under a node: links that come up late, change their address or are replaced.

Fast DDS looks at the interfaces once, when the first node of a context is made, and announces the
addresses that it found. What comes up later is used only when it is told to look again; an address
that has gone is still where the others send to. It also tells by its addresses which machine it is
on, once in a process: without any, all machines look like the same one. So after the first address
has come, or another one in the place of one, a node needs a context made anew.
"""

import ctypes
import fcntl
import os
import socket
import struct
from collections.abc import Callable
from contextlib import suppress
from time import monotonic

from rclpy.node import Node

from fisheye_bridge.shared_memory import is_fast_dds

LEASE_S = 20.0
"""So long Fast DDS takes a process that says nothing for alive, and an address for its own."""
_LOOK_S = 0.2
_GET_FLAGS, _GET_ADDRESS = 0x8913, 0x8915
"""ioctls of netdevice(7)."""
_LOOPBACK, _RUNNING = 0x8, 0x40
_NAME_BYTES, _REQUEST_BYTES = 16, 40


def addresses() -> set[str]:
    """Return the IPv4 addresses at which other machines can reach this one now."""
    found = set()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asked:
        for _, name in socket.if_nameindex():
            request = name.encode().ljust(_REQUEST_BYTES, b'\0')
            try:
                reply = fcntl.ioctl(asked, _GET_FLAGS, request)
                (flags,) = struct.unpack_from('H', reply, _NAME_BYTES)
                if flags & _RUNNING and not flags & _LOOPBACK:
                    reply = fcntl.ioctl(asked, _GET_ADDRESS, request)
                    found.add(socket.inet_ntoa(reply[_NAME_BYTES + 4 : _NAME_BYTES + 8]))
            except OSError:
                continue  # it has no address, or has just gone
    return found


def is_local_only() -> bool:
    """Return whether the environment keeps discovery on this machine."""
    reach = os.environ.get('ROS_AUTOMATIC_DISCOVERY_RANGE', '').upper()
    if reach == 'OFF' or os.environ.get('ROS_LOCALHOST_ONLY') == '1':
        return True
    # Static peers are reached all the same.
    return reach == 'LOCALHOST' and not os.environ.get('ROS_STATIC_PEERS')


class Links:
    """Watches the addresses of this machine for a process with one node.

    Parameters
    ----------
    look
        Returns the addresses there are now.
    now_s
        The clock.
    """

    def __init__(
        self, look: Callable[[], set[str]] = addresses, now_s: Callable[[], float] = monotonic
    ):
        self._look, self._now_s = look, now_s
        self._seen_s = dict.fromkeys(look(), now_s())
        self._due_s = now_s() + _LOOK_S
        self._is_off = is_local_only()

    def changed(self, tell: Callable[[], bool]) -> str:
        """Notice what has changed, at most five times a second.

        Parameters
        ----------
        tell
            Has the middleware look at the interfaces; returns whether it can.

        Returns
        -------
        str
            Why the context has to be made anew; '' if it has not.
        """
        now_s = self._now_s()
        if self._is_off or now_s < self._due_s:
            return ''
        self._due_s = now_s + _LOOK_S
        found, known = self._look(), set(self._seen_s)
        added, gone = found - known, known - found
        # One that only went may come back, as where a cable is pulled and plugged in again.
        if added and (not tell() or gone or not known):
            former = f' in place of {_listed(gone)}' if gone else ''
            return f'this machine is now reached at {_listed(added)}{former}'
        if found & known:
            for address in gone:
                if now_s - self._seen_s[address] > LEASE_S:
                    del self._seen_s[address]
        self._seen_s.update(dict.fromkeys(found, now_s))
        return ''


def refresher(node: Node) -> Callable[[], bool]:
    """Return what has Fast DDS look at the interfaces anew; it returns whether it did.

    A participant whose QoS is set again looks (`DomainParticipant::set_qos` of Fast DDS 2.x). That
    is no part of rcl; where another middleware or version runs, it returns False.
    """
    if not is_fast_dds():
        return lambda: False
    try:
        handle_of = _function('librcl.so', 'rcl_node_get_rmw_handle', 1)
        participant_of = _function('librmw_fastrtps_cpp.so', _PARTICIPANT, 1)
        qos_of = _function('librmw_fastrtps_cpp.so', _GET_QOS, 1)
        set_qos = _function('librmw_fastrtps_cpp.so', _SET_QOS, 2)
    except (OSError, AttributeError):
        return lambda: False

    def refresh() -> bool:
        with node.handle:
            participant = participant_of(handle_of(node.handle.pointer))
            if not participant:
                return False
            set_qos(participant, qos_of(participant))
        return True

    return refresh


def forget_machine() -> None:
    """Reset what Fast DDS knows of this machine; to be called while no context is up."""
    with suppress(OSError, ValueError):
        # The guard of the static variable in eprosima::Host::instance().
        ctypes.c_int64.in_dll(ctypes.CDLL('librmw_fastrtps_cpp.so'), _HOST_GUARD).value = 0


_PARTICIPANT = '_ZN16rmw_fastrtps_cpp22get_domain_participantEP10rmw_node_s'
_HOST_GUARD = '_ZGVZN8eprosima4Host8instanceEvE9singleton'
_GET_QOS = '_ZNK8eprosima7fastdds3dds17DomainParticipant7get_qosEv'
_SET_QOS = '_ZNK8eprosima7fastdds3dds17DomainParticipant7set_qosERKNS1_20DomainParticipantQosE'
"""The names of the C++ functions as the linker knows them."""


def _function(library: str, name: str, arguments: int):
    """Return a function of pointers that returns a pointer."""
    function = getattr(ctypes.CDLL(library), name)
    function.restype = ctypes.c_void_p
    function.argtypes = [ctypes.c_void_p] * arguments
    return function


def _listed(found: set[str]) -> str:
    return ', '.join(sorted(found))
