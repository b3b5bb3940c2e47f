"""Stamps as whole nanoseconds; any stamp that a message can hold, negative ones too."""

from builtin_interfaces.msg import Time

_NS_PER_S = 1_000_000_000


def ns_of(stamp: Time) -> int:
    """Convert a stamp to nanoseconds."""
    return stamp.sec * _NS_PER_S + stamp.nanosec


def stamp_of(stamp_ns: int) -> Time:
    """Convert nanoseconds to a stamp."""
    seconds, nanoseconds = divmod(stamp_ns, _NS_PER_S)
    return Time(sec=seconds, nanosec=nanoseconds)
