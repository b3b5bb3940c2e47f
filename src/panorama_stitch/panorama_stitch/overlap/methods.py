"""The methods by which the overlap of two neighbours is measured, by name.

Each takes what is known of a pair and gives an `Overlap`. To add one, write such a function, a
line in `METHODS`, and its name in those of `overlap_settings`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import degrees, isnan, pi, radians, sqrt

import numpy as np
from scipy.spatial.transform import Rotation

from fisheye_geometry.attitude import LEVEL, Attitude
from fisheye_geometry.lens import Lens
from fisheye_geometry.level import levelled
from fisheye_geometry.remap import remap_table
from fisheye_geometry.rig import bearing_rad
from fisheye_geometry.surface import Surface
from panorama_stitch.overlap import wording
from panorama_stitch.overlap.corrected_overlap import measure_corrected
from panorama_stitch.overlap.measure import measure_rotation
from panorama_stitch.overlap.overlap_result import Overlap, side_by_side
from panorama_stitch.overlap.overlap_settings import OverlapSettings
from panorama_stitch.overlap.reported_particles import with_particles
from panorama_stitch.overlap.result import LIMITS, RotationResult
from panorama_stitch.overlap.view import OverlapView, seen_grey_of

_UNKNOWN_TILT_RAD = radians(50.0)
"""Two cameras that each look up or down by 25 degrees differ by so much."""
_LEAST_TILT_RAD, _SURELY = radians(0.1), 2.0
"""Less tilt, or less than so many deviations, is noise: the mount is level."""


@dataclass(frozen=True, eq=False)
class CameraView:
    """What a camera's images show.

    Attributes
    ----------
    source
        A lens's view, or a surface where they are corrected already.
    surface
        The corrected image of the camera alone; all of a rig have one kind and focal length.
    body
        (source height, source width) bool: where they show the robot itself; None for nowhere.
    """

    source: Lens | Surface
    surface: Surface
    body: np.ndarray | None = None

    def corrected(self, image: np.ndarray) -> np.ndarray:
        """Correct an image to grey, (height, width) uint8; 0 exactly where nothing is seen."""
        grey = seen_grey_of(image)
        if self.source == self.surface:
            return grey
        table = remap_table(self.source, self.surface)
        seen = table.valid
        if isinstance(self.source, Surface):
            # Black is what its lens does not see.
            seen = table(np.where(grey > 0, np.uint8(255), np.uint8(0))) == 255
        return np.maximum(table(grey), seen.astype(np.uint8))


@dataclass(frozen=True, eq=False)
class PairInput:
    """Two neighbours and what was seen of them.

    Attributes
    ----------
    left, right
        What their images show.
    images
        One or more pairs (left, right) of images (height, width[, channels]) uint8.
    expected
        The right camera's attitude in the left one's frame where mounts say it; None: not known.
    within_rad
        How far from it the attitude may be.
    """

    left: CameraView
    right: CameraView
    images: Sequence[tuple[np.ndarray, np.ndarray]]
    expected: Attitude | None = None
    within_rad: float = pi

    @property
    def surfaces(self) -> tuple[Surface, Surface]:
        """On what both corrected images are."""
        return self.left.surface, self.right.surface

    def corrected(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Return the pairs of images, corrected."""
        return [
            (self.left.corrected(left), self.right.corrected(right)) for left, right in self.images
        ]


_TOLD_RAD, _WHERE_TOLD = radians(30.0), 0.5
"""A rotation as near to what is expected needs so much less evidence of its own."""
_AS_SURE = 0.43
"""So large a correlation, as a share of a probability, is as sure as that."""

Method = Callable[[PairInput, OverlapSettings], Overlap]


def by_votes(pair: PairInput, settings: OverlapSettings) -> Overlap:
    """Measure the rotation between both cameras on many local votes; particles are reported.

    On a plane, where a rotation is no shift, the corrected images are correlated.
    """
    if not pair.left.surface.yaw_is_column_shift:
        return by_correlation(pair, settings)
    views = [
        tuple(
            OverlapView(image, camera.source, camera.body)
            for image, camera in zip(images, (pair.left, pair.right), strict=True)
        )
        for images in pair.images
    ]
    if all(np.array_equal(left, right) for left, right in pair.images):
        message = 'both views are the same picture; is one camera used twice, or both covered?'
        return side_by_side(pair.left.surface, 'particles', message)
    expected, within_rad = _search(pair, settings)
    is_told = pair.expected is not None and pair.within_rad < _TOLD_RAD
    needed = settings.min_confidence * (_WHERE_TOLD if is_told else 1.0)
    result = measure_rotation(
        views, expected=expected, within_rad=within_rad, min_confidence=needed
    )
    attitude = Attitude.of(result.rotation.as_matrix()) if result.found else None
    forbidden = _forbidden(attitude, pair, settings) if attitude else ''
    if attitude and not forbidden:
        attitude = _supported(attitude, result, settings)
        overlap = Overlap('particles', True, attitude=attitude, near_deg=result.near_deg)
        overlap = replace(overlap, message=f'{wording.direction(attitude)}, {result.message}')
    else:
        message = forbidden or _not_found(result, needed)
        overlap = side_by_side(pair.left.surface, 'particles', message)
    overlap = replace(overlap, confidence=result.confidence)
    images = pair.images[-1]
    corrected = pair.left.corrected(images[0]), pair.right.corrected(images[1])
    return with_particles(overlap, corrected, pair.surfaces)


def _not_found(result: RotationResult, needed: float) -> str:
    """Return the sentence that no overlap is believed, and why."""
    if result.rotation is None:
        return 'no common scene: nothing in both views is alike'
    why = f': {LIMITS[result.limit]}' if result.limit else ''
    return f'no common scene: confidence {result.confidence:.2f}, {needed:.2f} is needed{why}'


def _search(pair: PairInput, settings: OverlapSettings) -> tuple[Rotation | None, float]:
    """Return where the search begins and how far it goes, rad."""
    if pair.expected is not None:
        within_rad = pair.within_rad
        return Rotation.from_matrix(pair.expected.matrix), within_rad
    if isnan(settings.expected_yaw_deg):
        return None, pi
    yaw = Attitude(yaw_rad=radians(settings.expected_yaw_deg))
    tolerance_rad = radians(settings.yaw_tolerance_deg)
    return Rotation.from_matrix(yaw.matrix), min(pi, tolerance_rad + _UNKNOWN_TILT_RAD)


def _forbidden(attitude: Attitude, pair: PairInput, settings: OverlapSettings) -> str:
    """Return the sentence that the settings do not allow an attitude; '' where they do."""
    expected_deg, tolerance_deg = settings.expected_yaw_deg, settings.yaw_tolerance_deg
    if pair.expected is not None or isnan(expected_deg):
        return ''
    # The angle is meant about the vertical, which mounts that look down alike tell.
    left, right = (Attitude.of(level) for level in levelled([np.eye(3), attitude.matrix]))
    yaw_deg = degrees(bearing_rad(left, right))
    if abs(yaw_deg - expected_deg) <= tolerance_deg:
        return ''
    return (
        f'a common scene is seen where the right camera looks {yaw_deg:.2f} degrees to the right, '
        f'which expected_yaw_deg of {expected_deg:g} and yaw_tolerance_deg of {tolerance_deg:g} '
        'forbid'
    )


def _supported(attitude: Attitude, result, settings: OverlapSettings) -> Attitude:
    """Return an attitude with no more pitch and roll than the votes support."""
    deviation_rad = sqrt(float(np.linalg.eigvalsh(result.covariance)[-1]))
    least_rad = max(_LEAST_TILT_RAD, _SURELY * deviation_rad)
    tilt_rad = max(abs(attitude.pitch_rad), abs(attitude.roll_rad))
    if not settings.correct_tilt or tilt_rad < least_rad:
        return Attitude(yaw_rad=attitude.yaw_rad)
    return attitude


def by_correlation(pair: PairInput, settings: OverlapSettings) -> Overlap:
    """Correlate the corrected images at every offset, or at those that are expected."""
    settings = replace(settings, min_confidence=_AS_SURE * settings.min_confidence)
    if pair.expected is not None:
        settings = replace(
            settings,
            expected_yaw_deg=degrees(bearing_rad(LEVEL, pair.expected)),
            yaw_tolerance_deg=degrees(pair.within_rad),
        )
    return measure_corrected(pair.corrected(), *pair.surfaces, settings, 'correlation')


def by_paper(pair: PairInput, settings: OverlapSettings) -> Overlap:
    """Apply the published rule to the corrected images."""
    return measure_corrected(pair.corrected(), *pair.surfaces, settings, 'paper')


METHODS: dict[str, Method] = {
    'particles': by_votes,
    'correlation': by_correlation,
    'paper': by_paper,
}
