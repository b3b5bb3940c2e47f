"""The yaw between cameras, from what each of them saw all around."""

import numpy as np

from fisheye_core.errors import CalibrationError

_LEAST_LIKENESS = 0.25


def yaw_between(first: np.ndarray, second: np.ndarray) -> float:
    """Return by how much a camera looks to the right of another, rad, from their panoramas.

    Raises
    ------
    CalibrationError
        If the two do not show the same.
    """
    spectra = [
        np.fft.rfft(p / max(float(np.linalg.norm(p)), 1e-6), axis=1) for p in (first, second)
    ]
    score = np.fft.irfft((spectra[0] * spectra[1].conj()).sum(axis=0), n=first.shape[1])
    best = int(np.argmax(score))
    if score[best] < _LEAST_LIKENESS:
        raise CalibrationError(
            f'the cameras do not show the same place (likeness {score[best]:.2f} of their '
            f'panoramas; expected {_LEAST_LIKENESS} and more): expected pictures of one turn'
        )
    return best / first.shape[1] * 2 * np.pi
