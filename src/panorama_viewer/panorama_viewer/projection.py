"""A projection in JSON: the fields of fisheye_msgs/Projection under their own names."""

from collections import deque
from typing import Any, Generic, TypeVar

from fisheye_geometry.surface import Surface

Quaternion = tuple[float, float, float, float]
"""x, y, z, w: takes rays of a panorama to level rays."""
_LEVEL_W = 1 - 1e-9
_KEPT = 100
_State = TypeVar('_State')


def described(
    surface: Surface, wraps: bool = False, orientation: Quaternion | None = None
) -> dict[str, Any]:
    """Return what JSON holds of a panorama's surface, whether its edges meet, and its level."""
    level = {'orientation': dict(zip('xyzw', orientation, strict=True))} if orientation else {}
    return {
        'surface': surface.kind,
        'width': surface.width,
        'height': surface.height,
        'focal_px': surface.focal_px,
        'center_x_px': surface.center_x_px,
        'center_y_px': surface.center_y_px,
        'wraps': wraps,
        **level,
    }


def turned(x: float, y: float, z: float, w: float) -> Quaternion | None:
    """Return an orientation; None for that of a panorama that is level already, and for none."""
    length = (x * x + y * y + z * z + w * w) ** 0.5
    if not 0.9 < length < 1.1 or abs(w) / length > _LEVEL_W:
        return None
    return x / length, y / length, z / length, w / length


class StateHistory(Generic[_State]):
    """What held from which stamp on; one that is told again and again belongs to one picture."""

    def __init__(self) -> None:
        self._states: deque[tuple[int, _State]] = deque(maxlen=_KEPT)

    def add(self, stamp_ns: int, state: _State) -> None:
        """Add what holds from a stamp on."""
        self._states.append((stamp_ns, state))

    def at(self, stamp_ns: int) -> _State | None:
        """Return what held at a stamp: the last that began by then, or at least the newest."""
        for begin_ns, state in reversed(self._states):
            if begin_ns <= stamp_ns:
                return state
        return self._states[-1][1] if self._states else None
