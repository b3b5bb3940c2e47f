"""Whether pictures are missing in an H.264 stream, which decoders pass over in silence.

Each picture carries the number of those before it that others are drawn upon, a few bits of it.
Syntax and meaning: ITU-T H.264, 7.3.2.1.1, 7.3.3 and 7.4.3.
"""

from fisheye_core.nal_units import units

_SLICES, _KEYFRAME, _SEQUENCE_PARAMETERS = (1, 5), 5, 7
_WITH_CHROMA_FORMAT = 100, 110, 122, 244, 44, 83, 86, 118, 128
"""Profiles whose parameters name the format of colour."""
_ALL_CHROMA = 3
_HEAD_BYTES = 64


class PictureNumbers:
    """Follows the numbers of the pictures of one stream."""

    def __init__(self) -> None:
        self._bits = 0
        self._next: int | None = None

    def has_gap(self, data: bytes) -> bool:
        """Whether something is missing between the picture before and this one, annex B."""
        for kind, begin, _ in units(data):
            head = data[begin + 3 : begin + 3 + _HEAD_BYTES]
            try:
                if kind == _SEQUENCE_PARAMETERS:
                    self._bits = _number_bits(head)
                elif kind in _SLICES:
                    return self._follow(kind, head)
            except IndexError:
                return True
        return False

    def _follow(self, kind: int, head: bytes) -> bool:
        if not self._bits:
            return False
        bits = _Bits(head[1:])
        for _ in ('first_mb_in_slice', 'slice_type', 'pic_parameter_set_id'):
            bits.number()
        number = bits.take(self._bits)
        has_gap = kind != _KEYFRAME and self._next not in (None, number)
        is_drawn_upon = head[0] >> 5 & 3 > 0
        self._next = (number + is_drawn_upon) % (1 << self._bits)
        return has_gap


class _Bits:
    """Bits of a unit from its first on; an `IndexError` where it ends."""

    def __init__(self, data: bytes):
        self._data, self._at = data.replace(b'\x00\x00\x03', b'\x00\x00'), 0

    def take(self, count: int) -> int:
        value = 0
        for _ in range(count):
            value = value << 1 | self._data[self._at // 8] >> 7 - self._at % 8 & 1
            self._at += 1
        return value

    def number(self) -> int:
        """Return an exponential Golomb code (9.1)."""
        zeros = 0
        while not self.take(1):
            zeros += 1
        return (1 << zeros) - 1 + self.take(zeros)


def _number_bits(head: bytes) -> int:
    """Return how many bits a picture's number has; 0 where that is too far to find out."""
    bits = _Bits(head[1:])
    profile = bits.take(24) >> 16
    bits.number()
    if profile in _WITH_CHROMA_FORMAT:
        if bits.number() == _ALL_CHROMA:
            bits.take(1)
        for _ in ('bit_depth_luma', 'bit_depth_chroma'):
            bits.number()
        bits.take(1)
        if bits.take(1):  # Scaling lists.
            return 0
    return bits.number() + 4
