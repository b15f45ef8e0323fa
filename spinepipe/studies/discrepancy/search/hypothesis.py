"""A hypothesis: the base and the effects that are said to be there, as models and unknowns.

Unknowns are shared between specimens or of one; each moves rows of an effect's values.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from spinepipe.discrepancy.forms import Form, Variant
from spinepipe.effects import Spread
from spinepipe.effects.contract import Array
from spinepipe.model import ScopedEffect, SpineModel
from spinepipe.statics import FreeParameter, declared

LOG_STIFFNESS_SD = 3.0
"""Prior SD of the logarithm of a base stiffness: it only keeps what no test tells from running."""

STRENGTH_SDS = 5.0
"""Prior of a strength in a fit, in its declared prior SDs: wide, bounds do the rest."""


@dataclass(frozen=True)
class Supposed:
    """A form said to be there, with the values from which its fit starts.

    Attributes
    ----------
    start : (P,) values of all parameters, at each place the same.
    """

    form: Form
    start: Array


@dataclass(frozen=True)
class Unknown:
    """One number that a fit moves: of the base, or of a supposed effect (its number) and column.

    Attributes
    ----------
    place : joint, specimen or test it is of, in words; empty for all.
    low, high : bounds of the move from the start. mean, sd : its prior, of the move.
    """

    label: str
    supposed: int | None
    column: int
    place: tuple[str, ...]
    is_strength: bool
    low: float
    high: float
    mean: float
    sd: float


@dataclass(frozen=True)
class Member:
    """A specimen's model at the start, its unknowns and their numbers among all."""

    model: SpineModel
    free: tuple[FreeParameter, ...]
    numbers: tuple[int, ...]


@dataclass(frozen=True)
class Hypothesis:
    """Members by specimen and all unknowns."""

    members: Mapping[str, Member]
    unknowns: tuple[Unknown, ...]
    supposed: tuple[Supposed, ...]


def hypothesis(
    models: Mapping[str, SpineModel],
    base: Mapping[str, Sequence[FreeParameter]],
    supposed: Sequence[Supposed],
    tests: Sequence[str],
    bound: float,
) -> Hypothesis:
    """The base models with the supposed effects behind theirs.

    Parameters
    ----------
    models : by specimen, where the base starts. base : their free base parameters.
    tests : names for effects that differ by test. bound : factor by which stiffness may move.
    """
    unknowns: dict[str, Unknown] = {}
    members = {}
    for specimen, model in models.items():
        free = list(base[specimen])
        labels = []
        for parameter in free:
            label = f"base|{specimen}|{parameter.label}"
            reach = float(np.log(bound))
            place = (specimen, parameter.label)
            unknowns[label] = Unknown(
                label, None, 0, place, False, -reach, reach, 0.0, LOG_STIFFNESS_SD
            )
            labels.append(label)
        effects = list(model.effects)
        for number, one in enumerate(supposed):
            if one.form.acts_in(specimen):
                for scoped in _scoped(one, model.n_joints, tests):
                    effects.append(scoped)
                    at_work = model.with_effects(tuple(effects))
                    for parameter, unknown in _unknowns(one, number, at_work, specimen):
                        unknowns.setdefault(unknown.label, unknown)
                        free.append(parameter)
                        labels.append(unknown.label)
        members[specimen] = (model.with_effects(tuple(effects)), tuple(free), labels)
    order = {label: number for number, label in enumerate(unknowns)}
    return Hypothesis(
        {
            name: Member(model, free, tuple(order[label] for label in labels))
            for name, (model, free, labels) in members.items()
        },
        tuple(unknowns.values()),
        tuple(supposed),
    )


def _scoped(one: Supposed, joints: int, tests: Sequence[str]) -> list[ScopedEffect]:
    """The effect on its joints; one copy per test where it differs by test."""
    effect = one.form.variant.create()
    places = tuple(range(joints)) if one.form.joint is None else (one.form.joint,)
    rows = len(places) if effect.per_joint else 1
    scoped = ScopedEffect(effect, places, np.tile(one.start, (rows, 1)))
    if one.form.spread is Spread.BY_TEST:
        return [replace(scoped, tests=(test,)) for test in tests]
    return [scoped]


def _unknowns(
    one: Supposed, number: int, model: SpineModel, specimen: str
) -> list[tuple[FreeParameter, Unknown]]:
    """Unknowns of the effect that stands last in the model."""
    index = len(model.effects) - 1
    scoped, variant, spread = model.effects[index], one.form.variant, one.form.spread
    every = tuple(range(len(scoped.values)))
    own_rows = spread in (Spread.BY_JOINT, Spread.EACH)
    strength_rows = [(row,) for row in every] if own_rows else [every]
    found = []
    for column in (*variant.strengths, *variant.shapes):
        is_strength = column in variant.strengths
        for rows in strength_rows if is_strength else [every]:
            place: list[str] = []
            if is_strength and spread in (Spread.BY_SPECIMEN, Spread.EACH, Spread.ONE):
                place.append(specimen)
            if (is_strength and own_rows) or one.form.joint is not None:
                place.append(model.joints[scoped.joints[rows[0]]])
            if spread is Spread.BY_TEST and is_strength:
                place.append(scoped.tests[0])
            found.append(_unknown(variant, number, index, column, rows, tuple(place), model))
    return found


def _unknown(
    variant: Variant,
    number: int,
    index: int,
    column: int,
    rows: tuple[int, ...],
    place: tuple[str, ...],
    model: SpineModel,
) -> tuple[FreeParameter, Unknown]:
    parameter = model.effects[index].effect.parameters[column]
    free = FreeParameter(parameter.name, index, column, rows, parameter.logarithmic)
    limits = declared(model, free)
    start = float(model.effects[index].values[rows[0], column])
    centre = limits.default if limits.off is None else limits.off

    def move(value: float) -> float:
        return float(np.log(value / start)) if limits.logarithmic else value - start

    low = move(limits.low) if limits.low > 0.0 or not limits.logarithmic else -np.inf
    width = 1.0 if limits.off is None else STRENGTH_SDS
    label = "|".join([str(number), variant.effect, parameter.name, *place])
    unknown = Unknown(
        label,
        number,
        column,
        place,
        limits.off is not None,
        low,
        move(limits.high),
        move(centre),
        width * limits.prior_scale,
    )
    return free, unknown
