"""How lumbar joints share a motion, instant by instant.

A joint's share is its rotation over that of all lumbar joints together, L5S1 to T12L1, about the
axis that the motion is about, from the neutral pose. Where the lumbar spine as a whole is turned by
less than 2 deg there is none: it would be a small number over a small one.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array
from spinepipe.motion.skeleton import JOINTS, LUMBAR, PELVIS
from spinepipe.studies.tracking.reload_motions import AXIS, ReloadedMotions

LEAST_RAD = float(np.deg2rad(2.0))
LUMBAR_JOINTS = JOINTS[LUMBAR]

INSTANTS = 101
"""One per percent of the cycle, ends included."""

_TRIFLE = 1e-9
"""Of a cycle: a frame on the border of a window is in it, however its time was rounded."""


@dataclass(frozen=True, eq=False)
class MotionShares:
    """Shares over a cycle, from 0 at the first frame to 1 at the last.

    Attributes
    ----------
    cycle : (F,). share : (F, 6), joints from below; zero where there is none. enough : (F,) whether
        there is one.
    """

    cycle: Array
    share: Array
    enough: NDArray[np.bool_]

    def inside(self, window: tuple[float, float]) -> NDArray[np.bool_]:
        """(F,) whether an instant lies in a part of the cycle, ends included."""
        low, high = window
        return (self.cycle >= low - _TRIFLE) & (self.cycle <= high + _TRIFLE)


def shares_of(
    moved: ReloadedMotions, kind: str, instants: int | None = None
) -> MotionShares | None:
    """Shares of a motion, at its frames or at so many instants; None where nothing is moved.

    Parameters
    ----------
    kind : of the trial, which says about which axis.
    instants : evenly over the cycle, ends included; None for the frames.
    """
    if kind not in AXIS or len(moved.time_s) < 2:
        return None
    first, last = moved.time_s[0], moved.time_s[-1]
    times = moved.time_s if instants is None else np.linspace(first, last, instants)
    turned = moved.at(times)[:, PELVIS + 1 :, 3 + AXIS[kind]][:, LUMBAR]
    total = turned.sum(axis=1)
    enough = np.abs(total) >= LEAST_RAD
    share = np.where(enough[:, None], turned / np.where(enough, total, 1.0)[:, None], 0.0)
    return MotionShares((times - first) / (last - first), share, enough)
