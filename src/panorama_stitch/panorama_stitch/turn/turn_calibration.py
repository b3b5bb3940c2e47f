"""Calibrate a rig from one turn on the spot: the recipe."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from fisheye_core.errors import CalibrationError
from fisheye_geometry.attitude import Attitude
from panorama_stitch.turn.bundle import TurnFit, adjust
from panorama_stitch.turn.first_turn import first_camera, first_state
from panorama_stitch.turn.full_circle import Frame, closing_frame, seen_again
from panorama_stitch.turn.halves import TurnHalves, halves_of
from panorama_stitch.turn.landmarks import clearest, everywhere, own_camera, spread
from panorama_stitch.turn.level_views import LevelViews
from panorama_stitch.turn.panorama_yaw import yaw_between
from panorama_stitch.turn.sightings import Sightings, joined
from panorama_stitch.turn.tracker import TurnTracker
from panorama_stitch.turn.turn_state import TurnState

_LEAST_CORNERS = 25
_SHARES = 1.0, 0.85
"""Of the first focal lengths, from which the fit begins: one begin may end in a wrong valley."""
_LOOKS = ((14, 0.8, 0.33, False), (6, 0.8, 0.5, True), (4, 0.85, 0.5, True))
"""How far each look at all pictures reaches, px; which correlation it asks for; what share of the
landmarks each picture is asked for; and whether they may look sheared and stretched."""


@dataclass(frozen=True)
class TurnCalibration:
    """What a turn tells of a rig.

    Attributes
    ----------
    cameras
        Names.
    fit
        What explains all sightings best.
    halves
        Two fits of half of the landmarks each.
    brightest
        (height, width) uint8 of each camera, the brightest that each pixel was.
    found_share
        Share of the landmarks that were found again where they should be seen.
    """

    cameras: tuple[str, ...]
    fit: TurnFit
    halves: TurnHalves
    brightest: tuple[np.ndarray, ...]
    found_share: float

    @property
    def sizes(self) -> list[tuple[int, int]]:
        """Width and height of each camera's pictures, px."""
        return [picture.shape[::-1] for picture in self.brightest]


def calibrate_turn(
    tracker: TurnTracker, cameras: Sequence[str], turns_right: bool | None = None
) -> TurnCalibration:
    """Calibrate the cameras of a rig that turned once on the spot.

    Parameters
    ----------
    tracker
        Has seen the pictures.
    cameras
        Names, as the tracker has them.
    turns_right
        Which way the rig turned; None: the way in which most cameras are upright.

    Raises
    ------
    CalibrationError
        If the pictures show no full turn, or the cameras not the same place, or one of them
        nothing that fits a turn.
    """
    frames = tracker.frames
    starts = _starts(tracker, cameras, turns_right)
    brightest = tuple(np.max(pictures, axis=0) for pictures in zip(*frames, strict=True))
    sizes = {name: picture.shape[::-1] for name, picture in zip(cameras, brightest, strict=True)}
    fits = [adjust(state, seen, sizes, yaws_known=False) for state, seen in starts]
    fit = min(fits, key=lambda fit: fit.noise_px / len(fit.seen))
    state, seen = spread(_with_yaws(fit, frames, brightest), fit.seen, yaws_known=True)
    found_share = 0.0
    for reach_px, least, share, sheared in _LOOKS:
        reference = clearest(state, seen)
        views = LevelViews(frames, state, brightest)
        wanted = everywhere(state, share)
        wanted = wanted.only(views.visible(wanted))
        found = views.find(wanted, reference, reach_px, least, sheared=sheared)
        found_share = len(found) / max(len(wanted), 1)
        fit = adjust(state, found, sizes, yaws_known=True, noise_px=fit.noise_px)
        state, seen = fit.state, fit.seen
    return TurnCalibration(tuple(cameras), fit, halves_of(fit, sizes), brightest, found_share)


def _starts(
    tracker: TurnTracker, cameras: Sequence[str], turns_right: bool | None
) -> list[tuple[TurnState, Sightings]]:
    """Return states to begin with, and the sightings of corners that were followed."""
    frames = tracker.frames
    last = closing_frame(frames)
    followed = tracker.sightings()
    firsts, links, number = [], [], followed.landmark.max() + 1
    for camera, name in enumerate(cameras):
        steps = _steps(followed.only(followed.camera == camera), len(frames))
        again = seen_again(frames, last, camera)
        if (corners := len(again[0][2])) < _LEAST_CORNERS:
            raise CalibrationError(
                f'the end of the turn shows only {corners} of the corners that {name} saw at its '
                f'begin; expected {_LEAST_CORNERS} and more: a full turn on the spot'
            )
        size = frames[0][camera].shape[::-1]
        firsts.append(first_camera(steps, again[0][2:], last, size, name))
        for late, early, before, after in again:
            ids = number + np.arange(len(before))
            links += [(camera, late, ids, before), (camera, early, ids, after)]
            number += len(ids)
    seen = followed.and_(joined(links))
    return [
        spread(first_state(firsts, seen, turns_right, share), seen, yaws_known=False)
        for share in _SHARES
    ]


def _steps(seen: Sightings, frames: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return the pixels of the same corners in each frame and the next."""
    by_frame = [seen.only(seen.frame == frame) for frame in range(frames)]
    steps = []
    for before, after in pairwise(by_frame):
        _, i, j = np.intersect1d(before.landmark, after.landmark, return_indices=True)
        steps.append((before.pixels[i], after.pixels[j]))
    return steps


def _with_yaws(
    fit: TurnFit, frames: Sequence[Frame], brightest: Sequence[np.ndarray]
) -> TurnState:
    """Turn the cameras, each with its own landmarks, against each other as their panoramas say."""
    state = fit.state
    views = LevelViews(frames, state, brightest)
    first = views.panorama(0)
    yaws = [0.0]
    yaws += [yaw_between(first, views.panorama(i)) for i in range(1, len(brightest))]
    turns = np.array([Attitude(yaw_rad=yaw).matrix for yaw in yaws])
    own = own_camera(fit.seen, len(state.directions))
    return replace(
        state,
        attitudes=turns @ state.attitudes,
        places=np.einsum('cij,cj->ci', turns, state.places),
        directions=np.einsum('lij,lj->li', turns[own], state.directions),
    )
