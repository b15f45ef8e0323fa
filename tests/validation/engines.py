"""Stacks of runs against the engine of record on thousands of random models.

Chains of 1 to 17 joints with tilted frames and weight; each effect alone, all pairs, several at a
time; a test that goes up and back, at loads from small ones to such as some chains do not carry.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import pandas as pd

from spinepipe.effects import Effect
from spinepipe.effects.contract import Array
from spinepipe.model import LoadCase, SpineModel
from spinepipe.statics import System, by_parameters, follow
from spinepipe.statics.batched import Stack, poses_by
from spinepipe.world import Chain
from tests.cases import random_stacks as draw

MODELS = 20_000
STACK = 50
"""Models that are solved together."""

JOINTS = (1, 2, 3, 4, 6, 8, 12, 17)
DERIVED = 10
"""One model in so many also has its derivatives compared."""

LEAST_MOTION = np.array([1e-4] * 3 + [1e-3] * 3)
"""m and rad: smaller motion is held against this."""

Run = tuple[SpineModel, LoadCase]


@dataclass(frozen=True)
class Compared:
    """One model in both engines.

    Attributes
    ----------
    agree : whether both find a stable pose in every step, or both do not.
    handed_over : whether the stack asked the engine of record.
    off, derivative_off : largest difference, of the largest motion or of the largest derivative by
        each unknown; NaN where there is nothing to compare.
    """

    joints: int
    effects: str
    stands: bool
    agree: bool
    handed_over: bool
    off: float
    derivative_off: float


def table(models: int = MODELS) -> pd.DataFrame:
    """A row for each number of joints and way of choosing effects."""
    compared = []
    for number, (joints, kind, runs) in enumerate(_stacks(models)):
        compared += _compare(joints, kind, runs)
        if number % 10 == 9:
            print(f"engines: {len(compared)} of {models} models", flush=True)
    return _summary(pd.DataFrame(compared))


def _stacks(models: int) -> Iterator[tuple[int, str, list[Run]]]:
    """Stacks of random models until there are so many."""
    every = [effect for effect in draw.variants() if draw.stackable(effect)]
    choices = {
        "each alone": [(effect,) for effect in every],
        "pairs": list(combinations(every, 2)),
        "three to five": [],
    }
    for number in range(models // STACK):
        rng = np.random.default_rng(number)
        joints, kind = JOINTS[number % len(JOINTS)], list(choices)[number // len(JOINTS) % 3]
        runs = []
        for k in range(STACK):
            place = number // (3 * len(JOINTS)) * STACK + k
            share = float(10.0 ** rng.uniform(-0.7, 2.0)) / joints**1.5
            chosen = _chosen(choices[kind], every, place, rng)
            runs.append(draw.model(rng, joints, chosen, share))
        yield joints, kind, runs


def _chosen(
    choices: Sequence[tuple[Effect, ...]],
    every: Sequence[Effect],
    place: int,
    rng: np.random.Generator,
) -> tuple[Effect, ...]:
    """One choice after the other, or some at random."""
    if choices:
        return choices[place % len(choices)]
    count = int(rng.integers(3, 6))
    return tuple(every[k] for k in rng.choice(len(every), count, replace=False).tolist())


def _compare(joints: int, kind: str, runs: Sequence[Run]) -> Iterator[Compared]:
    """Each run of a stack against the engine of record."""
    stack = _stack_of(runs)
    found = stack.solve()
    for number, (model, case) in enumerate(runs):
        q = found.q[stack.lanes(np.array([number]))]
        system = System(Chain(model), model, case)
        solved = follow(system)
        stands = all(step.usable for step in solved)
        agree = bool(np.isfinite(q).all()) == stands
        off, derivative_off = np.nan, np.nan
        if stands and agree:
            expected = np.reshape([step.equilibrium.q for step in solved], q.shape)
            motion = np.maximum(np.abs(expected).max(axis=(0, 1)), LEAST_MOTION)
            off = float((np.abs(q - expected) / motion).max())
            if number % DERIVED == 0:
                derivative_off = _derivatives_off((model, case), system, q)
        handed = bool(found.by_engine[number])
        yield Compared(joints, kind, stands, agree, handed, off, derivative_off)


def _stack_of(runs: Sequence[Run]) -> Stack:
    return Stack.of([model for model, _ in runs], [(n, case) for n, (_, case) in enumerate(runs)])


def _derivatives_off(run: Run, system: System, q: Array) -> float:
    """Largest difference of derivatives, each column held against its largest."""
    free = draw.unknowns(run[0])
    found = poses_by(_stack_of([run]), q, [free])
    expected = np.reshape(by_parameters(system, draw.solved(system), free), found.shape)
    largest = np.maximum(np.abs(expected).max(axis=(0, 1, 2)), 1e-6)
    return float((np.abs(found - expected) / largest).max())


def _summary(compared: pd.DataFrame) -> pd.DataFrame:
    groups = compared.groupby(["joints", "effects"], sort=True)
    return groups.agg(
        models=("stands", "size"),
        standing=("stands", "sum"),
        engines_disagree=("agree", lambda agree: int((~agree).sum())),
        standing_handed_over=(
            "handed_over",
            lambda h: int((h & compared.loc[h.index, "stands"]).sum()),
        ),
        worst_difference=("off", "max"),
        worst_difference_of_a_derivative=("derivative_off", "max"),
    ).reset_index()
