"""The pace of a page's pictures on links that are simulated: rate, delay, stalls, a busy page."""

import random

import numpy as np
import pytest

from panorama_viewer.pace import NOMINAL_HZ, PagePace

MOST_KBPS = 2000.0
DELAY_S = 0.04
"""One way."""
DRIVABLE_S, DRIVABLE_HZ = 0.15, 20.0


class SimulatedPage:
    """A page at the end of a link, whose pictures come at 30 Hz.

    Attributes
    ----------
    sent, drawn
        (n, 2): when, s, and of pictures that were sent their kbit, of those that were drawn how
        old they were, s.
    """

    def __init__(self, seed=1):
        self.pace = PagePace(MOST_KBPS, 0.0)
        self.now_s, self._free_s, self._acks = 0.0, 0.0, []
        self._confirmed = []
        self._random = random.Random(seed)
        self.sent, self.drawn = [], []

    def run(self, seconds, kbps=1e6, busy_s=0.0, stall_every_s=1e9, stall_s=0.0):
        """Let time pass; the page or the link stand still for a while now and then."""
        end_s = self.now_s + seconds
        while self.now_s < end_s:
            self.now_s += 1 / NOMINAL_HZ
            self._hear()
            self._confirmed = [each for each in self._confirmed if each[0] > self.now_s]
            unconfirmed = sum(size for _, size in self._confirmed)
            if self.pace.takes(MOST_KBPS, self.now_s, is_new=True, unconfirmed=unconfirmed):
                self._send(kbps, busy_s, stall_every_s, stall_s)

    def since(self, begin_s):
        """Return rate, Hz, kbit/s and median age, s, from a time on."""
        seconds = self.now_s - begin_s
        sent, drawn = np.array(self.sent), np.array(self.drawn)
        kbit = sent[sent[:, 0] > begin_s][:, 1].sum()
        ages = drawn[drawn[:, 0] > begin_s][:, 1]
        return len(ages) / seconds, kbit / seconds, np.median(ages)

    def _hear(self):
        while self._acks and self._acks[0] <= self.now_s:
            self.pace.drawn(self._acks.pop(0))

    def _send(self, kbps, busy_s, stall_every_s, stall_s):
        kbit = self.pace.nominal_kbps / NOMINAL_HZ
        begin_s = max(self.now_s, self._free_s)
        if begin_s % stall_every_s < stall_s:
            begin_s += stall_s
        self._free_s = begin_s + kbit / kbps
        drawn_s = self._free_s + DELAY_S + self._random.random() * busy_s
        drawn_s = max([drawn_s, *(ack_s - DELAY_S for ack_s in self._acks)])
        size = round(kbit * 125)
        self.pace.sent(self.now_s, size)
        self._confirmed.append((self._free_s + 2 * DELAY_S, size))
        self.sent.append((self.now_s, kbit))
        self.drawn.append((drawn_s, drawn_s - self.now_s))
        self._acks.append(drawn_s + DELAY_S)


def test_a_fast_link_gets_all_there_is():
    page = SimulatedPage()
    page.run(20)
    rate_hz, kbps, _ = page.since(1.0)
    assert rate_hz == pytest.approx(NOMINAL_HZ, abs=0.5)
    assert kbps == pytest.approx(MOST_KBPS, rel=0.05)


@pytest.mark.parametrize('link_kbps', [1900, 1500, 1000])
def test_a_slow_link_is_filled_and_stays_drivable(link_kbps):
    page = SimulatedPage()
    page.run(60, link_kbps)
    rate_hz, kbps, age_s = page.since(10.0)
    assert rate_hz > DRIVABLE_HZ
    assert age_s < DRIVABLE_S
    assert 0.7 * link_kbps < kbps < 1.02 * link_kbps


@pytest.mark.parametrize('link_kbps', [1000, 500, 250])
def test_a_link_that_gets_slow_gets_less_within_a_second(link_kbps):
    page = SimulatedPage()
    page.run(20)
    page.run(1, link_kbps)
    assert page.pace.kbps < max(1.1 * link_kbps, MOST_KBPS / 2)
    page.run(2, link_kbps)
    assert page.pace.kbps < 1.6 * link_kbps
    page.run(2, link_kbps)
    begin_s = page.now_s
    page.run(10, link_kbps)
    rate_hz, _, age_s = page.since(begin_s)
    assert rate_hz > 6
    assert age_s < 2 * DRIVABLE_S


def test_a_link_that_gets_fast_again_gets_more_slowly():
    page = SimulatedPage()
    page.run(30, 500)
    page.run(5)
    assert page.pace.kbps < MOST_KBPS / 2
    page.run(55)
    assert page.pace.kbps == MOST_KBPS


def test_repairs_of_losses_are_no_slow_link():
    page = SimulatedPage()
    page.run(60, 2100, stall_every_s=2.0, stall_s=0.15)
    rate_hz, kbps, age_s = page.since(10.0)
    assert rate_hz > DRIVABLE_HZ
    assert kbps > 0.7 * MOST_KBPS
    assert age_s < DRIVABLE_S


def test_a_busy_page_is_no_slow_link():
    page = SimulatedPage()
    page.run(60, busy_s=0.15)
    _, kbps, age_s = page.since(10.0)
    assert page.pace.kbps == MOST_KBPS
    assert kbps > 0.5 * MOST_KBPS
    assert age_s < DRIVABLE_S


def test_nothing_is_sent_into_a_link_that_is_cut():
    page = SimulatedPage()
    page.run(10)
    page.run(5, kbps=0.001)
    assert len([1 for sent_s, _ in page.sent if sent_s > 10.4]) <= 1


def test_a_lower_limit_applies_at_once():
    pace = PagePace(MOST_KBPS, 0.0)
    assert pace.takes(300.0, 0.1, is_new=True)
    assert pace.kbps == 300.0
