"""The picture of a virtual camera, drawn straight from the pictures of a rig's cameras."""

from collections.abc import Collection, Sequence
from dataclasses import replace

import cv2
import numpy as np

from fisheye_core.errors import GeometryError
from fisheye_geometry.attitude import Attitude
from fisheye_geometry.mesh import Mesh, MeshTable
from fisheye_geometry.remap import on_picture
from fisheye_geometry.surface import Surface
from panorama_stitch.compose.blend import Feather
from panorama_stitch.compose.compositor import Compositor
from panorama_stitch.compose.layout import Layout
from panorama_stitch.compose.shares import (
    Seen,
    distance_px,
    joints,
    owners,
    ramps,
)
from panorama_stitch.compose.view import Table, View
from panorama_stitch.compose.virtual_parts import JointBlend, parts_of

_PROBES = 9
"""Pixels a side of the grid by which cameras are told that see nothing of a picture."""


def check_bearings(compositor: Compositor) -> None:
    """Raise a `GeometryError` where it is not known where the cameras of a panorama look."""
    surface = compositor.layout.surface
    if not surface.yaw_is_column_shift:
        raise GeometryError(
            f'views are not drawn beside a {surface.kind} panorama, which does not tell where its '
            'cameras look; expected surface:=cylindrical or equirectangular'
        )
    if any(view.shift_px[0] for view in compositor.views):
        raise GeometryError(
            'views are not drawn: no overlap was found, and it is not known where the cameras look'
        )


class VirtualView:
    """Draws what a virtual camera sees, with the seams, the blend and the gain of the panorama.

    Attributes
    ----------
    cameras : tuple of int
        Indices of the cameras that show something of it.
    seen_share : float
        Share of the picture that shows anything; the rest is black.
    """

    def __init__(
        self, compositor: Compositor, surface: Surface, attitude: Attitude, *, moves: bool = False
    ):
        """Prepare.

        Parameters
        ----------
        compositor
            What composes the panorama.
        surface
            Rectilinear: the picture to be drawn.
        attitude
            Takes rays of the picture to rays of the panorama.
        moves
            Whether it will look elsewhere soon: it is prepared in the time of a few frames then,
            seams only fade, and it ends up to 8 px earlier where a lens does.

        Raises
        ------
        GeometryError
            As `check_bearings` does.
        """
        check_bearings(compositor)
        self._compositor = compositor
        layout = compositor.layout
        shape = surface.height, surface.width
        tables, seen = _tables(compositor.views, surface, attitude, moves)
        distances = _distances(layout, surface, attitude, moves)
        faded = ramps(layout, distances)
        owner = owners(layout, faded, seen, shape)
        kind = Feather if moves else compositor.blend
        found = joints(layout, distances, faded, seen, owner, needs_overlap=kind.needs_overlap)
        self._parts = parts_of(tables, owner, found)
        self._blends = [JointBlend(one, kind(one.zone, one.zone, one.ramp)) for one in found]
        self.cameras = tuple(self._parts)
        self.seen_share = float((owner >= 0).mean())

    def draw(
        self,
        images: Sequence[np.ndarray],
        out: np.ndarray,
        *,
        without: Collection[int] = (),
        economical: bool = False,
    ) -> None:
        """Draw.

        Parameters
        ----------
        images
            A picture of each camera, (height, width[, channels]) uint8.
        out
            (surface.height, surface.width[, channels]) uint8, overwritten.
        without
            Indices of cameras that are not shown; it is black there.
        economical
            Leave out what takes long in blends.

        Raises
        ------
        ImageFormatError
            If a picture has not the size of its camera's.
        """
        gain = self._compositor.gain_for(out)
        whole = out.shape[:2]
        parts = {index: part for index, part in self._parts.items() if index not in without}
        if not any(part.covers(whole) for part in parts.values()):
            out[:] = 0
        drawn = {}
        for index, part in parts.items():
            room = out if part.covers(whole) else part.room(out)
            part.cut(images[index], room)
            if gain:
                gain.apply(index, room)
            if room is not out:
                cv2.copyTo(room, part.mask, out[part.box])
            drawn[index] = room
        for joint in self._blends:
            if joint.left in drawn and joint.right in drawn:
                joint.draw(self._parts, drawn, out, economical=economical)


def _tables(views: Sequence[View], surface: Surface, attitude: Attitude, moves: bool):
    """Return the tables of the cameras that see anything of a picture, and where they see it."""
    tables: dict[int, Table] = {}
    seen: dict[int, Seen] = {}
    y, x = np.ogrid[
        -0.5 : surface.height - 0.5 : _PROBES * 1j, -0.5 : surface.width - 0.5 : _PROBES * 1j
    ]
    for index, view in enumerate(views):
        turned = Attitude.of(attitude.matrix.T @ view.attitude.matrix)
        if not on_picture(view.source, surface.rays(x, y) @ turned.matrix)[1].any():
            continue
        view = replace(view, attitude=turned, shift_px=(0.0, 0.0))
        table = (
            MeshTable(view.source, surface, view.interpolation, turned)
            if moves
            else view.drawn_on(surface)
        )
        shows, scene = view.shows(table), view.shows_scene(table)
        if shows.any():
            tables[index], seen[index] = table, Seen(shows, scene)
    return tables, seen


def _distances(layout: Layout, surface: Surface, attitude: Attitude, moves: bool):
    """Return how far right of each seam of the panorama the pixels of a picture look, px."""
    mesh = Mesh(*surface.size) if moves else None
    y, x = (mesh.y_px, mesh.x_px) if mesh else np.ogrid[: surface.height, : surface.width]
    pixels, _ = layout.surface.project(surface.rays(x, y) @ attitude.matrix.T)
    distances = [distance_px(pixels[..., 0], seam, layout) for seam in layout.seams]
    if mesh is None:
        return [distance.astype(np.float32) for distance in distances]
    spread = []
    for distance in distances:
        # Behind, from one end to the other, it is no seam that lies between far left and right.
        near, far = mesh.spread(distance), mesh.spread(np.abs(distance))
        is_far = far > layout.surface.circumference_px / 4
        spread.append(np.where(is_far, np.copysign(far, near), near))
    return spread
