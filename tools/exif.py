"""Pictures for tests whose EXIF says that the camera was held on its side."""

_ORIENTATION = b'Exif\0\0II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\x06\0\0\0\0\0\0\0'
"""TIFF, little endian, with one entry: tag 0x112, a turn by 90 degrees (Exif 2.3, 4.6.4)."""


def turned(jpeg: bytes) -> bytes:
    """Give a JPEG of the same pixels that is to be shown turned by 90 degrees."""
    segment = b'\xff\xe1' + (len(_ORIENTATION) + 2).to_bytes(2, 'big') + _ORIENTATION
    return jpeg[:2] + segment + jpeg[2:]
