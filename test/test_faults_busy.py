"""A stitch node that measures an overlap for somebody goes on with everything else."""

from time import monotonic

import pytest
from field import START_S
from fisheye_msgs.srv import CalibrateOverlap
from rcl_interfaces.srv import GetParameters

from fisheye_testing.health import Health
from fisheye_testing.rig import SIDES
from fisheye_testing.waiting import wait_for

LARGE = {'width': 1920, 'height': 1440}
"""Pictures of this size keep a measurement busy for a while."""
TRIES = 3


@pytest.fixture
def health(domain):
    with Health(domain) as health:
        yield health


def test_parameters_are_answered_while_an_overlap_is_measured(rig, health):
    for side in SIDES:
        rig.start(f'{side}/capture', **LARGE)
        rig.start(f'{side}/undistort')
    rig.start('stitch')
    wait_for(lambda: rig.check_alive() or health.seen, START_S, 'a panorama')
    measure = health.node.create_client(CalibrateOverlap, 'calibrate_overlap')
    ask = health.node.create_client(GetParameters, 'stitch/get_parameters')
    wait_for(lambda: measure.service_is_ready() and ask.service_is_ready(), START_S, 'services')
    meanwhile, successes, answer_s, measured_s = 0, 0, [], []
    deadline_s = monotonic() + START_S
    while len(measured_s) < TRIES or not successes:
        assert monotonic() < deadline_s, 'no measurement was made'
        begin_s = monotonic()
        measured = measure.call_async(CalibrateOverlap.Request())
        while not measured.done():
            asked_s = monotonic()
            answered = ask.call_async(GetParameters.Request(names=['blend']))
            wait_for(answered.done, START_S, 'an answer')
            answer_s.append(monotonic() - asked_s)
            meanwhile += not measured.done()
        measured_s.append(monotonic() - begin_s)
        successes += measured.result().success
    print(
        f'\n{meanwhile} answers came during {len(measured_s)} measurements, the slowest after '
        f'{max(answer_s):.2f} s; {successes} measurements were made, the slowest answer after '
        f'{max(measured_s):.2f} s'
    )
    assert meanwhile > TRIES, 'parameters wait for measurements'
