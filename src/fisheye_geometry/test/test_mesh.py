"""Tables through a mesh, beside those of every pixel."""

import numpy as np
import pytest

from fisheye_geometry.attitude import Attitude
from fisheye_geometry.lens import FisheyeLens
from fisheye_geometry.mesh import Mesh, MeshTable
from fisheye_geometry.remap import RemapTable
from fisheye_geometry.surface import Surface

LENS = FisheyeLens(640, 480, 215.0, 215.0, 319.5, 239.5, (-0.02, 0.004, -0.001, 0.0001))
NEAR_PX = 0.05
"""What a mesh bends the picture by, at most."""
STEP_PX = 8


def coordinates():
    """Return a picture of 16-bit column and row numbers, in units that survive interpolation."""
    y, x = np.mgrid[: LENS.height, : LENS.width]
    return np.dstack([x, y]).astype(np.float32)


@pytest.mark.parametrize('size', [(640, 480), (333, 97), (8, 8), (5, 3)])
def test_a_plane_is_interpolated_exactly(size):
    mesh = Mesh(*size)
    y, x = np.ogrid[: size[1], : size[0]]
    assert mesh.spread(2 * mesh.x_px - mesh.y_px) == pytest.approx(2.0 * x - y, abs=1e-3)


@pytest.mark.parametrize('yaw_deg', [0, 30, 80])
def test_it_is_the_table_of_every_pixel_but_for_its_edge(yaw_deg):
    plane = Surface('rectilinear', 640, 480, 320.0, 319.5, 239.5)
    attitude = Attitude(*np.radians([-yaw_deg, 10, 5]))
    exact = RemapTable(LENS, plane, 'linear', attitude)
    quick = MeshTable(LENS, plane, 'linear', attitude)
    assert not (quick.valid & ~exact.valid).any()
    missing = (exact.valid & ~quick.valid).sum(axis=1)
    assert missing.max() <= 3 * STEP_PX
    inner = quick.valid & exact.valid
    apart = np.abs(quick(coordinates()) - exact(coordinates()))[inner]
    assert np.percentile(apart, 99) < NEAR_PX + 1 / 32, 'and the fixed point of the exact one'


def test_a_part_is_that_part():
    plane = Surface('rectilinear', 64, 48, 32.0, 31.5, 23.5)
    table = MeshTable(LENS, plane, 'linear', Attitude())
    image = np.random.default_rng(1).integers(0, 255, (480, 640, 3)).astype(np.uint8)
    rows, columns = slice(5, 40), slice(10, 20)
    np.testing.assert_array_equal(table.part(rows, columns)(image), table(image)[rows, columns])
