"""A case step by step: each equilibrium starts from the last, path states advance in between."""

from dataclasses import dataclass, replace

import numpy as np

from spinepipe.effects import Advance
from spinepipe.effects.contract import Array
from spinepipe.model import LoadStep
from spinepipe.statics.equilibrium import Equilibrium, LUFactors, solve
from spinepipe.statics.joint_forces import States, states_after
from spinepipe.statics.system import Loading, System


@dataclass(frozen=True)
class SolvedStep:
    """One load step: the pose it ended in and what was needed to get there.

    Attributes
    ----------
    states : path states that acted during the step. advances : how they moved on after it.
    """

    step: LoadStep
    loading: Loading
    equilibrium: Equilibrium
    states: States
    advances: dict[int, Advance]

    @property
    def usable(self) -> bool:
        """Whether the pose is an equilibrium."""
        return self.equilibrium.status.usable

    @property
    def factored(self) -> LUFactors:
        """LU of the tangent at the pose.

        Raises
        ------
        ValueError
            When the step has no equilibrium.
        """
        if self.equilibrium.factored is None:
            raise ValueError(f"step {self.step.step} has no equilibrium to differentiate")
        return self.equilibrium.factored


def follow(system: System, guesses: list[Array] | None = None) -> list[SolvedStep]:
    """Solve all steps of the system's case in order.

    After a step without a stable equilibrium the rest is not tried: their rows carry the status
    and say so.

    Parameters
    ----------
    guesses : (n,) poses close to the solutions, one per step, from a neighbouring problem.
    """
    solved: list[SolvedStep] = []
    q, before, states = np.zeros(system.chain.n), system.unloaded(), system.initial_states()
    clock = 0.0
    for number, step in enumerate(system.case.steps):
        loading = system.loading(step)
        time = clock if step.time is None else step.time
        states, clock = replace(states, seconds=time - clock), time
        if solved and not solved[-1].usable:
            equilibrium = replace(solved[-1].equilibrium, message="an earlier load step failed")
            solved.append(SolvedStep(step, loading, equilibrium, states, {}))
            continue
        guess = None if guesses is None else guesses[number]
        equilibrium = solve(system, q, before, loading, states, guess, step.step)
        # path states after the step, at the coordinates that the laws see
        advances: dict[int, Advance] = {}
        if system.paths:
            joints = equilibrium.q.reshape(-1, 6)
            if system.geometry:
                joints = system.joint_kinematics(equilibrium.q, by_parameters=False).q
            advances = states_after(joints, system.laws, states)
        solved.append(SolvedStep(step, loading, equilibrium, states, advances))
        q, before = equilibrium.q, loading
        states = States({index: advance.state for index, advance in advances.items()})
    return solved


def reaction(system: System, step: SolvedStep) -> Array:
    """(n,) load of the rig on each coordinate that it fixes, zero on the others.

    Positive in the direction of its coordinate: N on a translation, N m on a rotation. The listed
    loads act besides: where the rig's load was measured and is listed, the true model leaves none.
    """
    found = np.zeros(system.chain.n)
    balance = system.unsupported(step.equilibrium.q, step.loading, step.states)
    found[system.fixed] = balance.residual[system.fixed]
    return found
