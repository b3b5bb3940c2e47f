"""Overlaps to messages."""

from collections.abc import Sequence
from dataclasses import asdict
from math import degrees, nan

from fisheye_msgs.msg import Overlap, Particle
from std_msgs.msg import Header

from fisheye_bridge.stamps import stamp_of
from fisheye_geometry.attitude import LEVEL
from fisheye_geometry.rig import Pair, pairs_for
from fisheye_geometry.surface import Surface
from panorama_stitch.compose.layout import Layout
from panorama_stitch.overlap.overlap_result import Overlap as OverlapResult
from panorama_stitch.overlap.overlap_result import yaw_between_rad
from panorama_stitch.pipeline.rig_state import RigState


def overlap_messages(
    results: Sequence[OverlapResult],
    rig: RigState,
    frame_id: str,
    layout: Layout | None = None,
) -> list[Overlap]:
    """Return a message for the overlap of each pair of a rig, in its order.

    Parameters
    ----------
    results
        What is known of each pair.
    rig
        The cameras.
    frame_id
        Of the panorama.
    layout
        The panorama's, where the overlaps are those that it is drawn with.
    """
    cameras, surfaces = rig.cameras, rig.surfaces
    return [
        _message(
            result,
            (cameras[pair.left], cameras[pair.right]),
            (surfaces[pair.left], surfaces[pair.right]),
            frame_id,
            _columns(layout, pair),
        )
        for result, pair in zip(results, pairs_for(len(cameras), len(results)), strict=True)
    ]


def _columns(layout: Layout | None, pair: Pair) -> dict[str, float]:
    """Return the columns of the panorama in which a pair meets, by their names in messages."""
    seam = layout and layout.seam(*pair)
    if not layout or not seam:
        return dict.fromkeys(
            ('seam_begin_px', 'seam_end_px', 'right_begin_px', 'left_end_px'), nan
        )
    return {
        'seam_begin_px': float(seam.begin),
        'seam_end_px': float(seam.end),
        'right_begin_px': float(layout.fields[pair.right][0]),
        'left_end_px': float(layout.fields[pair.left][1]),
    }


def _message(
    result: OverlapResult,
    names: tuple[str, str],
    surfaces: tuple[Surface, Surface],
    frame_id: str,
    columns: dict[str, float],
) -> Overlap:
    attitude = result.attitude or LEVEL
    yaw_deg = degrees(yaw_between_rad(result.offset_x_px, *surfaces))
    return Overlap(
        header=Header(stamp=stamp_of(result.stamp_ns), frame_id=frame_id),
        left_camera=names[0],
        right_camera=names[1],
        method=result.method,
        found=result.found,
        offset_x_px=result.offset_x_px,
        offset_y_px=result.offset_y_px,
        offset_deg=yaw_deg,
        yaw_deg=yaw_deg,
        pitch_deg=degrees(attitude.pitch_rad),
        roll_deg=degrees(attitude.roll_rad),
        near_deg=result.near_deg,
        overlap_px=result.overlap_px,
        confidence=result.confidence,
        min_correlation_value=result.min_correlation_value,
        left_particles=[Particle(**asdict(particle)) for particle in result.left_particles],
        right_particles=[Particle(**asdict(particle)) for particle in result.right_particles],
        left_match=result.left_match,
        right_match=result.right_match,
        **columns,
    )
