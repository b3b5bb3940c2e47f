"""A panorama that is about to be drawn: frames that belong together and what draws them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fisheye_geometry.attitude import Attitude
from fisheye_geometry.surface import Surface
from panorama_stitch.compose.compositor import Compositor
from panorama_stitch.pipeline.stale import write_age


@dataclass(frozen=True, eq=False)
class Panorama:
    """Frames that belong together and what draws them.

    Attributes
    ----------
    compositor
        Draws them.
    images
        One of each camera, stale ones dimmed.
    stamp_ns
        When the oldest live one was taken.
    encoding
        Of the images and of the panorama.
    stale
        For each camera that is not live the columns [begin, end) that show it, and its age, s.
    stale_cameras
        Indices of these cameras.
    is_economical
        Whether there is no time for all that blends can do.
    orientation
        Takes rays of the panorama to level rays at that time; None where that does not change.
    """

    compositor: Compositor
    images: Sequence[np.ndarray]
    stamp_ns: int
    encoding: str
    stale: dict[str, tuple[tuple[int, int], float]]
    stale_cameras: frozenset[int] = frozenset()
    is_economical: bool = False
    orientation: Attitude | None = None

    @property
    def surface(self) -> Surface:
        """What the panorama shows."""
        return self.compositor.layout.surface

    def draw(self, out: np.ndarray) -> None:
        """Draw into `out`, (surface.height, surface.width[, 3]) uint8.

        Raises
        ------
        ImageFormatError
            If an image is not of the size that its camera is known to give.
        """
        self.compositor.compose(
            self.images, out, stale=self.stale_cameras, economical=self.is_economical
        )
        for camera, (columns, age_s) in self.stale.items():
            write_age(out, columns, camera, age_s)

    def expose(self) -> None:
        """Follow the brightness of the images, where the panorama itself is not drawn."""
        self.compositor.expose(self.images, self.stale_cameras)
