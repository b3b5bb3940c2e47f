"""What a node says of itself."""

from fisheye_bridge.diagnostics import OK, WARN, Report, Shedding


def told(shedding, handled, shed):
    report = Report()
    shedding.tell(report, handled, shed)
    return report


def test_a_warning_tells_what_was_shed_since_the_last_report():
    shedding = Shedding('pairs')
    assert told(shedding, 20, 0).level == OK
    report = told(shedding, 35, 15)
    assert report.level == WARN
    assert '15 of the last 30 pairs were shed' in report.reasons[0]
    assert told(shedding, 65, 15).level == OK, 'that is over'


def test_little_is_not_worth_a_warning():
    shedding = Shedding('pictures')
    assert told(shedding, 28, 2).level == OK
    assert told(shedding, 28, 2).level == OK, 'nothing came'
