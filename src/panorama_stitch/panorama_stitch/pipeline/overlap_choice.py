"""Which overlaps are used: what was measured now, or what was found before."""

from dataclasses import replace

from fisheye_geometry.rig import chain
from fisheye_geometry.surface import Surface
from panorama_stitch.overlap.overlap_result import Overlap, side_by_side


def kept(
    measured: list[Overlap], former: list[Overlap], cameras: int, *, prefers_former: bool = False
) -> list[Overlap]:
    """Return of each pair what was measured, but what was found before where nothing is found now.

    Parameters
    ----------
    measured, former
        One for each pair of neighbours, and one for the closing pair of a ring where it was
        looked for; `former` may be empty.
    cameras
        How many there are.
    prefers_former
        Whether what was found before stays although it was found again.
    """
    if not former:
        return measured
    pairs = cameras - 1
    neighbours = [
        old if old.found and (prefers_former or not new.found) else new
        for new, old in zip(measured[:pairs], former[:pairs], strict=True)
    ]
    if all(new.found for new in measured) and len(measured) == pairs:
        return neighbours  # what was measured leads all around no more
    sources = (former, measured) if prefers_former else (measured, former)
    closings = [(source[:pairs], closing) for source in sources for closing in source[pairs:]]
    for beside, closing in closings:
        # Of one measurement it is for the rig to tell that it does not close.
        if closing.found and (neighbours == beside or _closes(neighbours, closing)):
            return [*neighbours, closing]
    unfound = [one for one in (*measured[pairs:], *former[pairs:]) if not one.found]
    return [*neighbours, *unfound[:1]]


def _closes(neighbours: list[Overlap], closing: Overlap) -> bool:
    """Whether rotations lead around; where one is not known, nothing contradicts the others."""
    rotations = [
        overlap.attitude.matrix
        for overlap in (*neighbours, closing)
        if overlap.found and overlap.attitude
    ]
    return len(rotations) <= len(neighbours) or chain(rotations[:-1], rotations[-1]).is_closed


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
