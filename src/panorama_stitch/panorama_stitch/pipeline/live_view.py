"""A view from picture to picture: where it looks, and what draws it."""

from dataclasses import dataclass

import numpy as np

from fisheye_geometry.attitude import Attitude
from panorama_stitch.compose.compositor import Compositor
from panorama_stitch.compose.virtual_camera import VirtualCamera
from panorama_stitch.compose.virtual_view import VirtualView
from panorama_stitch.pipeline.panorama import Panorama
from panorama_stitch.pipeline.steering import Steering
from panorama_stitch.pipeline.view_settings import ViewSettings

_AT_REST = 5
"""Pictures after which a view that has not moved is drawn as one that does not."""


@dataclass(frozen=True)
class Aim:
    """Where a view looks at the time of one picture.

    Attributes
    ----------
    camera
        With its field of view and size.
    attitude
        Takes its rays to rays of the panorama.
    """

    camera: VirtualCamera
    attitude: Attitude


class LiveView:
    """Draws one view of panoramas as they come; one thread at a time.

    Attributes
    ----------
    settings : ViewSettings
        In use; `apply` changes them.
    seen_share : float
        Share of the last picture that the rig sees; 1 before the first.
    """

    def __init__(self, name: str, settings: ViewSettings):
        """Start as the settings say."""
        self.settings, self.seen_share = settings, 1.0
        self._name = name
        self._steering: Steering | None = None
        self._view: VirtualView | None = None
        self._prepared: tuple[Compositor, Aim] | None = None
        self._is_exact = False
        self._still = 0

    def apply(self, settings: ViewSettings) -> None:
        """Use the settings; where they are others, look where they say."""
        if settings is not self.settings:
            self.settings = settings
            self.rest()

    def rest(self) -> None:
        """Look where the settings say again."""
        self._steering = None

    def look(self, yaw_rad: float, pitch_rad: float, hfov_rad: float) -> None:
        """Steer the view; parameters and errors as of `Steering.look`."""
        steering = self._steering or Steering(self.settings.camera(self._name))
        steering.look(yaw_rad, pitch_rad, hfov_rad)
        self._steering = steering

    @property
    def moves(self) -> bool:
        """Whether the view looks elsewhere in the panorama from time to time."""
        return self._steering is not None or self.settings.stabilise

    def aim(self, panorama: Panorama | None = None) -> Aim:
        """Return where the view looks at the time of a panorama; without one: at rest."""
        camera = self.settings.camera(self._name)
        if panorama is None:
            return Aim(camera, camera.attitude)
        if steering := self._steering:
            camera = steering.at(panorama.stamp_ns, panorama.compositor.layout)
        attitude = camera.attitude
        if self.settings.stabilise and panorama.orientation:
            level = panorama.orientation.matrix
            attitude = Attitude.of(level.T @ attitude.matrix)
        return Aim(camera, attitude)

    def draw(self, panorama: Panorama, aim: Aim, out: np.ndarray) -> bool:
        """Draw the view of a panorama; return whether a camera that is live shows any of it.

        Raises
        ------
        GeometryError
            If it is not known where the cameras look.
        """
        view = self._prepare(panorama.compositor, aim)
        self.seen_share = view.seen_share
        stale = panorama.stale_cameras
        if view.cameras and set(view.cameras) <= stale:
            return False
        view.draw(
            panorama.images,
            out,
            without=stale,
            economical=panorama.is_economical,
        )
        return True

    def _prepare(self, compositor: Compositor, aim: Aim) -> VirtualView:
        """Return what draws where the view looks: exactly where it stays, soon where it moves."""
        is_same = self._prepared == (compositor, aim)
        self._still = self._still + 1 if is_same else 0
        is_exact = not self.moves or self._still >= _AT_REST
        if self._view is None or not is_same or (is_exact and not self._is_exact):
            surface = aim.camera.surface
            self._view = VirtualView(compositor, surface, aim.attitude, moves=not is_exact)
            self._prepared, self._is_exact = (compositor, aim), is_exact
        return self._view
