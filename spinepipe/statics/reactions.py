"""What a rig takes to fix joint coordinates: the load it puts on them, and its derivatives.

A reaction is positive in the direction of its coordinate: N on a translation, N m on a rotation.
The listed loads act besides. So where the rig's load was measured and is listed, the true model
leaves no reaction.
"""

from collections.abc import Sequence

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.statics.path import SolvedStep
from spinepipe.statics.sensitivity import (
    FreeParameter,
    step_by_step,
    unsupported_by_parameters,
)
from spinepipe.statics.system import System


def reaction(system: System, step: SolvedStep) -> Array:
    """(n,) load of the rig on each coordinate that it fixes, zero on the others."""
    found = np.zeros(system.chain.n)
    balance = system.unsupported(step.equilibrium.q, step.loading, step.states)
    found[system.fixed] = balance.residual[system.fixed]
    return found


def reactions_by(
    system: System, solved: Sequence[SolvedStep], free: Sequence[FreeParameter]
) -> list[Array]:
    """(n, m) derivative of each step's reaction by the m unknowns.

    Raises
    ------
    ValueError
        When a step has no equilibrium.
    """
    result = []
    for step, dq, state_by_x in step_by_step(system, solved, free):
        found = np.zeros(dq.shape)
        tangent = system.unsupported(step.equilibrium.q, step.loading, step.states).tangent
        own = unsupported_by_parameters(system, step, free, state_by_x)
        found[system.fixed] = (own + tangent @ dq)[system.fixed]
        result.append(found)
    return result
