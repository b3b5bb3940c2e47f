"""Economy, with a clock of its own."""

from itertools import pairwise

import pytest

from panorama_stitch.pipeline.economy import Economy

INTERVAL_S = 1 / 30


class BusyMachine:
    """Makes panoramas at 30 Hz, each of which costs so much time in full, and in economy."""

    def __init__(self):
        self.now_s = 100.0
        self.economy = Economy(lambda: self.now_s)
        self.history = []

    def run(self, full_s, economical_s, duration_s):
        begin = len(self.history)
        for _ in range(round(duration_s / INTERVAL_S)):
            arrival_s = self.now_s
            self.economy.arrived()
            is_economical = self.economy.started()
            self.now_s += economical_s if is_economical else full_s
            self.economy.ended()
            self.now_s = max(self.now_s, arrival_s + INTERVAL_S)
            self.history.append(is_economical)
        return self.history[begin:]


@pytest.fixture
def machine():
    return BusyMachine()


def test_a_machine_with_time_never_saves(machine):
    assert not any(machine.run(0.02, 0.01, 20))


def test_economy_begins_within_a_second_where_there_is_no_time(machine):
    machine.run(0.01, 0.005, 10)
    history = machine.run(0.031, 0.01, 3)
    assert True in history[:30]
    assert history[history.index(True) :].count(False) <= 15


def test_a_hiccup_begins_no_economy(machine):
    machine.run(0.01, 0.005, 5)
    machine.run(0.3, 0.3, INTERVAL_S)
    assert not any(machine.run(0.01, 0.005, 5))


def test_it_comes_back_and_is_tried_ever_more_rarely_where_it_cannot_stay(machine):
    machine.run(0.01, 0.005, 5)
    overloaded = machine.run(0.032, 0.01, 120)
    assert overloaded.count(False) / len(overloaded) < 0.1
    late = overloaded[len(overloaded) // 2 :]
    trials = sum(before and not now for before, now in pairwise(late))
    assert 1 <= trials <= 3
    freed = machine.run(0.01, 0.005, 60)
    assert not any(freed[-600:])


def test_economy_stays_on_where_even_that_takes_the_time(machine):
    machine.run(0.01, 0.005, 5)
    assert all(machine.run(0.033, 0.03, 60)[60:])
