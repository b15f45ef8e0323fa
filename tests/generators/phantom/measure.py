"""What a lab would write down of the true motion: its joint centres, its noise, its zero."""

import numpy as np

ROTATION_SD_DEG = 0.1
TRANSLATION_SD_MM = 0.1

BORDER_PER_SI = np.array([1000.0] * 3 + [180.0 / np.pi] * 3)
"""(6,) mm and deg per m and rad."""

READING_SD = np.array([TRANSLATION_SD_MM] * 3 + [ROTATION_SD_DEG] * 3)


def about_other_centres(q: np.ndarray, offsets: np.ndarray, turns: np.ndarray) -> np.ndarray:
    """The same motion (..., J, 6) about points fixed in the vertebrae ``offsets`` (..., J, 3) away.

    In the joint frame a point x moves to d + R x. About the point e this reads d + (R - 1) e, and
    the angles stay. ``turns`` (..., J, 3, 3) are the R.
    """
    moved = np.einsum("...ij,...j->...i", turns - np.eye(3), offsets)
    return np.concatenate([q[..., :3] + moved, q[..., 3:]], axis=-1)


def readings(q: np.ndarray, rng: np.random.Generator, zeroed: bool) -> np.ndarray:
    """(..., steps, J, 6) mm and deg with noise on every reading, step 0 subtracted if ``zeroed``.

    The noise comes first: that of step 0 is in every reading of its cycle.
    """
    read = q * BORDER_PER_SI + READING_SD * rng.normal(size=q.shape)
    return read - read[..., :1, :, :] if zeroed else read
