"""What a live line tells of itself in numbers, and of clocks that differ in words."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from panorama_stitch.pipeline.stitch_pipeline import StitchPipeline
from panorama_stitch.pipeline.panorama_settings import PanoramaOutputSettings

_PERCENTILES = (50, 95, 99)
_LONGEST_LATENCY_MS = 10_000.0
"""What is older was not taken by the clock of this machine."""


def metrics(live: StitchPipeline) -> dict[str, float | str]:
    """Give rates, losses, skew and the overlaps in use, each with its name and unit."""
    cameras = live.stitcher.cameras
    values: dict[str, float | str] = {
        'pairs overtaken': live.dropped,
        'pairs broken': live.broken,
    }
    for camera in cameras:
        values[f'{camera} rate Hz'] = live.rates[camera].hz
        values[f'{camera} unpaired'] = live.pairing.unpaired[camera]
    skews_ms = np.array(list(live.pairing.skews_ns)) / 1e6
    if len(skews_ms):
        values['skew median ms'] = float(np.median(skews_ms))
        values['skew worst ms'] = float(skews_ms.max())
    for (left, right), overlap in zip(pairwise(cameras), live.overlaps, strict=False):
        pair = f'{left}-{right}'
        values[f'{pair} overlap'] = f'found by {overlap.method}' if overlap.found else 'none'
        values[f'{pair} offset px'] = overlap.offset_x_px
        values[f'{pair} confidence'] = overlap.confidence
    return values


def latencies(latencies_ms: Sequence[float]) -> dict[str, float | str]:
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


def unpaired(live: StitchPipeline, settings: PanoramaOutputSettings) -> str:
    """Say that no frames belong together, and what is known of the cause."""
    sentence = f'pictures come, but for {live.unpaired_s:.0f} s none that belong together'
    spread_s = live.pairing.spread_ns / 1e9
    if spread_s <= settings.max_pair_skew_s:
        return sentence
    limit = f'(max_pair_skew_s is {settings.max_pair_skew_s:g})'
    if settings.pair_by == 'arrival':
        return f'{sentence}: they arrive {spread_s:.3g} s apart {limit}'
    return (
        f'{sentence}: the stamps of the cameras are {spread_s:.3g} s apart {limit}; are their '
        'clocks equal? If they cannot be, pair_by:=arrival joins what arrives together'
    )
