"""Which overlaps are used: what was measured now, or what was found before."""

from dataclasses import replace

from fisheye_geometry.surface import Surface
from panorama_stitch.overlap.overlap_result import Overlap, side_by_side


def kept(measured: list[Overlap], former: list[Overlap]) -> list[Overlap]:
    """Return what was measured, but what was found before where nothing was found now."""
    if len(former) != len(measured):
        # A ring was closed or opened; it is whole only with what was measured together.
        return measured if all(new.found for new in measured) or not former else former
    return [
        new if new.found or not old.found else old
        for new, old in zip(measured, former, strict=True)
    ]


def believed(result: Overlap, left: Surface, needed: float) -> Overlap:
    """Return a result as it is, or as not found where its confidence is less than is needed.

    The published rule always names an offset: asked for once, it must not ruin a rig that runs.
    """
    if result.method != 'paper' or not result.found or result.confidence >= needed:
        return result
    message = (
        f'{result.message}; not used: its confidence is {result.confidence:.2f}, '
        f'{needed:.2f} is needed (with the parameter method:=paper it is used all the same)'
    )
    aside = side_by_side(left, result.method, message)
    return replace(
        result,
        found=False,
        offset_x_px=aside.offset_x_px,
        offset_y_px=aside.offset_y_px,
        overlap_px=aside.overlap_px,
        message=message,
    )
