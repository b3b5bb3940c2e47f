"""Whatever is legal draws a panorama or is refused with a sentence: nothing ends the process."""

import os
import random
from collections import Counter
from dataclasses import replace
from math import nan

import numpy as np
import pytest

from fisheye_capture.scene import Scene
from fisheye_capture.synthetic import synthetic_lens
from fisheye_core.errors import FisheyeError
from fisheye_core.settings import rules
from fisheye_geometry.attitude import Attitude
from fisheye_geometry.level import Mount
from panorama_stitch.compose.blends import BLENDS
from panorama_stitch.compose.virtual_view import VirtualView
from panorama_stitch.pipeline.panorama_settings import PanoramaOutputSettings, PanoramaSettings
from panorama_stitch.pipeline.rig_measurement import measure_overlaps
from panorama_stitch.pipeline.rig_state import RigState
from panorama_stitch.pipeline.view_settings import ViewSettings

CHANGES = 5000 if os.environ.get('LONG') else 1000
LENS = synthetic_lens(96, 72, np.radians(170))
YAW = np.radians(140)
MEASURED = 0.02
"""Share of the changes after which the overlap is measured too."""
DRAWN = 0.5
"""Of the changes, at least: the rest asks for what no surface can hold."""
LARGEST_PX = 1e9
VIEWS = 'front', 'rear', 'a/b', 'v4', 'v5', 'v6', 'v7', 'v8'
LARGEST_VIEW_PX = 160


@pytest.fixture(scope='module')
def pictures():
    return [Scene().view(LENS, Attitude(yaw_rad=yaw)).frame(0) for yaw in (-YAW / 2, YAW / 2)]


def stitcher_of(pictures, settings):
    stitcher = RigState(settings.cameras)
    place(stitcher, settings)
    stitcher.overlaps = measure_overlaps(stitcher, [pictures], settings, 'correlation')
    return stitcher


def place(stitcher, settings):
    for camera in stitcher.cameras:
        stitcher.place(camera, LENS, settings.surface_of(LENS), settings.interpolation)


def draw(stitcher, settings, pictures):
    compositor = stitcher.compositor(settings, pictures)
    surface = compositor.layout.surface
    out = np.empty((surface.height, surface.width, 3), np.uint8)
    compositor.compose(pictures, out)
    return out


def legal(chance, kind, default, rule):
    """Pick a value that a parameter takes, its limits more often than others."""
    if rule.choices:
        return chance.choice(rule.choices)
    if kind is bool:
        return chance.random() < 0.5
    if kind in (int, float):
        low, high = rule.minimum, rule.maximum
        values = [low, high, chance.uniform(low, high), low + (high - low) * chance.random() ** 4]
        return kind(chance.choice([*values, nan] if rule.nan else values))
    if kind == tuple[str, ...]:
        return tuple(chance.sample(VIEWS, chance.randint(0, len(VIEWS))))
    nearby = chance.uniform(-2 * LENS.width, 2 * LENS.width)
    far = chance.choice([-1, 1]) * LARGEST_PX ** chance.random()
    return (chance.choice([nan, nearby, float(round(nearby)), far]),)


@pytest.mark.parametrize('seed', [0, 1])
def test_random_legal_values_of_every_live_parameter(pictures, seed):
    chance, settings = random.Random(seed), PanoramaSettings()
    live = [(name, entry) for name, entry in rules(PanoramaSettings).items() if entry[2].live]
    stitcher, counts = stitcher_of(pictures, settings), Counter()
    for _ in range(CHANGES // 2):
        name, (kind, default, rule) = chance.choice(live)
        is_default = chance.random() < 0.3
        settings = replace(
            settings, **{name: default if is_default else legal(chance, kind, default, rule)}
        )
        try:
            place(stitcher, settings)
            if chance.random() < MEASURED:
                stitcher.overlaps = measure_overlaps(
                    stitcher, [pictures], settings, settings.method
                )
            draw(stitcher, settings, pictures)
            counts['drawn'] += 1
        except FisheyeError as error:
            assert str(error)
            settings = replace(settings, **{name: default})
            counts['refused'] += 1
    assert counts['drawn'] > DRAWN * CHANGES / 2, counts


@pytest.mark.parametrize('moves', [False, True])
def test_random_legal_values_of_views(pictures, moves):
    chance, settings = random.Random(3), PanoramaSettings(feather_deg=40.0)
    mounts = [Mount(yaw, 0.0, 0.0) for yaw in (-YAW / 2, YAW / 2)]
    stitcher = RigState(settings.cameras, mounts)
    place(stitcher, settings)
    for blend in BLENDS:
        compositor = stitcher.compositor(replace(settings, blend=blend), pictures)
        for _ in range(CHANGES // 40):
            values = {
                name: legal(chance, kind, default, rule)
                for name, (kind, default, rule) in rules(ViewSettings).items()
            }
            for side in ('width', 'height'):
                values[side] = min(values[side], LARGEST_VIEW_PX)
            camera = ViewSettings(**values).camera(chance.choice(VIEWS))
            out = np.full((camera.height, camera.width, 3), 77, np.uint8)
            view = VirtualView(compositor, camera.surface, camera.attitude, moves=moves)
            view.draw(pictures, out)
            if view.seen_share == 0:
                assert not out.any()


@pytest.mark.parametrize('blend', BLENDS)
@pytest.mark.parametrize('offset_px', [-29.0, -700.0, -1e4, 0.0, 95.0, 1e4])
def test_an_offset_to_the_wrong_side_is_drawn(pictures, blend, offset_px):
    settings = PanoramaOutputSettings(blend=blend, offset_x_px=(offset_px,))
    stitcher = stitcher_of(pictures, PanoramaSettings())
    assert draw(stitcher, settings, pictures).any()


def test_a_hard_seam_of_round_pictures_keeps_their_rows():
    lens = replace(synthetic_lens(240, 240, np.radians(190)), visible_angle_rad=np.radians(95))
    views = [Scene().view(lens, Attitude(yaw_rad=yaw)) for yaw in (-YAW / 2, YAW / 2)]
    pictures, heights = [view.frame(0) for view in views], {}
    stitcher, settings = RigState(('left', 'right')), PanoramaSettings()
    for camera in stitcher.cameras:
        stitcher.place(camera, lens, settings.surface_of(lens))
    stitcher.overlaps = measure_overlaps(stitcher, [pictures], settings, 'correlation')
    for blend in ('none', 'feather'):
        heights[blend] = len(draw(stitcher, replace(settings, blend=blend), pictures))
    assert heights['none'] >= 0.97 * heights['feather']
