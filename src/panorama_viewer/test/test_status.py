import pytest

from panorama_viewer.status import ViewerStatus, measured, plain


def texts(told):
    return [problem['text'] for problem in told['problems']]


def test_rate_and_delay_are_those_of_the_last_seconds():
    status = ViewerStatus()
    for i in range(100):
        status.picture(i / 20, 0.5 if i < 50 else 0.03)
    told = status.told(99 / 20)
    assert told['rate_hz'] == pytest.approx(20, abs=0.1)
    assert told['delay_ms'] == 30
    later = status.told(99 / 20 + 10)
    assert (later['rate_hz'], later['delay_ms']) == (0.0, None)


def test_what_nodes_complain_of_is_told_the_worst_first():
    status = ViewerStatus()
    status.heard(0.0, 'stitch', 1, 'no overlap: frames are side by side', {})
    status.heard(0.0, 'left/capture', 2, 'the camera is gone', {})
    status.heard(0.0, 'right/capture', 0, 'running', {})
    told = status.told(1.0)
    assert texts(told) == [
        'Left camera: the camera is gone',
        'Stitching: no overlap: frames are side by side',
    ]
    assert [problem['level'] for problem in told['problems']] == ['error', 'warning']


def test_a_node_that_falls_silent_is_told_of_and_in_the_end_forgotten():
    status = ViewerStatus()
    status.heard(0.0, 'left/capture', 0, 'running', {})
    assert texts(status.told(2.0)) == []
    assert texts(status.told(7.0)) == ['Left camera: no sign of life for 7 s']
    assert texts(status.told(10_000.0)) == []


def test_nodes_that_do_not_belong_to_the_rig_are_left_out():
    status = ViewerStatus()
    status.heard(0.0, 'battery', 2, 'empty', {})
    assert texts(status.told(0.0)) == []


@pytest.mark.parametrize(
    ('word', 'skew_ms'), [('1.5', 1.5), ('nan', None), ('unknown', None), (None, None)]
)
def test_the_skew_is_the_one_that_the_stitching_reports(word, skew_ms):
    status = ViewerStatus()
    values = {} if word is None else {'skew median ms': word}
    status.heard(0.0, 'left/capture', 0, 'running', {})
    status.heard(0.0, 'stitch', 0, 'running', values)
    assert status.told(0.0)['skew_ms'] == skew_ms


@pytest.mark.parametrize(
    ('name', 'words'),
    [
        ('left/capture', 'Left camera'),
        ('capture', 'Camera'),
        ('right/undistort', 'Correction of the right camera'),
        ('panorama', 'Stitching'),
    ],
)
def test_parts_have_plain_names(name, words):
    assert plain(name) == words


@pytest.mark.parametrize(
    ('found', 'yaw_deg', 'near_deg', 'confidence', 'words'),
    [
        (True, 140.23, 0.0, 0.95, 'left and right overlap, 140.2° apart (confidence 0.95)'),
        (
            True,
            140.23,
            2.34,
            0.95,
            'left and right overlap, 140.2° apart, near things up to 2.3° beside far ones '
            '(confidence 0.95)',
        ),
        (True, None, 0.0, 0.95, 'left and right overlap (confidence 0.95)'),
        (True, 140.23, None, None, 'left and right overlap, 140.2° apart (confidence not known)'),
        (False, None, 0.0, 0.2, 'left and right show nothing in common'),
    ],
)
def test_a_calibration_is_told_in_plain_words(found, yaw_deg, near_deg, confidence, words):
    overlap = {'left': 'left', 'right': 'right', 'found': found, 'confidence': confidence}
    assert measured({**overlap, 'yaw_deg': yaw_deg, 'near_deg': near_deg}) == words
