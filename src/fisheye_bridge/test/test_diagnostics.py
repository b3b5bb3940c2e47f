"""What a node says of itself."""

import time

import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter

from fisheye_bridge.diagnostics import OK, WARN, Diagnostics, OverloadMonitor, Report

DEADLINE_S = 10.0


def told(shedding, handled, shed):
    report = Report()
    shedding.tell(report, handled, shed)
    return report


def test_a_warning_tells_what_was_shed_since_the_last_report():
    shedding = OverloadMonitor('pairs')
    assert told(shedding, 20, 0).level == OK
    report = told(shedding, 35, 15)
    assert report.level == WARN
    assert '15 of the last 30 pairs were shed' in report.reasons[0]
    assert told(shedding, 65, 15).level == OK, 'that is over'


def test_little_is_not_worth_a_warning():
    shedding = OverloadMonitor('pictures')
    assert told(shedding, 28, 2).level == OK
    assert told(shedding, 28, 2).level == OK, 'nothing came'


@pytest.mark.parametrize('use_sim_time', [False, True])
def test_a_report_comes_also_while_the_time_of_ros_stands_still(use_sim_time):
    context = rclpy.Context()
    rclpy.init(context=context)
    sim_time = Parameter('use_sim_time', value=use_sim_time)
    node = rclpy.create_node('patient', context=context, parameter_overrides=[sim_time])
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    reports = []
    diagnostics = Diagnostics(node, reports.append)
    deadline = time.monotonic() + DEADLINE_S
    while not reports:
        assert time.monotonic() < deadline, 'no report came'
        executor.spin_once(timeout_sec=0.05)
    assert diagnostics
    executor.shutdown()
    node.destroy_node()
    rclpy.shutdown(context=context)
