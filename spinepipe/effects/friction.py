"""Elements of dry friction, each with a share h from -1 to 1 that follows the motion of a step.

An element knows h0, at which the step began, and x, how far the joint has moved since over the
element's own yield. Its step is closed: how finely a way is cut into steps changes little.
"""

from dataclasses import dataclass

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.effects.rounding import ramp

ROUNDING = 1e-4
"""Share of the yield over which the corner at the start of a step is rounded."""

CORNER = 0.05
"""Share of what is left to yield over which an elastic-plastic element's corner is rounded."""

_NONE_LEFT = 1e-12
"""An element with less left to yield has yielded."""


@dataclass(frozen=True)
class Stepped:
    """h (J, N) of N elements of J joints, and its derivatives by x and by h0."""

    h: Array
    by_x: Array
    by_start: Array


def dahl(start: Array, x: Array) -> Stepped:
    """``h = s - (s - h0) exp(-|x|)`` with s = sign(x), its corner at x = 0 rounded."""
    rounded = np.hypot(x, ROUNDING)
    kept = np.exp(ROUNDING - rounded)
    h = start * kept - np.sign(x) * np.expm1(-np.abs(x))
    return Stepped(h, np.exp(-np.abs(x)) - start * kept * x / rounded, kept)


def jenkins(start: Array, x: Array) -> Stepped:
    """``h = h0 + x`` within ±1: a spring in line with a slider.

    An element that has yielded has another slope on each side of x = 0. There ``min(x, 0)`` is
    rounded to ``(x - sqrt(x^2 + e^2) + e) / 2``, e = `ROUNDING`; h may pass 1 by half of that.
    """
    up, down = 1.0 - start, 1.0 + start
    no_more_up, no_more_down = up < _NONE_LEFT, down < _NONE_LEFT
    rounded = np.hypot(x, ROUNDING)
    size, slope = rounded - ROUNDING, x / rounded
    rising = _room(
        np.where(no_more_down, 0.5 * (size + x), np.maximum(x, 0.0)),
        np.where(no_more_down, 0.5 * (slope + 1.0), x >= 0.0),
        np.where(no_more_up, 0.0, up),
    )
    falling = _room(
        np.where(no_more_up, 0.5 * (size - x), np.maximum(-x, 0.0)),
        np.where(no_more_up, 0.5 * (1.0 - slope), x < 0.0),
        np.where(no_more_down, 0.0, down),
    )
    return Stepped(
        start + rising[0] - falling[0],
        rising[1] + falling[1],
        1.0 - rising[2] - falling[2],
    )


def _room(x: Array, by_x: Array, room: Array) -> tuple[Array, Array, Array]:
    """``min(x, room)``, rounded, its derivative by the motion, and by the room."""
    left = room > 0.0
    t = np.where(left, x / np.where(left, room, 1.0), 2.0)
    over, slope = ramp(t - 1.0, CORNER)
    share, kept = t - over, 1.0 - slope
    by_room = np.where(left, share - t * kept, x > 0.0)
    return np.where(left, room * share, 0.0), np.where(left, kept * by_x, 0.0), by_room
