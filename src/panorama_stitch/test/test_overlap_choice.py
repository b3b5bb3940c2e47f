"""Which overlaps of a ring are used where some were found before and others now."""

import numpy as np
import pytest
from pipeline_line import LENS, SETTINGS

from fisheye_geometry.attitude import Attitude
from panorama_stitch.overlap.overlap_result import Overlap, side_by_side
from panorama_stitch.pipeline.overlap_choice import kept

LENS_SURFACE = SETTINGS.surface_of(LENS)


def overlaps_of(found, yaw_deg):
    """Return overlaps of which those are found whose letter is T."""
    attitude = Attitude(yaw_rad=np.radians(yaw_deg))
    return [
        Overlap('particles', True, attitude=attitude)
        if letter == 'T'
        else side_by_side(LENS_SURFACE, 'particles', '')
        for letter in found
    ]


@pytest.mark.parametrize(
    ('measured', 'former', 'measured_deg', 'asked', 'tried_again'),
    [
        ('TFT', '', 90, 'nnn', 'nnn'),
        ('TTTF', 'TFT', 90, 'nnnn', 'onon'),
        ('TTTF', 'TTTF', 90, 'nnnn', 'ooon'),
        ('TTTT', 'TTTF', 90, 'nnnn', 'ooon'),
        ('TTTT', 'TFT', 90, 'nnnn', 'onon'),
        ('TTTF', 'TTTT', 90, 'nnno', 'oooo'),
        ('TFT', 'TTTT', 90, 'nono', 'oooo'),
        ('FFF', 'TTTT', 90, 'oooo', 'oooo'),
        ('TTT', 'TFTF', 90, 'nnn', 'ono'),
        # Rotations of two measurements that do not lead around leave a ring without its closing
        # one; those of one measurement stay, and the rig tells it.
        ('TTTF', 'TTTT', 92, 'nnnn', 'oooo'),
        ('TFT', 'TTTT', 92, 'non', 'oooo'),
        ('TTTT', 'TTTF', 94, 'nnnn', 'oooo'),
        ('TTTT', 'TFT', 94, 'nnnn', 'ono'),
    ],
)
def test_of_each_pair_is_kept_what_was_found(measured, former, measured_deg, asked, tried_again):
    new, old = overlaps_of(measured, measured_deg), overlaps_of(former, 90)
    for prefers_former, expected in ((False, asked), (True, tried_again)):
        result = kept(new, old, 4, prefers_former=prefers_former)
        sources = [{'n': new, 'o': old}[letter][at] for at, letter in enumerate(expected)]
        assert list(map(id, result)) == list(map(id, sources))
