"""What the pipeline reports of itself: numbers, and a sentence about clocks that differ."""

from collections.abc import Sequence

import numpy as np

from panorama_stitch.pipeline.pairing import LONGEST_WAIT_NS, ROOM_BYTES
from panorama_stitch.pipeline.stitch_pipeline import StitchPipeline

_LONG_LAG_NS = 250_000_000
_PERCENTILES = (50, 95, 99)
_LONGEST_LATENCY_MS = 10_000.0
"""What is older was not taken by the clock of this machine."""


def metrics(pipeline: StitchPipeline) -> dict[str, float | str]:
    """Return rates, losses, skew and the overlaps in use, each with its name and unit."""
    cameras = pipeline.rig.cameras
    values: dict[str, float | str] = {
        'pairs overtaken': pipeline.frames.overtaken,
        'pairs broken': pipeline.broken,
    }
    if pipeline.compositor and pipeline.compositor.is_costly:
        values['economy'] = 'on' if pipeline.economy.is_on else 'off'
    for camera in cameras:
        values[f'{camera} rate Hz'] = pipeline.frames.rates[camera].hz
        values[f'{camera} unpaired'] = pipeline.frames.pairing.unpaired[camera]
    skews_ms = np.array(list(pipeline.frames.pairing.skews_ns)) / 1e6
    if len(skews_ms):
        values['skew median ms'] = float(np.median(skews_ms))
        values['skew worst ms'] = float(skews_ms.max())
    for pair_of, overlap in zip(pipeline.rig.pairs, pipeline.overlaps, strict=False):
        pair = f'{cameras[pair_of.left]}-{cameras[pair_of.right]}'
        values[f'{pair} overlap'] = f'found by {overlap.method}' if overlap.found else 'none'
        values[f'{pair} offset px'] = overlap.offset_x_px
        values[f'{pair} confidence'] = overlap.confidence
    values.update(pipeline.watch.metrics())
    return values


def latency_metrics(latencies_ms: Sequence[float]) -> dict[str, float | str]:
    """Return percentiles of the latency, or that the clocks differ where none can be known.

    Parameters
    ----------
    latencies_ms
        From the stamp of each recent panorama to its publishing, ms.
    """
    latencies_ms = list(latencies_ms)
    if not latencies_ms:
        return {}
    usual_ms = float(np.median(latencies_ms))
    if 0 <= usual_ms <= _LONGEST_LATENCY_MS:
        values = np.percentile(latencies_ms, _PERCENTILES)
        return {
            f'latency p{percent} ms': float(value)
            for percent, value in zip(_PERCENTILES, values, strict=True)
        }
    apart = f'{abs(usual_ms) / 1e3:.3g} s {"ahead of" if usual_ms < 0 else "behind"}'
    return {'latency': f"not known: the stamps are {apart} this machine's clock"}


def economy_sentence(pipeline: StitchPipeline) -> str:
    """Return the sentence that something is left out for want of time; '' if nothing is."""
    compositor = pipeline.compositor
    if compositor is None or not compositor.is_costly or not pipeline.economy.is_on:
        return ''
    return (
        f'no time for blend:={pipeline.settings.blend} at this rate: seams only fade until there '
        'is (fewer or smaller pictures, or blend:=feather)'
    )


def lag_sentence(pipeline: StitchPipeline) -> str:
    """Return that the panorama waits long for one camera; '' where it does not."""
    pairing = pipeline.frames.pairing
    if pipeline.settings.pair_by == 'arrival' or pairing.lag_ns < _LONG_LAG_NS:
        return ''
    late, early = pairing.late_and_early
    return (
        f'{late} comes {pairing.lag_ns / 1e6:.0f} ms later than {early} by its stamps, and the '
        'panorama with it; if that is not its delay but its clock, pair_by:=arrival joins what '
        'arrives together'
    )


def unpaired_sentence(pipeline: StitchPipeline) -> str:
    """Return the sentence that no frames belong together, with what is known of the cause."""
    settings = pipeline.settings
    sentence = (
        f'pictures come, but for {pipeline.frames.unpaired_s:.0f} s none that belong together'
    )
    pairing = pipeline.frames.pairing
    spread_s = pairing.spread_ns / 1e9
    if spread_s <= settings.max_pair_skew_s:
        return sentence
    limit = f'(max_pair_skew_s is {settings.max_pair_skew_s:g})'
    if settings.pair_by == 'arrival':
        return f'{sentence}: they arrive {spread_s:.3g} s apart {limit}'
    if pairing.spread_ns <= LONGEST_WAIT_NS:
        late, early = pairing.late_and_early
        sentence += f': {late} comes {1e3 * spread_s:.0f} ms later than {early}'
        if not pairing.is_full:
            return sentence
        return (
            f'{sentence}, more than can wait in {ROOM_BYTES / 1e6:.0f} MB; smaller pictures or '
            'fewer a second can'
        )
    return (
        f'{sentence}: the stamps of the cameras are {spread_s:.3g} s apart {limit}; are their '
        'clocks equal? If they cannot be, pair_by:=arrival joins what arrives together'
    )
