"""Which of the proposed rotations has most merit, as the patches of the overlap vote on each."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from panorama_stitch.overlap.rotation import Proposal
from panorama_stitch.overlap.trial import DIM, SHARP, Stages, Trial, try_rotation
from panorama_stitch.overlap.view import OverlapView

_CLEAR, _CLEAR_SUPPORTED, _CLEAR_AREA, _CLEAR_ACCOUNTED = 0.55, 0.3, 40.0, 0.25
"""So large a share that agrees ends the search, a smaller one where few features disagree."""
_CLEAR_SUPPORT = 2.5
_FINALISTS = 2
"""Where none is clear, so many are looked at closely: from afar a near thing may look better."""
_SIGNIFICANT = 5.0
"""Enough that no larger patches need to be tried; else they are on the `_DIM` best."""
_DIM = 5
_SAME_RAD = np.radians(3.0)
"""Proposals that end nearer to one another are one."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """A proposal, and what the votes say of it, with a wide reach and with a close one.

    `rivalled` is the merit of the best other rotation that was tried, as a share of its own.
    """

    proposal: Proposal
    stages: Stages
    wide: Trial
    close: Trial
    rivalled: float


def choose(
    pairs: Sequence[tuple[OverlapView, OverlapView]],
    usable,
    few: Sequence[int],
    proposals: Sequence[Proposal],
    more: Callable[[], list[Proposal]],
) -> Candidate | None:
    """Return the rotation with most merit; None where no vote is cast on any.

    Parameters
    ----------
    pairs, usable
        As of `try_rotation`.
    few
        Which of the pairs are enough for a first look.
    proposals, more
        What to try, and what else where none of these is clear.
    """
    look = [pairs[i] for i in few], [usable[i] for i in few]
    best, most = None, 0.0
    untried = proposals
    for stages in (SHARP, DIM):
        trials, clear = _try(look, stages, untried, proposals)
        if stages is SHARP and not clear:
            others = more()
            proposals = [*proposals, *others]
            further, clear = _try(look, stages, others, proposals)
            trials += further
        trials.sort(key=lambda one: -one[0])
        for merit_wide, proposal, wide in trials[: 1 if clear else _FINALISTS]:
            close = try_rotation(pairs, usable, wide.rotation, stages.close) or wide
            merit = _merit(proposal, close)
            if best is None or merit > most:
                other = max((m for m, _, one in trials if _apart(one, wide)), default=0.0)
                rivalled = max(other, 0.0) / max(merit_wide, 1e-3)
                best, most = Candidate(proposal, stages, wide, close, rivalled), merit
        if clear or (best and best.close.significance > _SIGNIFICANT):
            break
        untried = [one for _, one, _ in trials[:_DIM]] or proposals
    return best


def is_clear(proposals: Sequence[Proposal]) -> bool:
    """Whether the first one has much more support than any other."""
    others = [one.support for one in proposals[1:]]
    return bool(proposals) and proposals[0].support > _CLEAR_SUPPORT * max(others, default=0.0)


def _try(look, stages, untried, proposals) -> tuple[list[tuple[float, Proposal, Trial]], bool]:
    """Try proposals, with the merit of each, until one is clearly right; and whether one is."""
    trials: list[tuple[float, Proposal, Trial]] = []
    for proposal in untried:
        trial = try_rotation(*look, proposal.matrix, stages.wide)
        if not trial:
            continue
        merit = _merit(proposal, trial)
        best = all(merit > other for other, _, _ in trials)
        trials.append((merit, proposal, trial))
        others = [one for one in proposals if one is not proposal]
        needed = _CLEAR_SUPPORTED if is_clear([proposal, *others]) else _CLEAR
        if best and _tells(trial, needed):
            return trials, True
    return trials, False


def _tells(trial: Trial, needed: float) -> bool:
    """Whether no other rotation needs to be tried."""
    accounted = trial.accounted > _CLEAR_ACCOUNTED
    return accounted and trial.explained > needed and trial.far > _CLEAR_AREA


def _apart(one: Trial, other: Trial) -> bool:
    return bool(np.trace(one.rotation.T @ other.rotation) < 1 + 2 * np.cos(_SAME_RAD))


def _merit(proposal, trial):
    """What agrees, of either half of the overlap: a floor alone fits at more than one rotation."""
    return trial.significance * trial.accounted * (proposal.support + 0.1) ** 0.5
