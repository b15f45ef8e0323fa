"""What hands lift from the floor: where it is, and how much of its weight they bear by now.

On a plate it is told all along: as much as the plate bears less than before, and so is its weight.
Else it is told by height: hands bear all of it once it has risen by `RISEN_M`, and nothing before.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.motion.smoothing import acceleration
from spinepipe.units import GRAVITY_M_S2, STANDARD_GRAVITY

RISEN_M = 0.005
"""Ten times the noise of a marker: a choice."""

SAME_WEIGHT = 0.1
"""A plate on which the load stood reads less by its weight, within this share."""

TENTH = 10
"""The weight is told of that part of the frames before it is moved, and of that part at the end."""


@dataclass(frozen=True, eq=False)
class LiftedLoad:
    """A load over time.

    Attributes
    ----------
    kg : its mass. at : (F, 3) m, its centre of mass in ground.
    borne : (F,) share of its weight that hands bear, 0 to 1.
    """

    kg: float
    at: Array
    borne: Array

    @property
    def weight(self) -> Array:
        """(F, 3) N that hands bear while it is still."""
        return self.kg * self.borne[:, None] * STANDARD_GRAVITY

    def inertia(self, step_s: float) -> Array:
        """(F, 3) N, mass times acceleration; none while the floor bears it."""
        moving: Array = self.kg * acceleration(self.at, step_s)
        return np.where(self.borne[:, None] > 0.0, moving, 0.0)

    @property
    def lift_off(self) -> int | None:
        """First frame in which hands bear half of it; None where they bear it from the first on, or
        never."""
        half = self.borne >= 0.5
        return int(np.argmax(half)) if half.any() and not half[0] else None


def borne_by_plates(kg: float, plates: Mapping[str, Array]) -> tuple[float, Array] | None:
    """What the load weighs on the plate it stood on, kg, and the share (F,) that hands bear of it.

    Parameters
    ----------
    plates : (F,) N upwards by name of the plate, on the clock of the markers.

    Returns
    -------
    None where no plate bears less by its weight at the end than at the beginning.
    """
    for upwards in plates.values():
        part = max(1, len(upwards) // TENTH)
        before, after = float(np.median(upwards[:part])), float(np.median(upwards[-part:]))
        weighed = (before - after) / GRAVITY_M_S2
        if abs(weighed - kg) <= SAME_WEIGHT * kg:
            return weighed, np.clip((before - upwards) / (before - after), 0.0, 1.0)
    return None


def borne_by_height(heights: Array) -> Array:
    """(F,) share that hands bear, of heights (F,) m of a load that stands on the floor at first."""
    part = max(1, len(heights) // TENTH)
    risen = heights - float(np.median(heights[:part])) > RISEN_M
    return np.where(np.maximum.accumulate(risen), 1.0, 0.0)
