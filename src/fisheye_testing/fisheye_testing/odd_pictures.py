"""Pictures for tests that are not what they seem."""

import struct
import zlib

_ORIENTATION = b'Exif\0\0II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\x06\0\0\0\0\0\0\0'
"""TIFF, little endian, with one entry: tag 0x112, a turn by 90 degrees (Exif 2.3, 4.6.4)."""


def turned(jpeg: bytes) -> bytes:
    """Return a JPEG of the same pixels whose EXIF says that the camera was held on its side."""
    segment = b'\xff\xe1' + (len(_ORIENTATION) + 2).to_bytes(2, 'big') + _ORIENTATION
    return jpeg[:2] + segment + jpeg[2:]


def turned_video(mp4: bytes) -> bytes:
    """Return an MP4 of the same pixels whose track header says that the camera was on its side."""
    # ISO/IEC 14496-12, 8.3.2: the matrix, in 16.16 and 2.30, lies 44 bytes behind the box's name.
    at = mp4.index(b'tkhd') + 44
    matrix = struct.pack('>9i', 0, 1 << 16, 0, -1 << 16, 0, 0, 0, 0, 1 << 30)
    return mp4[:at] + matrix + mp4[at + len(matrix) :]


def huge_png(side_px: int = 60_000) -> bytes:
    """Return a PNG of a few bytes that claims to be larger than memory."""

    def chunk(kind, content):
        checksum = struct.pack('>I', zlib.crc32(kind + content))
        return struct.pack('>I', len(content)) + kind + content + checksum

    header = chunk(b'IHDR', struct.pack('>IIBBBBB', side_px, side_px, 8, 2, 0, 0, 0))
    return b'\x89PNG\r\n\x1a\n' + header + chunk(b'IDAT', b'') + chunk(b'IEND', b'')
