"""Joints under a moment that comes and goes, for the effects that remember it."""

from collections.abc import Sequence

import numpy as np
from example_effects import NOWHERE, scoped, spine

from spinepipe.effects import Wrench, create
from spinepipe.effects.contract import Array
from spinepipe.model import LoadCase, LoadStep, ScopedEffect, SpineModel
from spinepipe.statics import System, follow
from spinepipe.world import Chain

FLEXING = np.array([0.1, 0.05, 1.0])
EXTENSION_SPRING = 41.0
"""N m/rad of the lowest joint."""


def friction(
    n: int,
    moment: float = 0.5,
    yield_deg: float = 1.0,
    coordinate: str = "extension",
    spread: float | None = None,
) -> ScopedEffect:
    """Hysteresis in all n joints, by Dahl's law; by Jenkins elements where they have a spread."""
    values = (moment, np.deg2rad(yield_deg))
    if spread is None:
        effect = create("hysteresis", {"coordinate": coordinate})
        return scoped(effect, tuple(range(n)), values)
    effect = create("hysteresis", {"coordinate": coordinate, "law": "jenkins"})
    return scoped(effect, tuple(range(n)), (*values, spread))


def creeping(
    n: int,
    fraction: float = 0.3,
    time: float = 3.0,
    coordinate: str = "extension",
    load: str = "held",
    spread: float = 0.0,
) -> ScopedEffect:
    """Creep in all n joints."""
    effect = create("creep", {"coordinate": coordinate, "load": load})
    return scoped(effect, tuple(range(n)), (fraction, time, spread))


def turning(
    model: SpineModel,
    moments: Sequence[float] | Array,
    direction: Array = FLEXING,
    times: Sequence[float] | Array | None = None,
) -> LoadCase:
    """Moments (N m) about a direction on the topmost vertebra, one a step."""
    top = model.n_joints - 1
    point = model.bodies[top].com
    steps = tuple(
        LoadStep(
            number,
            (Wrench(top, point, NOWHERE, moment * direction),),
            None if times is None else float(times[number]),
        )
        for number, moment in enumerate(moments)
    )
    return LoadCase("turning", 1, steps)


def branches(size: float, steps: int) -> Array:
    """Moments of loading, unloading to the other side and loading again, steps a branch."""
    half = np.linspace(0.0, size, steps + 1)
    whole = np.linspace(size, -size, 2 * steps + 1)
    return np.concatenate([half, whole[1:], -whole[1:]])


def one_joint(*effects: ScopedEffect) -> SpineModel:
    """A joint without weight; a moment about its own axis turns nothing but extension."""
    return spine(1, gravity=False, effects=effects)


def angles(model: SpineModel, moments: Array, times: Array | None = None) -> Array:
    """Extension (T,) of a single joint under moments about its own axis."""
    axis = model.frames[0].rotation[:, 2]
    solved = follow(System(Chain(model), model, turning(model, moments, axis, times)))
    assert all(step.usable for step in solved)
    return np.array([step.equilibrium.q[3] for step in solved])
