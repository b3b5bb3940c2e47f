"""Measures the overlap of each pair of neighbours in a rig."""

from collections.abc import Sequence
from dataclasses import replace
from math import radians

from fisheye_core.errors import OverlapError
from fisheye_geometry.rig import Pair, pairs_for, pairs_of
from panorama_stitch.compose.placing import leads_around
from panorama_stitch.compose.posing import views_of_rig
from panorama_stitch.overlap.methods import METHODS, PairInput
from panorama_stitch.overlap.overlap_result import Overlap, with_offset
from panorama_stitch.pipeline.known_cameras import Images
from panorama_stitch.pipeline.mounted_cameras import MountedCameras
from panorama_stitch.pipeline.panorama_settings import PanoramaOutputSettings

_MOST_SETS, _FEWEST_SETS = 6, 2
"""Frame sets that one pair, and each of many pairs, is measured on."""
_CLOSING_RAD = radians(10.0)
"""How far the closing rotation of a ring may be from what the others leave for it."""


def measure_overlaps(
    cameras: MountedCameras,
    frame_sets: Sequence[Images],
    settings: PanoramaOutputSettings,
    method: str,
) -> list[Overlap]:
    """Measure the overlap of each pair of neighbours, the closing one of a ring too.

    Parameters
    ----------
    cameras
        Of which it is known what every one sees.
    frame_sets
        Images (height, width[, channels]) uint8, one of each camera in each set.
    settings
        How to measure.
    method
        One of `METHODS`, in place of the settings' own.

    Returns
    -------
    list of Overlap
        One for each pair; if the rig leads all around one for the closing pair too.

    Raises
    ------
    OverlapError
        If there is no frame set.
    ImageFormatError
        If the images cannot be what the cameras are known to give.
    """
    if not frame_sets:
        raise OverlapError('no pair of frames has come yet; are all cameras running?')
    for images in frame_sets:
        for camera, image in zip(cameras.cameras, images, strict=True):
            cameras.check(camera, image)
    measure = METHODS[method]
    # Many pairs are measured on fewer frame sets each: whoever asked waits for all.
    pairs = pairs_of(len(cameras.cameras))
    frame_sets = frame_sets[-max(_FEWEST_SETS, _MOST_SETS // max(1, len(pairs))) :]
    overlaps = [measure(_pair_input(cameras, pair, frame_sets), settings) for pair in pairs]
    closing = _closing(cameras, overlaps, settings)
    if closing:
        pair, expected = closing
        closing_input = replace(_pair_input(cameras, pair, frame_sets), **expected)
        overlaps.append(measure(closing_input, settings))
    return _with_offsets(cameras, overlaps, settings)


def _pair_input(cameras: MountedCameras, pair: Pair, frame_sets: Sequence[Images]) -> PairInput:
    views = cameras.camera_views
    images = [(each[pair.left], each[pair.right]) for each in frame_sets]
    return PairInput(views[pair.left], views[pair.right], images, *(cameras.expected(pair) or ()))


def _closing(
    cameras: MountedCameras, overlaps: list[Overlap], settings: PanoramaOutputSettings
) -> tuple[Pair, dict] | None:
    """Return the pair that closes the ring and where its rotation is expected, if one does."""
    count, surfaces = len(cameras.cameras), cameras.surfaces
    if count < 2 or settings.ring == 'open' or not surfaces[0].yaw_is_column_shift:
        return None
    pair = pairs_of(count, is_closed=True)[-1]
    if not all(overlap.found and overlap.attitude for overlap in overlaps):
        return (pair, {}) if settings.ring == 'closed' else None
    closed = replace(settings, ring='closed')
    rig = cameras.solve(overlaps, closed, level='symmetric').rig
    if not leads_around(views_of_rig(rig, surfaces)):
        return (pair, {}) if settings.ring == 'closed' else None
    return pair, {'expected': rig.relative(pair), 'within_rad': _CLOSING_RAD}


def _with_offsets(
    cameras: MountedCameras, overlaps: list[Overlap], settings: PanoramaOutputSettings
) -> list[Overlap]:
    """Return overlaps with the offsets that their rotations mean once the rig is level."""
    surfaces, count = cameras.surfaces, len(cameras.cameras)
    rig = cameras.solution(overlaps, settings).rig
    return [
        with_offset(overlap, surfaces[pair.left], surfaces[pair.right], rig.attitudes(pair))
        for overlap, pair in zip(overlaps, pairs_for(count, len(overlaps)), strict=True)
    ]
