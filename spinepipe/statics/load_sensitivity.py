"""Sensitivities of a solved step to its loads: force, moment and point of application."""

from dataclasses import dataclass

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.statics.motion import ChainMotion
from spinepipe.statics.path import SolvedStep
from spinepipe.statics.system import System


@dataclass(frozen=True)
class LoadSensitivity:
    """Derivatives (n, 3) of the pose by a slot's force (N), moment (N m) and point (m)."""

    by_force: Array
    by_moment: Array
    by_point: Array


def by_load(system: System, step: SolvedStep, slot: int) -> LoadSensitivity:
    """Sensitivities to the wrench at one slot of the case; the point moves with its vertebra.

    Raises
    ------
    ValueError
        When the step has no equilibrium, or the model has effects that may themselves depend on
        the listed loads: load effects, and path effects through earlier steps.
    """
    factored = step.factored
    if system.load_effects or system.paths:
        raise ValueError("load sensitivities do not cover load effects and path effects")
    motion = ChainMotion(system.chain, step.equilibrium.q)
    body, place = system.slots.places[slot]
    point, force = np.array(place), step.loading.forces[slot]
    velocities = motion.velocities(body, point)
    # A point's velocity is linear in the point: unit shifts give the exact derivative.
    shifted = [motion.velocities(body, point + shift) - velocities for shift in np.eye(3)]
    return LoadSensitivity(
        by_force=factored.solve(velocities),
        by_moment=factored.solve(motion.angular(body)),
        by_point=factored.solve(np.stack([v @ force for v in shifted], axis=1)),
    )
