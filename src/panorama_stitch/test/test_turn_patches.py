import cv2
import numpy as np
import pytest

from panorama_stitch.turn.patches import HALF_PX, find_patch, zoomed

PLACE = np.array([100.3, 90.6])
MIDDLE = np.array([120.0, 110.0])
SHEAR = np.array([[0.88, 0.06], [-0.04, 1.03]])
"""As much as a wall of a corridor changes from 20 cm aside."""
OFF_PX = 0.05


@pytest.fixture(scope='module')
def pictures():
    """A texture, and the same one sheared and stretched about a place."""
    rng = np.random.default_rng(0)
    texture = cv2.GaussianBlur(rng.normal(0, 1, (240, 240)), (0, 0), 2.5)
    texture = (128 + 40 * texture / texture.std()).clip(0, 255).astype(np.uint8)
    to_other = np.column_stack([SHEAR, PLACE - SHEAR @ MIDDLE])
    return texture, cv2.warpAffine(texture, to_other, (240, 240), flags=cv2.INTER_CUBIC)


def off_px(pictures, **options) -> float:
    texture, other = pictures
    patch = zoomed(texture, MIDDLE, 1.0)
    return float(np.linalg.norm(find_patch(other, PLACE, patch, 4, 0.8, **options) - PLACE))


def test_a_sheared_patch_is_found_where_it_is(pictures):
    assert off_px(pictures, sheared=True) < OFF_PX < off_px(pictures, sheared=False)


def test_what_is_elsewhere_or_plain_is_not_found(pictures):
    texture, other = pictures
    patch = zoomed(texture, np.array([60.0, 180.0]), 1.0)
    assert find_patch(other, PLACE, patch, 4, 0.8, sheared=True) is None
    plain = np.full((2 * HALF_PX + 1,) * 2, 90, np.uint8)
    assert find_patch(other, PLACE, plain, 4, 0.0, sheared=True) is None
    assert find_patch(other, np.array([3.0, 3.0]), patch, 4, 0.0, sheared=True) is None
