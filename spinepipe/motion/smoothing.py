"""Motion without noise and how fast it changes: zero-phase filter, central differences."""

import numpy as np
from scipy.signal import butter, sosfiltfilt

from spinepipe.effects.contract import Array

USUAL_CUTOFF_HZ = 6.0
"""For markers on people (Winter 2009, chapter 3): a choice among 4 to 8 Hz."""

PASSES = 2
ORDER = 2
PADDED = 3 * (2 * ORDER + 1)
"""Frames that are mirrored at each end."""


def low_pass(values: Array, rate_hz: float, cutoff_hz: float) -> Array:
    """Values (F, ...) through a Butterworth filter of second order, forwards and backwards.

    Both passes together let 1/sqrt(2) of the amplitude through at the cutoff.

    Raises
    ------
    ValueError
        Where frames are too few for the cutoff, or too short.
    """
    # each pass alone lets more through (Winter 2009, section 3.4.4.2)
    each = cutoff_hz / (2.0 ** (1.0 / PASSES) - 1.0) ** 0.25
    if 2.0 * each >= rate_hz:
        raise ValueError(f"{rate_hz:g} frames a second cannot be filtered at {cutoff_hz:g} Hz")
    if len(values) <= PADDED:
        raise ValueError(f"{len(values)} frames are too few to be filtered, {PADDED + 1} are not")
    sections = butter(ORDER, each, fs=rate_hz, output="sos")
    found: Array = sosfiltfilt(sections, values, axis=0, padlen=PADDED)
    return found


def velocity(values: Array, step_s: float) -> Array:
    """Rate of change of values (F, ...) by central differences of second order."""
    found: Array = np.gradient(values, step_s, axis=0, edge_order=2)
    return found


def acceleration(values: Array, step_s: float) -> Array:
    """Second derivative of values (F, ...); at both ends that of the frame next to them."""
    found = np.empty_like(values)
    found[1:-1] = (values[2:] - 2.0 * values[1:-1] + values[:-2]) / step_s**2
    found[0], found[-1] = found[1], found[-2]
    return found


def angular_velocity(rotations: Array, step_s: float) -> Array:
    """(F, 3) rad/s in ground of rotations (F, 3, 3): the skew part of dR/dt R^T."""
    spin = velocity(rotations, step_s) @ np.swapaxes(rotations, -1, -2)
    over, under = spin[..., [2, 0, 1], [1, 2, 0]], spin[..., [1, 2, 0], [2, 0, 1]]
    found: Array = 0.5 * (over - under)
    return found
