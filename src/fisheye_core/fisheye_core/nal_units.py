"""What an H.264 byte stream holds, as its framing tells (ITU-T H.264, annex B and 7.4.1)."""

from collections.abc import Iterator

_START = b'\x00\x00\x01'
_SLICE_OF_KEYFRAME, _SEQUENCE_PARAMETERS, _PICTURE_PARAMETERS = 5, 7, 8


def units(data: bytes) -> Iterator[tuple[int, int, int]]:
    """Yield the type of each unit and where it begins and ends, with its start code."""
    at = data.find(_START)
    while 0 <= at < len(data) - len(_START):
        end = data.find(_START, at + len(_START))
        yield data[at + len(_START)] & 0x1F, at, end if end >= 0 else len(data)
        at = end


def is_keyframe(data: bytes) -> bool:
    """Whether a picture can be decoded without any before it (an IDR picture)."""
    return any(kind == _SLICE_OF_KEYFRAME for kind, _, _ in units(data))


def parameter_sets(data: bytes) -> bytes:
    """Return the parameter sets of a picture, each with its start code; empty without any."""
    kinds = _SEQUENCE_PARAMETERS, _PICTURE_PARAMETERS
    return b''.join(data[begin:end] for kind, begin, end in units(data) if kind in kinds)
