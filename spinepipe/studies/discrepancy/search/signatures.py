"""Signatures: what each effect, switched on a little, would do to the readings of a specimen.

The model carries every variant switched off; the simulator's exact sensitivities to the strengths
are the signatures, per joint and parameter. One column is one strength at one place.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from spinepipe.discrepancy.forms import Trials, Variant, shape_grid
from spinepipe.discrepancy.prediction import Solved
from spinepipe.effects import Spread
from spinepipe.effects.contract import Array
from spinepipe.model import ScopedEffect
from spinepipe.statics import FreeParameter

EVERY_TEST = "*"


@dataclass(frozen=True)
class Column:
    """One strength of a variant at one place.

    Attributes
    ----------
    sds : prior SDs of the shapes from their defaults. strength : column of the effect's values.
    joint : index, or None for an effect on the whole chain. test : name, or ``*``.
    scale : prior SD of the strength, of its logarithm where it is logarithmic.
    """

    variant: Variant
    sds: tuple[float, ...]
    strength: int
    joint: int | None
    test: str
    scale: float


def columns_of(trials: Trials, joints: int, tests: Sequence[str]) -> list[Column]:
    """Columns of all variants and shapes of one effect."""
    places = [EVERY_TEST]
    if any(form.spread is Spread.BY_TEST for form in trials.forms):
        places += list(tests)
    found = []
    for variant in trials.variants:
        effect = variant.create()
        rows: Iterable[int | None] = range(joints) if effect.per_joint else [None]
        for sds in shape_grid(variant):
            found += [
                Column(variant, sds, strength, joint, test, effect.parameters[strength].prior_scale)
                for strength in variant.strengths
                for joint in rows
                for test in places
            ]
    return found


def signatures(solved: Solved, columns: Sequence[Column]) -> tuple[Array, ...]:
    """(T, J, 6, m) derivative of each test's readings by each column's strength, in prior SDs."""
    model = solved.model
    scoped: dict[tuple[Variant, tuple[float, ...]], int] = {}
    effects: list[ScopedEffect] = list(model.effects)
    free = []
    for column in columns:
        key = (column.variant, column.sds)
        if key not in scoped:
            scoped[key] = len(effects)
            effects.append(idle(column.variant, column.sds, model.n_joints))
        parameter = effects[scoped[key]].effect.parameters[column.strength]
        row = 0 if column.joint is None else column.joint
        free.append(FreeParameter("", scoped[key], column.strength, (row,), parameter.logarithmic))
    found = solved.by(model.with_effects(tuple(effects)), free)
    scales = np.array([column.scale for column in columns])
    return tuple(
        by_x * np.where([column.test in (EVERY_TEST, case.test) for column in columns], scales, 0.0)
        for by_x, case in zip(found, solved.cases, strict=True)
    )


def idle(variant: Variant, sds: Sequence[float], joints: int) -> ScopedEffect:
    """The effect on all joints, switched off."""
    effect = variant.create()
    rows = joints if effect.per_joint else 1
    return ScopedEffect(effect, tuple(range(joints)), np.tile(variant.off(sds), (rows, 1)))
