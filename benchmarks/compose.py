"""Raw pair to finished panorama, beside what the same pixels cost in any case.

The floor is two `cv2.remap` with fixed-point maps that correct both whole frames. `one remap`
draws the whole panorama at once from both frames, one above the other. `naive` is what one would
write first: two remaps of what shows, and a feather by `cv2.blendLinear`. Ratios are of the tenth
percentiles, which a busy machine disturbs least.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from pairs import ImagePair, synthetic_pair
from targets import Requirement
from timing import Spread, interleaved, spread

from fisheye_geometry.attitude import LEVEL, Attitude
from fisheye_geometry.lens import Lens
from fisheye_geometry.surface import Surface
from panorama_stitch.compose.blends import BLENDS
from panorama_stitch.compose.compositor import Compositor
from panorama_stitch.compose.layout import Layout
from panorama_stitch.compose.view import View
from panorama_stitch.pipeline.panorama_settings import PanoramaSettings

SIZES = (640, 480), (1280, 960), (1920, 1080)
FLAGS = {'nearest': cv2.INTER_NEAREST, 'linear': cv2.INTER_LINEAR, 'cubic': cv2.INTER_CUBIC}
UNLIKE = 1.0, 1.3
"""Exposures with which gain compensation has something to do."""
ROUNDS = {'nearest': 80, 'linear': 80, 'cubic': 12}
WAYS = ('floor', 'one remap', 'naive', 'memcpy', *BLENDS, 'feather, gain')


@dataclass(frozen=True)
class Composing:
    """Times of all ways to compose pictures of one size, ms, and their ratios."""

    width: int
    height: int
    interpolation: str
    threads: int
    megapixels: float
    times_ms: dict[str, Spread]
    to_floor: dict[str, float]
    to_one_remap: dict[str, float]

    @property
    def name(self) -> str:
        """Return what was measured, as a line."""
        return f'{self.width}x{self.height} {self.interpolation}, {self.threads} thread(s)'

    @property
    def ms_per_megapixel(self) -> float:
        """What a megapixel of panorama costs with a feather."""
        return self.times_ms['feather'].low / self.megapixels


def measure_composing(short: bool) -> list[Composing]:
    """Measure every size, interpolation and number of threads.

    `short` leaves only what other work on the machine disturbs least.
    """
    every_core = cv2.getNumThreads()
    results = []
    for size in SIZES[:1] if short else SIZES:
        for interpolation in ('linear',) if short else FLAGS:
            ways, megapixels = prepare(size, interpolation)
            for threads in (1,) if short else sorted({1, every_core}):
                cv2.setNumThreads(threads)
                times = interleaved(ways, ROUNDS[interpolation])
                results.append(summary(size, interpolation, threads, megapixels, times))
    cv2.setNumThreads(every_core)
    return results


def composing_targets(results: list[Composing]) -> list[Requirement]:
    """Return the requirements of composing."""
    targets = []
    for result in results:
        way = {'linear': 'feather', 'nearest': 'none'}.get(result.interpolation)
        if way:
            targets.append(Requirement(f'{result.name}, {way}, floors', result.to_floor[way], 1.0))
        if (result.width, result.interpolation) == (640, 'linear'):
            ratio = result.to_one_remap['feather']
            targets.append(Requirement(f'{result.name}, feather, remaps', ratio, 1.0))
            ratio = result.to_floor['feather, gain'] / result.to_floor['feather']
            targets.append(Requirement(f'{result.name}, with gain over without', ratio, 1.1))
    for kind in sorted({(r.interpolation, r.threads) for r in results}):
        costs = [r.ms_per_megapixel for r in results if (r.interpolation, r.threads) == kind]
        what = '{}, {} thread(s), dearest over cheapest megapixel'.format(*kind)
        targets.append(Requirement(what, max(costs) / min(costs), 1.5))
    return targets


def summary(size, interpolation: str, threads: int, megapixels: float, times) -> Composing:
    """Reduce times to spreads and ratios."""
    spreads = {way: spread(times[way]) for way in WAYS}
    to_floor, to_one_remap = (
        {way: spreads[way].low / spreads[unit].low for way in WAYS}
        for unit in ('floor', 'one remap')
    )
    return Composing(*size, interpolation, threads, megapixels, spreads, to_floor, to_one_remap)


def prepare(size: tuple[int, int], interpolation: str) -> tuple[dict[str, Callable], float]:
    """Return functions that compose a pair in every way, and the megapixels of a panorama."""
    equal, unlike = synthetic_pair(*size), synthetic_pair(*size, UNLIKE)
    # Each way has pictures of its own: they come from memory, as those of a camera do.
    ways = {}
    for blend in BLENDS:
        ways[blend], _ = composing(equal, blend, interpolation, gain=False)
    ways['feather, gain'], _ = composing(unlike, 'feather', interpolation, gain=True)
    compositor = compositor_of(equal, 'feather', interpolation, gain=False)
    layout, surface = compositor.layout, compositor.layout.surface
    panorama = np.empty((surface.height, surface.width, 3), np.uint8)
    other = panorama.copy()
    ways['memcpy'] = lambda: np.copyto(panorama, other)
    ways['floor'] = floor(equal, compositor.views, interpolation)
    ways['one remap'] = one_remap(equal, compositor.views, layout, interpolation, panorama)
    ways['naive'] = naive(equal, compositor.views, layout, interpolation, panorama)
    return {way: ways[way] for way in WAYS}, surface.width * surface.height / 1e6


def compositor_of(pair: ImagePair, blend: str, interpolation: str, gain: bool) -> Compositor:
    """Build the product's compositor."""
    settings = PanoramaSettings(blend=blend, interpolation=interpolation, gain_compensation=gain)
    return pair.stitcher(settings).compositor(settings, pair.images)


def composing(pair: ImagePair, blend: str, interpolation: str, gain: bool):
    """Return a function that composes a pair, and the array (height, width, 3) that it fills."""
    compositor = compositor_of(pair, blend, interpolation, gain)
    surface = compositor.layout.surface
    out = np.empty((surface.height, surface.width, 3), np.uint8)
    images = own(pair)
    return lambda: compositor.compose(images, out), out


def own(pair: ImagePair) -> list[np.ndarray]:
    """Return copies of a pair's pictures."""
    return [image.copy() for image in pair.images]


def floor(pair: ImagePair, views: Sequence[View], interpolation: str) -> Callable[[], None]:
    """Correct both whole frames."""
    tables = [fixed(positions(view.source, view.surface), interpolation) for view in views]
    outs = [np.empty((v.surface.height, v.surface.width, 3), np.uint8) for v in views]
    images = own(pair)

    def correct():
        for image, table, out in zip(images, tables, outs, strict=True):
            cv2.remap(image, *table, FLAGS[interpolation], dst=out)

    return correct


def one_remap(pair: ImagePair, views, layout: Layout, interpolation: str, out: np.ndarray):
    """Draw the whole panorama at once."""
    middle = sum(layout.seams[0]) // 2
    parts = [
        shown_by(view, layout, *columns)
        for view, columns in zip(views, ((0, middle), (middle, out.shape[1])), strict=True)
    ]
    parts[1][..., 1] += len(pair.images[0])
    table = fixed(np.concatenate(parts, axis=1), interpolation)
    stacked = np.vstack(pair.images)
    return lambda: cv2.remap(stacked, *table, FLAGS[interpolation], dst=out)


def naive(pair: ImagePair, views, layout: Layout, interpolation: str, out: np.ndarray):
    """Draw what shows of each view, and feather where both do."""
    begin, end = layout.seams[0]
    tables = [
        fixed(shown_by(view, layout, *layout.drawn(i)), interpolation)
        for i, view in enumerate(views)
    ]
    right = np.empty((len(out), out.shape[1] - begin, 3), np.uint8)
    images = own(pair)
    ramp = np.tile((np.arange(end - begin, dtype=np.float32) + 0.5) / (end - begin), (len(out), 1))

    def compose():
        cv2.remap(images[0], *tables[0], FLAGS[interpolation], dst=out[:, :end])
        cv2.remap(images[1], *tables[1], FLAGS[interpolation], dst=right)
        strip = out[:, begin:end]
        cv2.blendLinear(strip, right[:, : end - begin], 1 - ramp, ramp, dst=strip)
        out[:, end:] = right[:, end - begin :]

    return compose


def shown_by(view: View, layout: Layout, begin: int, end: int) -> np.ndarray:
    """Where in a view's picture the pixels of some columns of the panorama come from."""
    window = layout.surface.window(begin, 0, end - begin, layout.surface.height)
    return positions(view.source, window, view.attitude)


def positions(lens: Lens, surface: Surface, attitude: Attitude = LEVEL) -> np.ndarray:
    """(height, width, 2) float32: where in the picture each pixel of a surface comes from."""
    y, x = np.ogrid[: surface.height, : surface.width]
    pixels, seen = lens.project(surface.rays(x, y) @ attitude.matrix)
    return np.where(seen[..., None], pixels, -100).astype(np.float32)


def fixed(where: np.ndarray, interpolation: str) -> tuple[np.ndarray, np.ndarray | None]:
    """Return fixed-point maps."""
    nearest = interpolation == 'nearest'
    pixels, fractions = cv2.convertMaps(where, None, cv2.CV_16SC2, nninterpolation=nearest)
    return pixels, None if nearest else fractions
