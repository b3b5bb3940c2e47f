import pytest

from panorama_viewer.way import Way


def test_the_way_is_without_that_of_the_answers():
    way = Way()
    assert way.usual_s(0.0) == 0.0
    for now_s, trip_s in ((1.0, 0.5), (1.5, 0.08), (2.0, 0.3)):
        way.told(now_s)
        way.heard(now_s + trip_s)
    for number in range(5):
        way.drawn(3.0 + number / 30 + 0.12, 3.0 + number / 30)
    assert way.usual_s(3.2) == pytest.approx(0.12 - 0.08 / 2)


def test_what_was_drawn_long_ago_counts_no_more():
    way = Way()
    way.drawn(1.0, 0.0)
    way.drawn(9.0, 8.8)
    assert way.usual_s(9.5) == pytest.approx(0.2)
    assert way.usual_s(20.0) == 0.0


def test_an_answer_to_nothing_is_none():
    way = Way()
    way.heard(5.0)
    way.drawn(9.0, 8.9)
    assert way.usual_s(9.0) == pytest.approx(0.1)
