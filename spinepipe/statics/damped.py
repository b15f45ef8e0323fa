"""Newton held back by a line search: the way to an equilibrium across corners in a path law.

Friction meets a joint that turns on and one that turns back with different slopes, and full
Newton steps may jump to and fro between them. The load is still continuous and grows along every
direction, so the work along a step has a least value; steps that stop near it arrive.
"""

import numpy as np
from scipy.optimize import brentq

from spinepipe.effects.contract import Array
from spinepipe.statics.holding import States
from spinepipe.statics.linear import SingularTangent, factor
from spinepipe.statics.loading import Loading
from spinepipe.statics.system import System

MOST_STEPS = 60
NEAR = np.array([1e-9] * 3 + [1e-7] * 3)
"""m and rad: a step this small ends on the pose's side of every corner that matters."""


def approach(system: System, start: Array, loading: Loading, states: States) -> Array | None:
    """Pose (n,) next to the equilibrium under a loading, or None when the way there is lost."""
    q = start
    for _ in range(MOST_STEPS):
        balance = system.balance(q, loading, states)
        try:
            step = factor(balance.tangent).solve(-balance.residual)
        except SingularTangent:
            return None
        if not balance.residual @ step < 0.0:
            return None
        step = step * _share(system, q, step, loading, states, float(balance.residual @ step))
        q = q + step
        if (np.abs(step).reshape(-1, 6) < NEAR).all():
            return q
    return None


def _share(
    system: System, q: Array, step: Array, loading: Loading, states: States, slope: float
) -> float:
    """Share of a step at which the work along it is near its least, or the whole step."""

    def work(share: float) -> float:
        return float(system.residual(q + share * step, loading, states) @ step)

    if not work(1.0) > -0.5 * slope:
        return 1.0
    share: float = brentq(work, 0.0, 1.0, xtol=1e-9, rtol=0.1)
    return share
