"""How far off its axis each camera is drawn at its seams."""

import numpy as np

from panorama_stitch.compose.compositor import Compositor
from panorama_stitch.compose.layout import Seam


def seam_angle_rad(compositor: Compositor, index: int) -> float:
    """Return the largest angle from a camera's axis at which one of its seams lies.

    Parameters
    ----------
    compositor
        What draws the panorama.
    index
        Of the camera in the rig.

    Returns
    -------
    float
        In the middle row of the panorama, rad; 0 for a camera without a seam.
    """
    layout = compositor.layout
    at, last = layout.order.index(index), len(layout.order) - 1
    seams: list[Seam] = []
    if at or layout.wraps:
        seams += layout.seams[at - 1 : at or None]
    if at < last or layout.wraps:
        seams += layout.seams[at : at + 1]
    if not seams:
        return 0.0
    columns = [(seam.begin + seam.end - 1) / 2 % layout.surface.width for seam in seams]
    middle = (layout.surface.height - 1) / 2
    rays, _ = layout.surface.unproject(np.array([[column, middle] for column in columns]))
    axis = compositor.views[index].attitude.matrix[:, 2]
    return float(np.arccos((rays @ axis).clip(-1, 1)).max())
