"""How strong an effect must be for the gap that is wanted."""

import numpy as np
from scipy.optimize import brentq

from .entry import Entry
from .gap import Meter
from .recipe import Hidden
from .solve import NoEquilibriumError

CLOSE = 0.03
"""Share by which the gap may miss the wanted one."""
TOO_STRONG = 3.0
"""Logarithm of the gap over the wanted one where there is no equilibrium any more."""
SMALLEST_GAP = 1e-6
LONGEST_STEP = 2.5
MOST_STEPS, MOST_TRIALS = 8, 10


class Trials:
    """Gaps of one effect at the strengths tried so far."""

    def __init__(self, meter: Meter, hidden: Hidden, wanted: float) -> None:
        self.meter, self.hidden, self.wanted = meter, hidden, wanted
        self.gaps: dict[float, float] = {}

    def excess(self, log_strength: float) -> float:
        """Logarithm of the gap over the wanted one; 0 where that is close enough."""
        strength = float(np.exp(log_strength))
        try:
            gap = self.gaps.get(strength) or self.meter.gap([(self.hidden, strength)])
        except NoEquilibriumError:
            return TOO_STRONG
        self.gaps[strength] = gap
        return 0.0 if self._miss(gap) < CLOSE else float(np.log(gap + SMALLEST_GAP) - self._goal)

    def best(self) -> tuple[float, float]:
        """The strength whose gap came nearest, and that gap."""
        if not self.gaps:
            raise NoEquilibriumError(f"{self.hidden.name}: none at any strength tried")
        return min(self.gaps.items(), key=lambda item: self._miss(item[1]))

    @property
    def _goal(self) -> float:
        return float(np.log(self.wanted))

    def _miss(self, gap: float) -> float:
        return abs(float(np.log(gap + SMALLEST_GAP)) - self._goal)


def scaled(meter: Meter, hidden: Hidden, wanted: float, entry: Entry) -> tuple[float, float]:
    """Strength whose gap is the wanted one, or the best that is plausible; and its gap."""
    trials = Trials(meter, hidden, wanted)
    size = entry.size(hidden.coordinate, meter.recipe)
    ends = _bracket(trials, np.log(size * entry.start), np.log(size * entry.top))
    if ends is not None:
        brentq(trials.excess, *ends, xtol=1e-4, maxiter=MOST_TRIALS, disp=False)
    return trials.best()


def _bracket(trials: Trials, x: float, top: float) -> tuple[float, float] | None:
    """Two logarithms of strength around the goal; None where it is met or out of reach."""
    x = min(x, top)
    y = trials.excess(x)
    for _ in range(MOST_STEPS):
        if y == 0.0 or (y < 0.0 and x >= top):
            return None
        further = min(x - np.sign(y) * min(1.1 * abs(y), LONGEST_STEP), top)
        beyond = trials.excess(further)
        if beyond * y < 0.0:
            return x, further
        x, y = further, beyond
    return None
