import json
import re
from xml.etree import ElementTree

import cv2
import numpy as np
import pytest
from fisheye_msgs.msg import Projection

from fisheye_bridge.projection import surface_of
from fisheye_core.errors import FileAccessError, GeometryError
from fisheye_geometry.attitude import Attitude, quaternion
from fisheye_geometry.surface import Surface
from panorama_viewer.photo_sphere import gpano, on_sphere
from panorama_viewer.projection import StateHistory, turned
from panorama_viewer.snapshot import save

SURFACES = [
    Surface('cylindrical', 1200, 480, 215.0, 590.0, 250.0),
    Surface('equirectangular', 900, 400, 160.0, 450.0, 190.0),
    Surface('rectilinear', 700, 400, 300.0, 340.0, 210.0),
]
REAR_PX = 1200 / np.radians(270)
REAR = [
    Surface(kind, 1200, 480, REAR_PX, 599.5 - np.radians(middle_deg) * REAR_PX, 240.0)
    for kind, middle_deg in (('cylindrical', 180), ('equirectangular', 180), ('cylindrical', -200))
]
"""Around what is behind the robot."""
CLOSED = [
    Surface(kind, width, 300, width / (2 * np.pi), center_x_px, 140.0)
    for kind in ('cylindrical', 'equirectangular')
    for width, center_x_px in ((800, 399.5), (801, 400.0), (801, 250.0), (802, 400.5))
]
CLOSE_PX = 0.5
CLOSE_GREY = 4
"""JPEG, and one step of the waves to a sixteenth of a pixel."""
STAMP_NS = 1_700_000_000_250_000_000


def spotted(surface, direction):
    """Paint a panorama with a spot in a direction, a unit vector (3,)."""
    y, x = np.mgrid[: surface.height, : surface.width]
    rays = surface.rays(x, y)
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    near = np.clip((rays @ direction - np.cos(0.03)) / (1 - np.cos(0.03)), 0, 1)
    return np.repeat((near * 255).astype(np.uint8)[..., None], 3, axis=2)


def xmp(jpeg):
    """Return the GPano tags of a JPEG by walking its segments."""
    at = 2
    while jpeg[at : at + 2] != b'\xff\xda':
        length = int.from_bytes(jpeg[at + 2 : at + 4], 'big')
        content = jpeg[at + 4 : at + 2 + length]
        if content.startswith(b'http://ns.adobe.com/xap/1.0/\0'):
            packet = content.partition(b'\0')[2].decode()
            root = ElementTree.fromstring(re.sub(r'<\?.*?\?>', '', packet))
            (description,) = root.iter('{http://www.w3.org/1999/02/22-rdf-syntax-ns#}Description')
            return {key.partition('}')[2]: value for key, value in description.attrib.items()}
        at += 2 + length
    raise AssertionError('there is no XMP')


@pytest.mark.parametrize('surface', SURFACES, ids=lambda surface: surface.kind)
def test_a_direction_is_where_photo_sphere_viewers_look_for_it(surface):
    bearing, height = np.radians((25.0, 10.0))
    direction = np.array(
        [np.cos(height) * np.sin(bearing), -np.sin(height), np.cos(height) * np.cos(bearing)]
    )
    jpeg = gpano(spotted(surface, direction), surface)
    tags = xmp(jpeg)
    image = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_GRAYSCALE).astype(float)
    size = int(tags['CroppedAreaImageWidthPixels']), int(tags['CroppedAreaImageHeightPixels'])
    assert image.shape[::-1] == size
    assert tags['ProjectionType'] == 'equirectangular'
    around, upright = int(tags['FullPanoWidthPixels']), int(tags['FullPanoHeightPixels'])
    assert around == 2 * upright
    image[image < 40] = 0
    y, x = (np.average(axis, weights=image) for axis in np.indices(image.shape))
    x += int(tags['CroppedAreaLeftPixels']) + 0.5
    y += int(tags['CroppedAreaTopPixels']) + 0.5
    assert x == pytest.approx((0.5 + bearing / (2 * np.pi)) * around, abs=CLOSE_PX)
    assert y == pytest.approx((0.5 - height / np.pi) * upright, abs=CLOSE_PX)


@pytest.mark.parametrize('surface', SURFACES, ids=lambda surface: surface.kind)
def test_the_part_lies_within_the_sphere_and_is_covered(surface):
    part, left_px, top_px = on_sphere(surface)
    around_px = round(2 * np.pi * part.focal_px)
    assert min(left_px, top_px) >= 0
    assert left_px + part.width <= around_px
    assert top_px + part.height <= around_px // 2
    middle = part.height // 2
    row = np.full((surface.height, surface.width), 200, np.uint8)
    jpeg = gpano(row, surface)
    image = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_GRAYSCALE)
    assert image[middle].min() > 150, 'no black columns'
    assert image[:, round(part.center_x_px)].min() > 150, 'no black rows'


@pytest.mark.parametrize('nod', [None, Attitude(0.0, 0.1, -0.1)], ids=['level', 'nodding'])
@pytest.mark.parametrize('surface', REAR)
def test_what_is_behind_the_robot_is_at_both_sides_of_the_sphere(surface, nod):
    bearings = np.radians((-165.0, 150.0))
    image = np.zeros((surface.height, surface.width, 3), np.uint8)
    for bearing in bearings:
        direction = np.array([np.sin(bearing), 0.0, np.cos(bearing)])
        image |= spotted(surface, nod.matrix.T @ direction if nod else direction)
    jpeg = gpano(image, surface, orientation=quaternion(nod) if nod else None)
    full_px = int(xmp(jpeg)['FullPanoWidthPixels'])
    sphere = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_GRAYSCALE).astype(float)
    assert sphere.shape[1] == full_px
    sphere[sphere < 40] = 0
    for bearing in bearings:
        true_px = (0.5 + bearing / (2 * np.pi)) * full_px
        near = slice(round(true_px) - 20, round(true_px) + 20)
        columns = np.arange(full_px)[near] + 0.5
        assert np.average(columns, weights=sphere[:, near].sum(axis=0)) == pytest.approx(
            true_px, abs=CLOSE_PX
        )
    white = np.full_like(image, 255)
    jpeg = gpano(white, surface)
    seen = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_GRAYSCALE)[120:360] > 128
    assert seen.all(axis=0).sum() == pytest.approx(surface.width, abs=2)
    assert not seen.any(axis=0).all(), 'black where no camera looks'


def test_frames_side_by_side_are_refused_as_a_photo_sphere(tmp_path):
    surface = Surface('equirectangular', 1200, 500, 180.0, 600.0, 250.0)
    with pytest.raises(GeometryError, match='is 382 degrees wide'):
        save(tmp_path / 'here', 'gpano', np.zeros((500, 1200)), surface, STAMP_NS)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize('surface', CLOSED, ids=lambda s: f'{s.kind} {s.width} {s.center_x_px}')
def test_a_closed_panorama_is_all_around_the_sphere(surface):
    def waves(bearing_rad):
        return 128 + 90 * np.cos(20 * bearing_rad + 1)

    columns = np.arange(surface.width)
    row = waves((columns - surface.center_x_px) / surface.focal_px)
    image = np.broadcast_to(row, (surface.height, surface.width)).astype(np.uint8)
    jpeg = gpano(image, surface, wraps=True)
    tags = xmp(jpeg)
    full_px = int(tags['FullPanoWidthPixels'])
    assert abs(full_px - surface.width) <= 1
    assert int(tags['CroppedAreaImageWidthPixels']) == full_px
    assert int(tags['CroppedAreaLeftPixels']) == 0
    sphere = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_GRAYSCALE)
    true = waves((np.arange(full_px) + 0.5) / full_px * 2 * np.pi - np.pi)
    assert abs(sphere[len(sphere) // 2] - true).max() < CLOSE_GREY


def test_a_png_has_its_projection_beside_it(tmp_path):
    surface = SURFACES[0]
    image = np.random.default_rng(1).integers(0, 255, (480, 1200, 3), np.uint8)
    paths = save(tmp_path / 'new' / 'here.jpg', 'png', image, surface, STAMP_NS, True)
    assert paths == [tmp_path / 'new' / 'here.png', tmp_path / 'new' / 'here.json']
    np.testing.assert_array_equal(cv2.imread(str(paths[0])), image)
    described = json.loads(paths[1].read_text())
    message = Projection(**described['projection'])
    assert (surface_of(message), message.wraps) == (surface, True)
    assert (described['image'], described['stamp_ns']) == ('here.png', STAMP_NS)
    assert described['taken'] == '2023-11-14T22:13:20.250000+00:00'


def test_a_gpano_file_is_one_jpeg(tmp_path):
    image = np.zeros((480, 1200), np.uint8)
    (path,) = save(tmp_path / 'here', 'gpano', image, SURFACES[0], STAMP_NS)
    assert path == tmp_path / 'here.jpg'
    assert xmp(path.read_bytes())['UsePanoramaViewer'] == 'True'


@pytest.mark.parametrize(
    ('given', 'expected'),
    [
        ('v1.2', 'v1.2.png'),
        ('v1.2.JPEG', 'v1.2.png'),
        ('.', 'panorama.png'),
        ('folder', 'folder/panorama.png'),
    ],
)
def test_only_the_suffix_of_a_picture_is_replaced(tmp_path, given, expected):
    (tmp_path / 'folder').mkdir()
    image = np.zeros((480, 1200, 3), np.uint8)
    picture, description = save(tmp_path / given, 'png', image, SURFACES[0], STAMP_NS)
    assert picture == tmp_path / expected
    assert description == picture.with_suffix('.json')


def test_a_file_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / 'file').touch()
    with pytest.raises(FileAccessError, match=r'file/here\.png cannot be written'):
        save(tmp_path / 'file' / 'here', 'png', np.zeros((480, 1200)), SURFACES[0], STAMP_NS)


@pytest.mark.parametrize('surface', SURFACES[:2], ids=lambda surface: surface.kind)
def test_a_panorama_of_a_robot_that_nods_is_saved_level(surface):
    nod = Attitude(*np.radians((0.0, 9.0, -4.0)))
    y, x = np.ogrid[: surface.height, : surface.width]
    height = -(surface.rays(x, y) @ nod.matrix.T)[..., 1]
    image = np.where(height > 0, 200, 60).astype(np.uint8)
    jpeg = gpano(image, surface, orientation=quaternion(nod))
    tags = xmp(jpeg)
    sphere = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_GRAYSCALE)
    horizon = int(tags['FullPanoHeightPixels']) // 2 - int(tags['CroppedAreaTopPixels'])
    inner = slice(round(0.2 * sphere.shape[1]), round(0.8 * sphere.shape[1]))
    assert (sphere[horizon - 20 : horizon - 1, inner] > 150).all()
    assert (sphere[horizon + 1 : horizon + 20, inner] < 110).all()
    assert (sphere[[0, -1]] < 30).mean() > 0.5, 'all that it covers, up to its tips'


def test_the_orientation_is_beside_a_png(tmp_path):
    nod = quaternion(Attitude(0.0, 0.2, 0.1))
    image = np.zeros((480, 1200, 3), np.uint8)
    paths = save(tmp_path / 'here', 'png', image, SURFACES[0], STAMP_NS, False, nod)
    told = json.loads(paths[1].read_text())['projection']['orientation']
    assert [told[axis] for axis in 'xyzw'] == pytest.approx(list(nod))


def test_a_picture_gets_the_state_of_its_stamp():
    history = StateHistory()
    assert history.at(5) is None
    for stamp_ns, state in ((10, 'a'), (20, 'b')):
        history.add(stamp_ns, state)
    assert [history.at(stamp_ns) for stamp_ns in (10, 15, 20, 99)] == ['a', 'a', 'b', 'b']
    assert history.at(5) == 'b', 'a recording that begins again: the newest'


@pytest.mark.parametrize('given', [(0, 0, 0, 1), (0, 0, 0, -1), (0, 0, 0, 0), (np.nan, 0, 0, 1)])
def test_a_level_panorama_is_not_turned(given):
    assert turned(*map(float, given)) is None
