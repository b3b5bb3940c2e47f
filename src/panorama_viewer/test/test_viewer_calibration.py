"""The button that has the overlap measured, as the viewer node answers it."""

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from fisheye_msgs.msg import Overlap
from fisheye_msgs.srv import CalibrateOverlap
from stitching import JPEG, Stitching, look, viewer, visit

from fisheye_testing.waiting import wait_for
from panorama_viewer import viewer_node


def press_calibrate(node):
    async def press(session):
        async with session.post(f'{node.url}calibrate') as reply:
            return reply.status, await reply.text()

    return visit(press)


@pytest.mark.parametrize('save', [False, True])
def test_the_button_has_the_overlap_measured(ros, save):
    stitching, node = Stitching(ros.context), viewer(ros, port=0, save=save)

    def calibrate(request, response):
        response.success = (request.method, request.save) == ('', save)
        response.overlaps = [
            Overlap(
                left_camera='left',
                right_camera='right',
                found=True,
                yaw_deg=140.2,
                near_deg=2.1,
                confidence=0.9,
            )
        ]
        return response

    stitching.create_service(CalibrateOverlap, 'calibrate_overlap', calibrate)
    ros.start(stitching, node)
    words = (
        'left and right overlap, 140.2° apart, near things up to 2.1° beside far ones '
        '(confidence 0.90)' + '; saved' * save
    )
    wait_for(lambda: press_calibrate(node) == (200, words))


def test_the_button_says_so_where_nobody_measures(ros):
    node = viewer(ros, port=0)
    ros.start(node)
    status, words = press_calibrate(node)
    assert status == 503
    assert 'nobody offers calibrate_overlap' in words


def test_a_bug_in_the_page_stands_in_the_diagnostics_and_the_rest_goes_on(ros, monkeypatch):
    stitching, node = Stitching(ros.context), viewer(ros, port=0)
    stitching.create_service(CalibrateOverlap, 'calibrate_overlap', lambda _, response: response)
    heard = []
    stitching.create_subscription(
        DiagnosticArray, '/diagnostics', lambda message: heard.extend(message.status), 10
    )
    ros.start(stitching, node)
    monkeypatch.setattr(viewer_node, 'CalibrateOverlap', None)
    wait_for(lambda: press_calibrate(node)[0] == 500)
    wait_for(lambda: any(s.name == 'rig/viewer' and s.level == b'\2' for s in heard))
    told = next(s.message for s in heard if s.name == 'rig/viewer' and s.level == b'\2')
    assert told.startswith('a part of the page failed: AttributeError in viewer_node.py')
    assert look(node) == JPEG
