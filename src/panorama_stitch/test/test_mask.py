"""Masks: white is the robot, and sizes have to fit."""

import cv2
import numpy as np
import pytest

from fisheye_core.errors import ImageFormatError, SourceError
from panorama_stitch.compose.mask import read_mask


@pytest.fixture
def mask_file(tmp_path):
    path = tmp_path / 'mask.png'
    picture = np.zeros((20, 30), np.uint8)
    picture[12:, :] = 255
    cv2.imwrite(str(path), picture)
    return path


def test_white_is_the_robot(mask_file):
    mask = read_mask(mask_file, 30, 20)
    assert mask[12:].all()
    assert not mask[:12].any()


def test_another_size_is_refused(mask_file):
    with pytest.raises(ImageFormatError, match='has 30x20 px; expected 40x20 px, as the pictures'):
        read_mask(mask_file, 40, 20)


def test_no_picture_is_refused(tmp_path):
    with pytest.raises(SourceError, match=r'nothing\.png cannot be read'):
        read_mask(tmp_path / 'nothing.png', 30, 20)
