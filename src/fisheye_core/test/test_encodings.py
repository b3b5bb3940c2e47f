"""Every encoding to every other one, on a colour whose values are known in each."""

from itertools import product

import numpy as np
import pytest

from fisheye_core.encodings import CHANNELS, converted

# Luma after ITU-R BT.601, as OpenCV rounds it: 0.299 R + 0.587 G + 0.114 B.
PIXELS = {'bgr8': (10, 20, 30), 'rgb8': (30, 20, 10), 'mono8': 22}


@pytest.mark.parametrize(('encoding', 'wanted'), [*product(CHANNELS, repeat=2)])
def test_a_picture_in_another_encoding(encoding, wanted):
    shape = (4, 6) if CHANNELS[encoding] == 1 else (4, 6, 3)
    image = np.full(shape, PIXELS[encoding], np.uint8)
    changed = converted(image, encoding, wanted)
    expected = (22, 22, 22) if encoding == 'mono8' != wanted else PIXELS[wanted]
    np.testing.assert_array_equal(changed[3, 5], expected)
    assert (changed is image) == (encoding == wanted)
