"""Flow between views whose parallax is constructed."""

import cv2
import numpy as np
import pytest

from panorama_stitch.compose.blend import Feather
from panorama_stitch.compose.disparity import Disparity
from panorama_stitch.compose.flow import Flow

HEIGHT, WIDTH = 300, 112
FADE = 52, 60
EVERYWHERE = np.ones((HEIGHT, WIDTH), bool)
NOISE = 2.0
CHROMA = 100.0
"""Grey levels by which red exceeds green in the thing, and nowhere else."""
FAITHFUL_DB = 30.0
"""Bilinear interpolation of textures as fine as these stays above it."""
GAIN_DB = 5.0
SHOWN = 0.8, 1.15
"""The share of a thing that is seen: it is squeezed by 12 px in 112, and its outlines waver."""
STRAIGHT_PX = 0.8
POST_SHOWN = 0.7, 1.1
"""A post is displaced by a fifth of the overlap at most, and squeezed by as much."""
COMING_BACK = 30
"""Frames in which flow fades in again."""
STEADY = 1.1
MOST_PIXELS = 168 * 150
SAME_LEVELS = 3
"""At its edges a view has hardly been warped."""


def texture(seed, width=WIDTH):
    """Grey, of details from 4 to 30 px, 60 to 200."""
    rng = np.random.default_rng(seed)
    total = np.zeros((HEIGHT, width), np.float32)
    for sigma in (2, 5, 15):
        noise = rng.normal(0, sigma, total.shape).astype(np.float32)
        total += cv2.GaussianBlur(noise, (0, 0), sigma)
    total = 130 + total * (25 / total.std())
    return cv2.merge([total.round().clip(60, 200).astype(np.uint8)] * 3)


def moved(by_px, seed=1):
    """Two views of something flat: what is at p in the left one is at p - by_px in the right."""
    wide = texture(seed, WIDTH + 100)
    return wide[:, 50 : 50 + WIDTH].copy(), wide[:, 50 + by_px : 50 + by_px + WIDTH].copy()


def with_a_thing(at, by_px, width=36):
    """Two views of a far wall and a near thing, whose middle is at `at` seen from midway."""
    views = []
    for middle in (at + by_px / 2, at - by_px / 2):
        view = texture(2)
        begin = round(middle - width / 2)
        thing = texture(3)[60:240, 10 : 10 + width] + np.float32([0, -CHROMA / 2, CHROMA / 2])
        view[60:240, begin : begin + width] = thing.clip(0, 255)
        views.append(view)
    return views


def with_a_post(at, by_px, width=12):
    """Two views of a far wall and of a plain post before it, which is displaced by its width."""
    views = []
    for middle in (at + by_px / 2, at - by_px / 2):
        view = texture(2)
        begin = round(middle - width / 2)
        view[60:, begin : begin + width] = np.uint8([130, 80, 180])
        views.append(view)
    return views


def strayed(image):
    """How far the edges of a post stray from upright, px, root mean square."""
    share = (np.float32(image[70:, :, 2]) - image[70:, :, 1]) / CHROMA
    share[share < 5 * NOISE / CHROMA] = 0
    widths = share.sum(axis=1)
    middles = share @ np.arange(WIDTH) / widths
    return max(np.std(middles - widths / 2), np.std(middles + widths / 2))


def shown(image, width=36):
    """Share of the thing that a picture shows."""
    return float((np.float32(image[..., 2]) - image[..., 1]).sum()) / (CHROMA * 180 * width)


def noisy(image, seed):
    noise = np.random.default_rng(seed).normal(0, NOISE, image.shape)
    return (image + noise).round().clip(0, 255).astype(np.uint8)


def blended(blend, left, right, **options):
    out = right.copy()
    blend(left.copy(), out, **options)
    return out


def feather():
    return Feather(EVERYWHERE, EVERYWHERE, FADE)


def flow():
    return Flow(EVERYWHERE, EVERYWHERE, FADE)


def psnr(a, b):
    return 10 * np.log10(255**2 / max(np.mean((np.float32(a) - b) ** 2), 1e-6))


@pytest.mark.parametrize('by_px', [-10, 5, 12, 20])
@pytest.mark.parametrize('channels', [np.s_[...], np.s_[..., 0]])
def test_views_are_warped_by_their_share_of_the_way(by_px, channels):
    left, right = (np.ascontiguousarray(view[channels]) for view in moved(by_px))
    # At x, t of the way, is what the left view shows at x + t by_px.
    x = np.arange(WIDTH, dtype=np.float32)
    source = 50 + x + (x + 0.5) / WIDTH * by_px
    rows = np.arange(HEIGHT, dtype=np.float32)
    wide = np.ascontiguousarray(texture(1, WIDTH + 100)[channels])
    truth = cv2.remap(wide, *np.float32(np.meshgrid(source, rows)), cv2.INTER_LINEAR)
    # What one view alone shows at the sides is beyond the other's edge.
    inner = np.s_[10:-10, abs(by_px) : -abs(by_px)]
    ours, faded = blended(flow(), left, right), blended(feather(), left, right)
    assert psnr(ours[inner], truth[inner]) > FAITHFUL_DB
    assert psnr(faded[inner], truth[inner]) < psnr(ours[inner], truth[inner]) - GAIN_DB


def test_at_the_edges_the_picture_is_that_of_one_camera():
    left, right = moved(12)
    out = blended(flow(), left, right).astype(int)
    assert np.abs(out[:, 0] - left[:, 0]).max() <= SAME_LEVELS
    assert np.abs(out[:, -1] - right[:, -1]).max() <= SAME_LEVELS


def test_a_near_thing_that_crosses_stays_whole():
    ours, faded = [], []
    blend = flow()
    for at in range(28, 86, 3):
        views = with_a_thing(at, 12)
        ours.append(shown(blended(blend, *views)))
        faded.append(shown(blended(feather(), *views)))
    assert SHOWN[0] <= min(ours) <= max(ours) <= SHOWN[1]
    assert min(faded) < SHOWN[0] - 0.1


@pytest.mark.parametrize('by_px', [8, 14, 20])
def test_a_post_stays_straight_and_whole(by_px):
    for at in range(30, 84, 6):
        views = [noisy(view, at) for view in with_a_post(at, by_px)]
        out = blended(flow(), *views)
        assert strayed(out) < STRAIGHT_PX, at
        assert POST_SHOWN[0] < shown(out, 12) * 180 / 240 < POST_SHOWN[1], at


def test_views_of_different_things_fade_unwarped():
    left, right = texture(5), texture(6)
    blend = flow()
    for _ in range(5):
        out = blended(blend, left, right)
    assert np.abs(out.astype(int) - blended(feather(), left, right)).max() <= 1


def test_still_pixels_do_not_crawl():
    views = with_a_thing(56, 12)
    changes = []
    for blend in (feather(), flow()):
        before, squares = None, []
        for i in range(20):
            out = np.float32(blended(blend, noisy(views[0], i), noisy(views[1], 100 + i)))
            if before is not None and i > 5:
                squares.append(np.mean((out - before) ** 2))
            before = out
        changes.append(np.sqrt(np.mean(squares)))
    assert changes[1] <= STEADY * changes[0]


def test_another_scene_is_followed_at_once():
    blend = flow()
    for _ in range(10):
        blended(blend, *moved(14, seed=1))
    left, right = moved(-6, seed=8)
    out = blended(blend, left, right)
    fresh = blended(flow(), left, right)
    assert psnr(out[10:-10, 15:-15], fresh[10:-10, 15:-15]) > FAITHFUL_DB


def test_economy_is_a_feather_from_which_flow_comes_back():
    left, right = moved(10)
    blend, target = flow(), blended(flow(), left, right)
    blended(blend, left, right)
    economical = blended(blend, left, right, economical=True)
    np.testing.assert_array_equal(economical, blended(feather(), left, right))
    distances = [np.abs(np.float32(economical) - target).mean()]
    for _ in range(COMING_BACK):
        out = blended(blend, left, right)
        distances.append(np.abs(np.float32(out) - target).mean())
    assert distances[1] > 0.5 * distances[0]
    assert distances[-1] < 0.1 * distances[0]


@pytest.mark.parametrize('by_px', [0, 10])
def test_no_black_comes_from_where_a_view_shows_nothing(by_px):
    left, right = moved(by_px)
    columns, rows = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    left_seen = columns < WIDTH - np.abs(rows - HEIGHT / 2) / 4
    right_seen = columns > np.abs(rows - HEIGHT / 2) / 4
    right_seen[100:120, 30:80] = False
    left[~left_seen], right[~right_seen] = 0, 0
    out = blended(Flow(left_seen, right_seen, FADE), left, right)
    assert out[left_seen | right_seen].min() >= 55
    alone = left_seen & ~cv2.dilate(right_seen.astype(np.uint8), np.ones((15, 15))).astype(bool)
    assert np.abs(out[alone].astype(int) - left[alone]).max() <= 1


@pytest.mark.parametrize('size', [(90, 1), (1, 8), (3, 5), (16, 16), (40, 300), (700, 30)])
def test_strips_of_any_size(size):
    seen, image = np.ones(size, bool), np.full(size, 50, np.uint8)
    assert (blended(Flow(seen, seen), image, image) == 50).all()


@pytest.mark.parametrize('fade', [(0, 0), (WIDTH, WIDTH), (0, WIDTH), (0, 8), (50, 50)])
def test_fades_anywhere_in_the_strip(fade):
    left, right = moved(0)
    out = blended(Flow(EVERYWHERE, EVERYWHERE, fade), left, right)
    assert np.abs(out.astype(int) - left).max() <= 1


def test_where_no_view_shows_anything_it_stays_black():
    nothing, image = np.zeros((90, 64), bool), np.zeros((90, 64, 3), np.uint8)
    assert not blended(Flow(nothing, nothing), image, image).any()


@pytest.mark.parametrize('size', [(117, 506), (234, 1009), (64, 2036), (900, 2000), (20, 300)])
def test_the_search_costs_about_the_same_whatever_the_size(size):
    disparity = Disparity(*size)
    assert disparity.width * disparity.height <= MOST_PIXELS
