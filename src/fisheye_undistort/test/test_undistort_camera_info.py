"""The undistort node and what camera_info tells it: parts of a sensor, and nonsense."""

import pytest
from sensor_msgs.msg import RegionOfInterest
from undistort_bench import LENS

from fisheye_bridge.projection import surface_of
from fisheye_geometry.lens import make_lens
from fisheye_undistort.undistort_settings import UndistortSettings


@pytest.mark.parametrize(
    'wrong',
    [
        {'k': [0.0] * 9},
        {'k': [float('nan')] * 9},
        {'distortion_model': 'unheard_of'},
        {'d': [0.1, 0.2]},
        {'width': 0},
        {'width': 320, 'height': 240},
        {'k': [1e300, 0.0, 79.5, 0.0, 1e300, 59.5, 0.0, 0.0, 1.0]},
        {'binning_x': 4},
    ],
)
def test_a_nonsense_camera_info_leaves_the_good_one_in_use(make_bench, wrong):
    bench = make_bench()
    bench.until(lambda: bench.pictures, 'a picture')
    bench.pictures.clear()
    bench.until(lambda: len(bench.pictures) > 3, 'pictures still', **wrong)
    bench.until(
        lambda: len(bench.pictures) > 6 and bench.projections, 'pictures with the good one again'
    )
    assert len(bench.projections) == 1


def test_a_binned_and_cropped_camera_is_corrected_like_the_whole_one(make_bench):
    whole = make_lens(
        'equidistant', 400, 300, [108, 0, 209.5, 0, 108, 149.5, 0, 0, 1], [0, 0, 0, 0]
    )
    roi = RegionOfInterest(x_offset=50, y_offset=30, width=320, height=240)
    bench = make_bench()
    bench.until(
        lambda: bench.pictures and bench.projections,
        'a corrected picture',
        lens=whole,
        binning_x=2,
        binning_y=2,
        roi=roi,
    )
    assert surface_of(bench.projections[-1]) == UndistortSettings().surface_of(LENS)


def test_a_binning_that_does_not_fit_the_pictures_is_named(make_bench):
    bench = make_bench()
    bench.until(lambda: bench.pictures, 'a picture')
    bench.until(lambda: bench.told(), 'the refusal', binning_x=4)
    assert bench.told() == (
        'camera_info refused: 40x120 px (160x120 px with binning 4x1, roi all at (0, 0)) do not '
        'fit the pictures, which have 160x120 px'
    )


def test_a_lens_that_ends_within_its_pictures_is_told(make_bench):
    ending = make_lens(
        'equidistant', 160, 120, [60, 0, 79.5, 0, 60, 59.5, 0, 0, 1], [-0.45, 0, 0, 0]
    )
    bench = make_bench()
    bench.until(lambda: 'ends' in bench.told(), 'the note', lens=ending)
    assert 'camera_info: the distortion of the lens ends 49.3 degrees off its axis' in bench.told()
