"""How alike two pictures are."""

import cv2
import numpy as np


def similarity_map(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the SSIM of grey pictures around each pixel.

    After Z. Wang et al., "Image quality assessment: from error visibility to structural
    similarity", 2004, https://doi.org/10.1109/TIP.2003.819861.
    """
    a, b = (cv2.cvtColor(np.float32(c), cv2.COLOR_BGR2GRAY) for c in (a, b))

    def blur(c):
        return cv2.GaussianBlur(c, (11, 11), 1.5)

    mean_a, mean_b = blur(a), blur(b)
    var_a, var_b = blur(a * a) - mean_a**2, blur(b * b) - mean_b**2
    covariance = blur(a * b) - mean_a * mean_b
    small, smaller = (0.01 * 255) ** 2, (0.03 * 255) ** 2
    luminance = (2 * mean_a * mean_b + small) / (mean_a**2 + mean_b**2 + small)
    return luminance * (2 * covariance + smaller) / (var_a + var_b + smaller)
