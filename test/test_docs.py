"""The documentation: tables that cannot go stale, links that lead somewhere."""

import re
from pathlib import Path

import parameter_tables
import pytest

ROOT = Path(__file__).parents[1]
PAGES = [
    page
    for pattern in ('*.md', 'docs/*.md', 'examples/*.md', 'benchmarks/*.md')
    for page in sorted(ROOT.glob(pattern))
]


@pytest.mark.parametrize('page', PAGES, ids=lambda path: path.name)
def test_parameter_tables_are_what_the_nodes_declare(page):
    text = page.read_text()
    assert parameter_tables.updated(text) == text, 'run `make docs`'


@pytest.mark.parametrize('page', PAGES, ids=lambda path: path.name)
def test_links_lead_somewhere(page):
    for target in re.findall(r'\]\(([^)#:]+)(?:#[^)]*)?\)', page.read_text()):
        assert (page.parent / target).exists(), target


def test_every_node_has_a_page_with_its_parameters():
    described = ''.join(page.read_text() for page in PAGES)
    for settings in (
        'fisheye_capture.capture_settings.CaptureSettings',
        'fisheye_undistort.undistort_settings.UndistortSettings',
        'panorama_stitch.pipeline.panorama_settings.PanoramaOutputSettings',
        'panorama_stitch.pipeline.panorama_settings.PanoramaSettings',
        'panorama_viewer.settings.ViewerSettings',
    ):
        assert f'<!-- parameters: {settings} -->' in described
