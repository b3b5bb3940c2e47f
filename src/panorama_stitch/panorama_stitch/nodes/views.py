"""The views of a node: those that its parameter names, and their parameters."""

from collections.abc import Sequence
from time import monotonic

from rclpy.node import Node
from rclpy.parameter import Parameter

from fisheye_bridge.diagnostics import WARN, Report
from fisheye_bridge.parameters import Parameters
from fisheye_bridge.transforms import TransformPublisher
from fisheye_core.errors import FisheyeError
from panorama_stitch.nodes.view_publisher import ViewPublisher
from panorama_stitch.pipeline.panorama import Panorama
from panorama_stitch.pipeline.view_settings import ViewSettings

_ASK_S = 0.2
"""Asking for subscribers takes as long for a few views as drawing one."""


class Views:
    """Publishes the views of panoramas while somebody subscribes."""

    def __init__(self, node: Node, frame_id: str):
        """Start with the views that the node's settings name.

        Parameters
        ----------
        node
            Its `settings` have `views`.
        frame_id
            Of the panorama.
        """
        self._node, self._frame_id = node, frame_id
        self._transforms = TransformPublisher(node)
        self._declared: dict[str, Parameters] = {}
        self._views: dict[str, ViewPublisher] = {}
        self._subscribed: list[ViewPublisher] = []
        self._asked_s = -_ASK_S
        self._is_following = False
        self._follow()
        # Only once a change is taken: parameters of views cannot be declared while others are set.
        node.add_post_set_parameters_callback(self._changed)

    @property
    def wanted(self) -> bool:
        """Whether anybody subscribes to any of them."""
        return bool(self._wanted())

    @property
    def stabilised(self) -> bool:
        """Whether any of them is to be kept level."""
        return any(self._declared[name].settings.stabilise for name in list(self._views))

    def take(self, panorama: Panorama) -> None:
        """Hand a panorama to those that somebody subscribes to."""
        for view in self._wanted():
            view.take(panorama)

    def report(self, report: Report) -> None:
        """Report of each view."""
        if self.stabilised and self._node.settings.level != 'imu':
            report.add(WARN, 'views are stabilised by the imu alone; expected level:=imu')
        for view in self._views.values():
            view.report(report)

    def stop(self) -> None:
        """End their threads."""
        for view in self._views.values():
            view.stop()

    def _wanted(self) -> list[ViewPublisher]:
        """Return those that somebody subscribes to, as far as that was asked of late."""
        now_s = monotonic()
        if now_s - self._asked_s > _ASK_S:
            self._asked_s = now_s
            self._subscribed = [view for view in list(self._views.values()) if view.wanted]
        return self._subscribed

    def _changed(self, parameters: Sequence[Parameter]) -> None:
        if self._is_following:  # declaring parameters sets them
            return
        try:
            self._follow()
        except FisheyeError as error:
            self._node.warn(f'views: {error}')
        for name, view in self._views.items():
            # A value that it has already takes a steered view back too.
            if any(parameter.name.startswith(f'{name}.') for parameter in parameters):
                view.rest()

    def _follow(self) -> None:
        """Start the views that are named now, end the others, and tell where all are."""
        self._is_following = True
        try:
            names = self._node.settings.views
            self._subscribed, self._asked_s = [], -_ASK_S
            for name in set(self._views) - set(names):
                self._views.pop(name).stop()
            for name in names:
                if name not in self._views:
                    self._views[name] = self._started(name)
                self._views[name].apply(self._declared[name].settings)
            self._transforms.stay([self._views[name].place() for name in names])
        finally:
            self._is_following = False

    def _started(self, name: str) -> ViewPublisher:
        if name not in self._declared:
            self._declared[name] = Parameters(self._node, ViewSettings, prefix=f'{name}.')
        settings = self._declared[name].settings
        return ViewPublisher(self._node, name, settings, self._transforms, self._frame_id)
