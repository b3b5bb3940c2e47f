"""Errors hold what they name, also on the other side of a process."""

import pickle

import pytest

from fisheye_core.errors import (
    CameraFileError,
    FileAccessError,
    FileContentError,
    FisheyeError,
    OverlapFileError,
    SettingError,
)


@pytest.mark.parametrize(
    ('error', 'sentence', 'fields'),
    [
        (
            FileAccessError('a.yaml', 'written', 'Permission denied'),
            'a.yaml cannot be written: Permission denied',
            {'path': 'a.yaml', 'action': 'written', 'reason': 'Permission denied'},
        ),
        (
            CameraFileError('line 3: k is 1', 'a.yaml'),
            'a.yaml: line 3: k is 1',
            {'path': 'a.yaml', 'reason': 'line 3: k is 1'},
        ),
        (OverlapFileError('it is empty'), 'it is empty', {'path': None, 'reason': 'it is empty'}),
    ],
)
def test_an_error_holds_what_its_sentence_names(error, sentence, fields):
    for one in (error, pickle.loads(pickle.dumps(error))):
        assert str(one) == sentence
        assert vars(one) == fields


def test_what_a_file_holds_whether_it_can_be_used_and_settings_are_different_kinds():
    assert not issubclass(FileAccessError, (FileContentError, SettingError))
    assert not issubclass(FileContentError, SettingError)
    assert not issubclass(OverlapFileError, CameraFileError)
    assert issubclass(FileAccessError, FisheyeError)
