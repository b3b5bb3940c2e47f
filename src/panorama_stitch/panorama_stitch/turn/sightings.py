"""Where cameras saw landmarks while a robot turned."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np


@dataclass(frozen=True)
class Sightings:
    """Where cameras saw landmarks.

    Attributes
    ----------
    camera, frame, landmark
        (N,) int each.
    pixels
        (N, 2) float64, px.
    """

    camera: np.ndarray
    frame: np.ndarray
    landmark: np.ndarray
    pixels: np.ndarray

    def __len__(self) -> int:
        return len(self.camera)

    def only(self, chosen: np.ndarray) -> 'Sightings':
        """Return those that an index or a mask (N,) chooses."""
        return Sightings(
            self.camera[chosen], self.frame[chosen], self.landmark[chosen], self.pixels[chosen]
        )

    def and_(self, others: 'Sightings') -> 'Sightings':
        """Return these and others in one."""
        return Sightings(
            *(
                np.concatenate([getattr(self, name), getattr(others, name)])
                for name in ('camera', 'frame', 'landmark', 'pixels')
            )
        )

    def numbered(self) -> 'Sightings':
        """Return the same with landmarks numbered from 0 without gaps."""
        return replace(self, landmark=np.unique(self.landmark, return_inverse=True)[1].ravel())


def joined(rows: Sequence[tuple[int, int, np.ndarray, np.ndarray]]) -> Sightings:
    """Return the sightings of rows: a camera, a frame, landmarks (n,) and pixels (n, 2)."""
    counts = [len(row[2]) for row in rows]
    return Sightings(
        np.repeat([row[0] for row in rows], counts).astype(int),
        np.repeat([row[1] for row in rows], counts).astype(int),
        np.concatenate([row[2] for row in rows]).astype(int),
        np.concatenate([row[3] for row in rows]).astype(float),
    )
