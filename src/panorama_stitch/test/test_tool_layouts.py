"""What RViz and Foxglove are told to show is what the nodes publish."""

import json
import re
from pathlib import Path

import yaml

PACKAGE = Path(__file__).parents[1]
TOPICS = {
    '/front/camera_info',
    '/front/image_raw',
    '/front/image_raw/compressed',
    '/rear/camera_info',
    '/rear/image_raw',
    '/rear/image_raw/compressed',
    '/diagnostics',
    '/left/image_raw/compressed',
    '/left/image_rect',
    '/panorama/image',
    '/panorama/image/compressed',
    '/panorama/overlap',
    '/right/image_raw/compressed',
    '/right/image_rect',
    '/calibrate_overlap',
}


def test_rviz_shows_topics_and_frames_that_there_are():
    manager = yaml.safe_load((PACKAGE / 'rviz' / 'panorama.rviz').read_text())[
        'Visualization Manager'
    ]
    topics = {entry['Topic']['Value'] for entry in manager['Displays'] if 'Topic' in entry}
    assert topics
    assert topics <= TOPICS
    assert manager['Global Options']['Fixed Frame'] == 'panorama_optical_frame'


def test_foxglove_shows_topics_that_there_are_each_panel_once():
    text = (PACKAGE / 'foxglove' / 'panorama.json').read_text()
    layout = json.loads(text)
    named = set(re.findall(r'"(/[\w/]+)', text))
    assert named <= TOPICS
    panels = re.findall(r'"(\w+!\w+)"', json.dumps(layout['layout']))
    assert sorted(panels) == sorted(layout['configById'])
