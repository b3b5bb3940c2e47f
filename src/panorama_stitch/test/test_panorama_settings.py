"""Settings that do not belong together are refused with a sentence."""

from math import nan

import pytest

from fisheye_core.errors import SettingError
from panorama_stitch.pipeline.panorama_settings import PanoramaSettings

THREE = ('left', 'front/middle', 'right')


@pytest.mark.parametrize(
    ('values', 'sentence'),
    [
        ({'cameras': ()}, 'expected 1 to 8 different names'),
        ({'cameras': tuple('abcdefghi')}, 'expected 1 to 8 different names'),
        ({'cameras': ('left', 'left')}, 'expected 1 to 8 different names'),
        ({'cameras': ('left cam', 'right')}, "cameras has 'left cam'; expected a letter"),
        ({'cameras': ('left', '')}, "cameras has ''"),
        ({'offset_x_px': (500.0, 2.0)}, 'offset_x_px has 2 numbers; expected 1'),
        ({'cameras': THREE, 'offset_y_px': (1.0,)}, 'offset_y_px has 1 numbers; expected 2'),
    ],
)
def test_they_are_refused(values, sentence):
    with pytest.raises(SettingError, match=sentence):
        PanoramaSettings(**values)


def test_one_nan_stands_for_all_pairs():
    assert PanoramaSettings(cameras=THREE, offset_x_px=(nan,)).cameras == THREE
