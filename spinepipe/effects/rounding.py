"""Corners rounded over a small width, so that a law with a corner still has a tangent there; and
where exponential growth goes on straight.
"""

import numpy as np

from spinepipe.effects.contract import Array

STRAIGHT = 5.0
"""Exponent from which laws of two exponentials are straight: 148 times the stiffness at rest."""


def ramp(x: Array, width: float) -> tuple[Array, Array]:
    """``max(x, 0)`` with a parabola over ``|x| < width``, and its slope.

    Exact outside the width; value ``width / 4`` and slope 1/2 at zero.
    """
    into = np.clip(x + width, 0.0, 2.0 * width)
    return into**2 / (4.0 * width) + np.maximum(x - width, 0.0), into / (2.0 * width)


def magnitude(x: Array, width: float) -> tuple[Array, Array]:
    """``|x|`` as ``sqrt(x^2 + width^2)``, and its slope; too large by ``width`` at zero."""
    size = np.hypot(x, width)
    return size, x / size


def sign(x: Array, width: float) -> tuple[Array, Array]:
    """``sign(x)`` as ``tanh(x / width)``, and its slope."""
    value = np.tanh(x / width)
    return value, (1.0 - value**2) / width
