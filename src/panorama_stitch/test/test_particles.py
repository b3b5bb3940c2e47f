import cv2
import numpy as np
import pytest

from panorama_stitch.overlap.particles import (
    analyse,
    cluster_thresholds,
    facing_halves,
    measure,
    open_binary,
    remove_small,
    scaled,
)


def blank(width=60, height=40):
    return np.zeros((height, width), np.uint8)


@pytest.mark.parametrize('width', [526, 527])
def test_halves_face_each_other_and_are_equally_wide(width):
    columns = np.tile(np.arange(width), (3, 1))
    left, right = facing_halves(columns, columns)
    assert left.shape[1] == right.shape[1] == 263
    assert left[0, -1] == width - 1
    assert right[0, 0] == 0


def test_two_classes_are_parted_between_their_centres_of_mass():
    grey = blank()
    grey[:] = 40
    grey[10:20] = 200
    assert cluster_thresholds(grey) == (120.0,)


def test_three_classes():
    grey = np.repeat([10, 100, 250], 30).astype(np.uint8).reshape(9, 10)
    assert cluster_thresholds(grey, 3) == (55.0, 175.0)


def test_a_picture_of_one_level_has_nothing_above_its_threshold():
    grey = np.full((4, 4), 90, np.uint8)
    assert not (grey > cluster_thresholds(grey)[-1]).any()


def test_opening_drops_thin_edges_and_detaches_particles():
    binary = blank()
    binary[5:15, 5:15] = binary[5:15, 20:30] = 1
    binary[10, 15:20] = 1
    opened = open_binary(binary)
    assert len(analyse(opened)) == 2
    assert not opened[10, 15:20].any()


def test_what_survives_the_erosions_keeps_its_full_shape():
    binary = blank(100, 80)
    cv2.rectangle(binary, (10, 10), (40, 40), 1, -1)
    binary[20:22, 41:50] = 1  # a spike that erosion alone would lose
    binary[60:70, 60:75] = 1  # too small for nine erosions
    kept = remove_small(binary, erosions=9)
    assert np.array_equal(kept[:55], binary[:55])
    assert not kept[55:].any()


def test_no_erosion_keeps_everything():
    binary = blank()
    binary[3, 3] = 1
    assert np.array_equal(remove_small(binary, erosions=0), binary)


def test_ten_properties():
    binary = blank(10, 8)
    binary[2, 5:8] = 1
    binary[3, 4:8] = 1
    (particle,) = analyse(binary)
    assert (particle.first_pixel_x, particle.first_pixel_y) == (5, 2)
    assert (particle.left, particle.top, particle.right, particle.bottom) == (4, 2, 8, 4)
    assert particle.area == 7
    assert particle.area_percent == pytest.approx(100 * 7 / 80)
    assert particle.center_x == pytest.approx((5 + 6 + 7 + 4 + 5 + 6 + 7) / 7)
    assert particle.center_y == pytest.approx((3 * 2 + 4 * 3) / 7)


def test_corners_that_touch_join():
    binary = blank()
    binary[4, 4] = binary[5, 5] = 1
    assert len(analyse(binary)) == 1


def test_nothing_has_no_particles():
    assert analyse(blank()) == ()


def test_the_largest_come_first_where_a_number_is_given():
    binary = blank()
    binary[2:4, 2:4] = 1
    binary[10:20, 10:20] = 1
    binary[30, 30] = 1
    assert measure(binary, most=2)[:, 8].tolist() == [100, 4]


def test_properties_of_a_reduced_picture_in_px_of_the_picture():
    small = blank(20, 10)
    small[3:5, 4:7] = 1
    large = cv2.resize(small, None, fx=3, fy=3, interpolation=cv2.INTER_NEAREST)
    assert scaled(measure(small), 3) == pytest.approx(measure(large))
