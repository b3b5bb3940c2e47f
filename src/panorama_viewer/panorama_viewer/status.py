"""The state of the rig in plain words, for people who do not know its parts."""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from statistics import median
from typing import Any

_WINDOW_S = 2.0
"""What rate and delay are told of."""
_SILENT_AFTER_S = 3.0
"""Nodes report once a second."""
_FORGOTTEN_AFTER_S = 600.0
_ROLES = {
    'capture': '{} camera',
    'undistort': 'correction of the {} camera',
    'stitch': 'stitching',
    'panorama': 'stitching',
}
_ERROR = 2
"""As in diagnostic_msgs/DiagnosticStatus: 0 is well, 1 a warning."""


@dataclass(frozen=True)
class _Word:
    """What a node said last of itself."""

    heard_s: float
    level: int
    message: str
    values: dict[str, str]


class ViewerStatus:
    """Gathers what comes from the nodes; `told` is what the page shows of it.

    Times are those of one steady clock, s.
    """

    def __init__(self):
        self._pictures: deque[tuple[float, float]] = deque(maxlen=2000)
        self._words: dict[str, _Word] = {}

    def picture(self, now_s: float, delay_s: float) -> None:
        """Note a picture that came `delay_s` after it was taken."""
        self._pictures.append((now_s, delay_s))

    def heard(
        self, now_s: float, name: str, level: int, message: str, values: dict[str, str]
    ) -> None:
        """Note what a node reports of itself; `name` is its own, as `left/capture`."""
        if name.rpartition('/')[2] in _ROLES:
            self._words[name] = _Word(now_s, level, message, values)

    def told(self, now_s: float) -> dict[str, Any]:
        """Return rate (Hz), delay and skew (ms; None where not known), and what is wrong."""
        times, delays = self._recent(now_s)
        rate_hz = (len(times) - 1) / (times[-1] - times[0]) if len(times) > 1 else 0.0
        return {
            'rate_hz': round(rate_hz, 1),
            'delay_ms': round(median(delays) * 1e3) if delays else None,
            'skew_ms': self._skew_ms(),
            'problems': self._problems(now_s),
        }

    def _recent(self, now_s: float) -> tuple[list[float], list[float]]:
        while self._pictures and now_s - self._pictures[0][0] > _WINDOW_S:
            self._pictures.popleft()
        return [time for time, _ in self._pictures], [delay for _, delay in self._pictures]

    def _skew_ms(self) -> float | None:
        for word in self._words.values():
            try:
                skew_ms = float(word.values['skew median ms'])
            except (KeyError, ValueError):
                continue
            return skew_ms if isfinite(skew_ms) else None
        return None

    def _problems(self, now_s: float) -> list[dict[str, str]]:
        """List what is wrong, the worst first."""
        problems = []
        for name, word in sorted(self._words.items()):
            silent_s = now_s - word.heard_s
            who = plain(name)
            if silent_s > _FORGOTTEN_AFTER_S:
                del self._words[name]
            elif silent_s > _SILENT_AFTER_S:
                problems.append(('error', f'{who}: no sign of life for {silent_s:.0f} s'))
            elif word.level:
                level = 'error' if word.level >= _ERROR else 'warning'
                problems.append((level, f'{who}: {word.message}'))
        return [{'level': level, 'text': text} for level, text in sorted(problems)]


def plain(name: str) -> str:
    """Return a readable name for a node: 'Left camera' for 'left/capture'."""
    camera, _, role = name.rpartition('/')
    words = _ROLES[role].format(camera).replace('  ', ' ').strip()
    return words[:1].upper() + words[1:]


def measured(overlap: Mapping[str, Any]) -> str:
    """Describe what a calibration found for a pair of cameras."""
    pair = '{left} and {right}'.format(**overlap)
    if not overlap['found']:
        return f'{pair} show nothing in common'
    yaw_deg, near_deg, confidence = (
        overlap[name] for name in ('yaw_deg', 'near_deg', 'confidence')
    )
    apart = '' if yaw_deg is None else f', {yaw_deg:.1f}° apart'
    near = f', near things up to {near_deg:.1f}° beside far ones' if near_deg else ''
    known = 'not known' if confidence is None else f'{confidence:.2f}'
    return f'{pair} overlap{apart}{near} (confidence {known})'
