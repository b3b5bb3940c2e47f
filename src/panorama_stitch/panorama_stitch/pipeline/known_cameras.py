"""What each camera of a rig shows, as far as it is known."""

from collections.abc import Sequence
from dataclasses import dataclass
from threading import Lock

import numpy as np

from fisheye_core.errors import FisheyeError, ImageFormatError
from fisheye_geometry.lens import Lens
from fisheye_geometry.surface import Surface
from panorama_stitch.compose.mask import read_mask
from panorama_stitch.overlap.methods import CameraView

Images = Sequence[np.ndarray]
"""One image of each camera, taken at the same time."""


class KnownCameras:
    """What the images of each camera show, and where they show the robot itself.

    Attributes
    ----------
    cameras
        Names from left to right.
    faults
        For each camera what is wrong with what was said of it, a sentence.
    """

    def __init__(self, cameras: Sequence[str], mask_files: Sequence[str] = ()):
        """Start with nothing known.

        Parameters
        ----------
        cameras
            Names from left to right.
        mask_files
            Of each the image that is white where it sees the robot itself; '' for none, () for
            none of them.
        """
        self.cameras = tuple(cameras)
        self.faults: dict[str, str] = {}
        self.places: dict[int, CameraPlace] = {}
        self.bodies: list[np.ndarray | None] = [None] * len(self.cameras)
        self._mask_files = tuple(mask_files) or ('',) * len(self.cameras)
        self._lock = Lock()

    @property
    def is_complete(self) -> bool:
        """Whether it is known what every camera sees."""
        return len(self.places) == len(self.cameras)

    @property
    def surfaces(self) -> list[Surface]:
        """What the corrected images show, all with the focal length of the first."""
        return surfaces_of(self.places)

    @property
    def lens_focals_px(self) -> list[float]:
        """Focal length of what gives each camera's images, on whatever they are drawn."""
        sources = [place.source for _, place in sorted(self.places.items())]
        return [
            source.focal_px if isinstance(source, Surface) else source.focal_x_px
            for source in sources
        ]

    @property
    def camera_views(self) -> list[CameraView]:
        """What the images of each camera show."""
        return [
            CameraView(self.places[index].source, surface, self.bodies[index])
            for index, surface in enumerate(self.surfaces)
        ]

    def place(
        self, camera: str, source: Lens | Surface, surface: Surface, interpolation: str = 'linear'
    ) -> bool:
        """Set what a camera's images show; return whether that is news.

        Raises
        ------
        GeometryError
            If there is no surface with the focal length of the first camera; the former place
            stays.
        """
        index, place = self.cameras.index(camera), CameraPlace(source, surface, interpolation)
        if place == self.places.get(index):
            return False
        _with_one_focal({**self.places, index: place})
        with self._lock:
            self.places[index] = place
            self.bodies[index] = self._body(index, source)
        return True

    def has_camera(self, camera: str) -> bool:
        """Whether it is known what a camera sees."""
        return self.cameras.index(camera) in self.places

    def check(self, camera: str, image: np.ndarray) -> None:
        """Raise an `ImageFormatError` for an image of another size than the camera's."""
        place = self.places.get(self.cameras.index(camera))
        if place and image.shape[:2] != (place.source.height, place.source.width):
            raise ImageFormatError(
                f'the picture of {camera} has {image.shape[1]}x{image.shape[0]} px; '
                f'expected {place.source.width}x{place.source.height} px'
            )

    def black(self, camera: str, channels: tuple[int, ...]) -> np.ndarray:
        """Return an image for a camera that never gave one, (height, width, *channels) uint8."""
        source = self.places[self.cameras.index(camera)].source
        return np.zeros((source.height, source.width, *channels), np.uint8)

    def _body(self, index: int, source: Lens | Surface) -> np.ndarray | None:
        """Read where a camera sees the robot itself; None where that is not known."""
        camera, path = self.cameras[index], self._mask_files[index]
        self.faults.pop(camera, None)
        if not path:
            return None
        try:
            return read_mask(path, source.width, source.height)
        except FisheyeError as error:
            self.faults[camera] = f'{error}; nothing is masked'
            return None


@dataclass(frozen=True)
class CameraPlace:
    """What a camera's images show, and how they are drawn on which surface."""

    source: Lens | Surface
    surface: Surface
    interpolation: str

    def is_crop_of(self, other: 'CameraPlace') -> bool:
        """Whether it shows the same camera as another, on a surface of the same kind.

        Of a lens the image circle may differ; of images that were corrected elsewhere nothing is
        known but their surface, whose focal length tells lenses apart.
        """
        if self.surface.kind != other.surface.kind:
            return False
        mine, theirs = self.source, other.source
        if isinstance(mine, Surface) or isinstance(theirs, Surface):
            return (
                isinstance(mine, Surface)
                and isinstance(theirs, Surface)
                and (mine.kind, mine.focal_px) == (theirs.kind, theirs.focal_px)
            )
        return mine == theirs.with_max_angle(mine.visible_angle_rad)


def surfaces_of(places: dict[int, CameraPlace]) -> list[Surface]:
    """Return what the corrected images show, all with the focal length of the first."""
    return [surface for _, surface in sorted(_with_one_focal(places).items())]


def _with_one_focal(places: dict[int, CameraPlace]) -> dict[int, Surface]:
    """Return the surface of each place, enlarged or reduced to the focal length of the first."""
    surfaces = {index: place.surface for index, place in places.items()}
    if 0 not in surfaces:
        return surfaces
    focal_px = surfaces[0].focal_px
    return {
        index: surface if surface.focal_px == focal_px else surface.with_focal(focal_px)
        for index, surface in surfaces.items()
    }
