"""Who asks for an overlap shares the answer, and holds panoramas up only as far as needed."""

from concurrent.futures import Future
from unittest.mock import Mock

import pytest

from panorama_stitch.pipeline import calibration_request
from panorama_stitch.pipeline.calibration_request import CalibrationRequest


def test_only_a_measurement_that_takes_long_holds_panoramas_up(monkeypatch):
    now_s, wait, answer = Mock(return_value=100.0), Mock(), Future()
    monkeypatch.setattr(calibration_request, 'monotonic', now_s)
    monkeypatch.setattr(calibration_request, 'wait', wait)
    request = CalibrationRequest(lambda *_: answer)
    request.leave_room(0.03)
    request.ask(None, '', save=False)
    for now_s.return_value in (100.0, 101.9):
        request.leave_room(0.03)
    wait.assert_not_called()
    now_s.return_value = 102.1
    request.leave_room(0.03)
    wait.assert_called_once_with([answer], pytest.approx(0.06))
    answer.set_result([])
    request.leave_room(0.03)
    wait.assert_called_once()
