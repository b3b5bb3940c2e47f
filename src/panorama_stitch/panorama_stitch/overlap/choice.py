"""Which of the proposed rotations has most merit, as the patches of the overlap vote on each."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from panorama_stitch.overlap.rotation import Proposal
from panorama_stitch.overlap.trial import DIM, SHARP, Stages, Trial, try_rotation
from panorama_stitch.overlap.view import OverlapView

_CLEAR, _CLEAR_SUPPORTED, _CLEAR_AREA = 0.55, 0.3, 40.0
"""So large a share that agrees ends the search, a smaller one where few features disagree."""
_CLEAR_SUPPORT = 2.5
_FINALISTS = 2
"""Where none is clear, so many are looked at closely: from afar a near thing may look better."""
_SIGNIFICANT = 5.0
"""Enough that no larger patches need to be tried; else they are on the `_DIM` best."""
_DIM = 5


@dataclass(frozen=True, eq=False)
class Candidate:
    """A proposal, and what the votes say of it, with a wide reach and with a close one."""

    proposal: Proposal
    stages: Stages
    wide: Trial
    close: Trial


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
    first = [pairs[i] for i in few], [usable[i] for i in few]
    best, most = None, 0.0
    untried = proposals
    for stages in (SHARP, DIM):
        trials, clear = _try(first, stages, untried, proposals)
        if stages is SHARP and not clear:
            others = more()
            proposals = [*proposals, *others]
            further, clear = _try(first, stages, others, proposals)
            trials += further
        trials.sort(key=lambda one: -one[0])
        for _, proposal, wide in trials[: 1 if clear else _FINALISTS]:
            close = try_rotation(pairs, usable, wide.rotation, stages.close) or wide
            merit = _merit(proposal, close)
            if best is None or merit > most:
                best, most = Candidate(proposal, stages, wide, close), merit
        if clear or (best and best.close.significance > _SIGNIFICANT):
            break
        untried = [one for _, one, _ in trials[:_DIM]] or proposals
    return best


def _try(first, stages, untried, proposals) -> tuple[list[tuple[float, Proposal, Trial]], bool]:
    """Try proposals, with the merit of each, until one is clearly right; and whether one is."""
    trials: list[tuple[float, Proposal, Trial]] = []
    for proposal in untried:
        trial = try_rotation(*first, proposal.matrix, stages.wide)
        if not trial:
            continue
        merit = _merit(proposal, trial)
        best = all(merit > other for other, _, _ in trials)
        trials.append((merit, proposal, trial))
        rival = max((one.support for one in proposals if one is not proposal), default=0.0)
        supported = proposal.support > _CLEAR_SUPPORT * rival
        needed = _CLEAR_SUPPORTED if supported else _CLEAR
        if best and trial.explained > needed and trial.far > _CLEAR_AREA:
            return trials, True
    return trials, False


def _merit(proposal, trial):
    return trial.significance * (proposal.support + 0.1) ** 0.5
