"""Random models with random effects in random tests, for comparing engines."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from spinepipe.effects import Effect, EffectKind, create, registered
from spinepipe.effects.contract import Array
from spinepipe.model import LoadCase, LoadStep, ScopedEffect, SpineModel
from spinepipe.statics import FreeParameter, SolvedStep, System, follow, free_parameters
from spinepipe.statics.equilibrium import factor
from tests.cases.sweeps import one_of_each
from tests.reference import bridge
from tests.reference.peers import chain as chains

SOFT = 0.25
"""Share of a typical strength, so that most chains stand."""


def variants() -> list[Effect]:
    """Every variant of every effect that is tried, and each other effect as it comes."""
    found = []
    for name, cls in sorted(registered().items()):
        trial = getattr(cls, "trial", None)
        options = trial.variants if trial else ({},)
        found += [create(name, dict(one)) for one in options]
    return [effect for effect in found if effect.name != "linear_bushing"]


def few() -> list[Effect]:
    """Every effect and every form of it, at one place each."""
    return one_of_each(variants(), lambda effect: (effect.name, vars(effect)))


def values(effect: Effect, rows: int, rng: np.random.Generator) -> Array:
    """(R, P) values that are on, within a prior SD of what is usual."""
    found = np.zeros((rows, len(effect.parameters)))
    for column, p in enumerate(effect.parameters):
        if p.off is None:
            moved = p.default * np.exp(0.3 * rng.normal(size=rows))
        elif p.logarithmic:
            moved = p.off * np.exp(0.3 * p.prior_scale * rng.normal(size=rows))
        else:
            side = p.side or rng.choice([-1.0, 1.0], rows)
            moved = p.off + SOFT * side * p.prior_scale * rng.uniform(0.2, 1.0, rows)
        found[:, column] = np.clip(moved, p.low, p.high)
    return found


def scoped(
    effect: Effect, n_joints: int, rng: np.random.Generator, tests: Sequence[str] = ("*",)
) -> ScopedEffect:
    """The effect on some of the joints."""
    count = int(rng.integers(1, n_joints + 1))
    joints = tuple(sorted(rng.choice(n_joints, count, replace=False).tolist()))
    rows = len(joints) if effect.per_joint else 1
    return ScopedEffect(effect, joints, values(effect, rows, rng), tuple(tests))


def model(
    rng: np.random.Generator, n_joints: int, effects: Sequence[Effect], share: float = 1.0
) -> tuple[SpineModel, LoadCase]:
    """A chain with tilted frames, weight and these effects, and a test that goes up and back."""
    chain = chains.random_chain(rng, n_joints)
    plain = bridge.spine_model(chain)
    every = (*plain.effects, *(scoped(effect, n_joints, rng) for effect in effects))
    return plain.with_effects(every), timed(bridge.load_case(chain, *(share * SHARES)))


SHARES = np.array([0.0, 0.5, 1.0, 1.0, 0.4, -0.5])


def timed(case: LoadCase) -> LoadCase:
    """The same with a time for each step."""
    steps = tuple(LoadStep(s.step, s.wrenches, 7.0 * (n + 1)) for n, s in enumerate(case.steps))
    return LoadCase(case.test, case.cycle, steps)


def stackable(effect: Effect) -> bool:
    """Whether the stack takes it."""
    return effect.kind is not EffectKind.LOAD


def unknowns(model: SpineModel) -> tuple[FreeParameter, ...]:
    """All parameters of all effects, joint by joint."""
    return tuple(
        unknown
        for number, here in enumerate(model.effects)
        for unknown in free_parameters(
            model, number, [p.name for p in here.effect.parameters], "per_joint"
        )
    )


def solved(system: System) -> list[SolvedStep]:
    """Steps with the tangent at their pose; Newton leaves that of one tiny step before."""
    found = []
    for step in follow(system):
        tangent = system.balance(step.equilibrium.q, step.loading, step.states).tangent
        there = replace(step.equilibrium, factored=factor(tangent))
        found.append(replace(step, equilibrium=there))
    return found
