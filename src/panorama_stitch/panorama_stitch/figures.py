"""What a live line tells of itself in numbers."""

from itertools import pairwise

import numpy as np

from panorama_stitch.live import LiveStitcher


def figures(live: LiveStitcher) -> dict[str, float | str]:
    """Give rates, losses, skew and the overlaps in use, each with its name and unit."""
    cameras = live.stitcher.cameras
    values: dict[str, float | str] = {
        'pairs overtaken': live.dropped,
        'pairs broken': live.broken,
    }
    for camera in cameras:
        values[f'{camera} rate Hz'] = live.rates[camera].hz
        values[f'{camera} unpaired'] = live.pairing.unpaired[camera]
    skews_ms = np.array(live.pairing.skews_ns) / 1e6
    if len(skews_ms):
        values['skew median ms'] = float(np.median(skews_ms))
        values['skew worst ms'] = float(skews_ms.max())
    for (left, right), overlap in zip(pairwise(cameras), live.overlaps, strict=False):
        pair = f'{left}-{right}'
        values[f'{pair} overlap'] = f'found by {overlap.method}' if overlap.found else 'none'
        values[f'{pair} offset px'] = overlap.offset_x_px
        values[f'{pair} confidence'] = overlap.confidence
    return values
