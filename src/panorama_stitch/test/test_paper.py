"""The published procedure against its worked example, and step by step on constructed pictures."""

import numpy as np
import pytest

from panorama_stitch.overlap.paper import (
    find_match,
    match_particles,
    mean_differences,
    offset_x,
    paper_particles,
)
from panorama_stitch.overlap.particles import Particle

LEFT = Particle(106.07, 170.12, 79, 115, 0, 115, 230, 217, 18974, 32.06)
RIGHT_A = Particle(160.59, 31.95, 4, 0, 4, 0, 263, 111, 12259, 20.72)
RIGHT_B = Particle(148.41, 172.44, 258, 114, 16, 114, 263, 221, 22285, 37.66)
FRAME_WIDTH = 526
DEFAULTS = {'classes': 2, 'opening': 3, 'erosions': 9}


def test_worked_example():
    differences = mean_differences([LEFT], [RIGHT_A, RIGHT_B])[0]
    assert differences == pytest.approx([736.703, 359.526], abs=5e-4)
    match = match_particles([LEFT], [RIGHT_A, RIGHT_B])
    assert (match.left, match.right) == (0, 1)
    assert match.min_correlation_value == pytest.approx(359.526, abs=5e-4)
    assert (LEFT.center_x + RIGHT_B.center_x) / 2 == pytest.approx(127.24)
    assert offset_x(FRAME_WIDTH, LEFT, RIGHT_B) == 390


@pytest.mark.parametrize('sides', [([], [RIGHT_A]), ([LEFT], []), ([], [])])
def test_a_side_without_particles_has_no_match(sides):
    assert match_particles(*sides) is None


def test_particles_are_the_brightest_class():
    half = np.full((60, 80), 30, np.uint8)
    half[10:40, 10:40] = 120
    half[20:50, 45:75] = 220
    assert len(paper_particles(half, classes=2)) == 1
    (brightest,) = paper_particles(half, classes=3)
    assert (brightest.left, brightest.right) == (45, 75)


def test_the_whole_procedure_uses_the_facing_halves():
    left, right = np.full((2, 100, 200), 20, np.uint8)
    left[30:60, 140:180] = 200  # columns 40 to 80 of the right half
    left[30:60, 10:60] = 200  # in the half that faces away
    right[30:60, 20:60] = 200
    left_particles, right_particles, match = find_match(left, right, **DEFAULTS)
    assert len(left_particles) == len(right_particles) == 1
    assert left_particles[0].center_x == pytest.approx(59.5)
    assert right_particles[0].center_x == pytest.approx(39.5)
    x = offset_x(200, left_particles[match.left], right_particles[match.right])
    assert x == 100 + 49  # (59.5 + 39.5) / 2 = 49.5: whole pixels, as in the example


def test_flat_pictures_have_no_match():
    flat = np.full((50, 80), 128, np.uint8)
    assert find_match(flat, flat, **DEFAULTS) == ((), (), None)
