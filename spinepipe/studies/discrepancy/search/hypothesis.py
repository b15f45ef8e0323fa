"""A hypothesis: the base and the effects that are said to be there, as models and unknowns.

An effect has a form: which variant, and how its values may differ where. Unknowns are shared
between specimens or of one; each moves rows of an effect's values.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from itertools import product
from typing import Any

import numpy as np

from spinepipe.effects import Effect, Parameter, PlaceSpread, TriedValues, create, registered
from spinepipe.effects.carried_share import coordinates_of
from spinepipe.effects.contract import Array
from spinepipe.model import ScopedEffect, SpineModel
from spinepipe.statics import FreeParameter, declared
from spinepipe.units import TRANSLATIONS

Options = tuple[tuple[str, Any], ...]


@dataclass(frozen=True)
class Variant:
    """An effect with its options, apart from where it acts."""

    effect: str
    options: Options

    def create(self) -> Effect:
        """The effect itself."""
        return _created(self, registered().get(self.effect))

    def coordinates(self, read: Sequence[str]) -> tuple[str, ...]:
        """Those of the read coordinates that it loads by its options; all, if it names none."""
        return tuple(name for name in read if name in self.acts_on) or tuple(read)

    @property
    def acts_on(self) -> tuple[str, ...]:
        """Coordinates that it loads by its options; none, if it names none."""
        options = dict(self.options)
        if "coordinate" in options:
            return coordinates_of(options["coordinate"])
        return tuple(options.get("pair", ()))

    @property
    def strengths(self) -> tuple[int, ...]:
        """Columns of the parameters that switch the effect on."""
        return _columns(self.create(), strengths=True)

    @property
    def shapes(self) -> tuple[int, ...]:
        """Columns of the parameters of shape."""
        return _columns(self.create(), strengths=False)

    def off(self, sds: Sequence[float]) -> Array:
        """(P,) values with all strengths off and shapes that many prior SDs from their default."""
        effect = self.create()
        values = np.array([p.default if p.off is None else p.off for p in effect.parameters])
        for column, sd in zip(self.shapes, sds, strict=True):
            values[column] = shape_at(effect.parameters[column], sd)
        return values


@dataclass(frozen=True)
class CandidateForm:
    """A variant and how its values may differ; joint, specimen and test for one place only."""

    variant: Variant
    spread: PlaceSpread
    joint: int | None = None
    specimen: str | None = None

    @property
    def name(self) -> str:
        """Name of the effect."""
        return self.variant.effect

    def acts_in(self, specimen: str) -> bool:
        """Whether a specimen has the effect."""
        return self.specimen in (None, specimen)


@dataclass(frozen=True)
class Trials:
    """All that is tried of one effect."""

    effect: str
    variants: tuple[Variant, ...]
    forms: tuple[CandidateForm, ...]

    def log_share(self, form: CandidateForm) -> float:
        """Logarithm of a form's share of its effect: equal for variants, ways to differ, places."""
        spreads, places = self._counts
        shares = places.get((form.variant, form.spread), 1)
        return -float(np.log(len(self.variants) * spreads * shares))

    @cached_property
    def _counts(self) -> tuple[int, Mapping[tuple[Variant, PlaceSpread], int]]:
        """Number of ways to differ, and of forms of each variant and way to differ."""
        pairs = Counter((one.variant, one.spread) for one in self.forms)
        return len({spread for _, spread in pairs}), pairs


@cache
def _created(variant: Variant, cls: type | None) -> Effect:
    """The effect of a variant, made once for each class of its name."""
    return create(variant.effect, dict(variant.options))


def shape_at(parameter: Parameter, sds: float) -> float:
    """Value of a shape that many prior SDs from its default, inside its bounds."""
    away = sds * parameter.prior_scale
    value = parameter.default * np.exp(away) if parameter.logarithmic else parameter.default + away
    return float(np.clip(value, parameter.low, parameter.high))


def shape_grid(variant: Variant) -> list[tuple[float, ...]]:
    """Prior SDs of the shapes at which a variant is tried; one empty point without shapes.

    Each shape says at how many: those that span published forms are told apart by the refit.
    """
    parameters = variant.create().parameters
    return list(product(*(parameters[column].tried for column in variant.shapes)))


def usual_shapes(variant: Variant) -> tuple[float, ...]:
    """The point of the grid with every shape nearest to its default."""
    return min(shape_grid(variant), key=lambda sds: sum(abs(one) for one in sds))


def trials(
    names: Sequence[str] | None, coordinates: Sequence[str], specimens: Sequence[str], joints: int
) -> tuple[Trials, ...]:
    """What is tried of each effect that may be missing, in alphabetical order.

    Parameters
    ----------
    names : effects to try; None for all that declare how. coordinates : those with readings.
    """
    found = []
    for name, cls in sorted(registered().items()):
        trial: TriedValues | None = getattr(cls, "trial", None)
        if trial is not None and (names is None or name in names):
            every = [
                Variant(
                    name,
                    tuple((k, tuple(v) if isinstance(v, list) else v) for k, v in options.items()),
                )
                for options in trial.variants
            ]
            variants = tuple(variant for variant in every if _is_read(variant, coordinates))
            forms = [
                form
                for variant in variants
                for spread in _possible(trial.spreads, len(specimens))
                for form in _forms(variant, spread, specimens, joints)
            ]
            if variants:
                found.append(Trials(name, variants, tuple(forms)))
    return tuple(found)


def _is_read(variant: Variant, coordinates: Sequence[str]) -> bool:
    """Whether a variant acts on coordinates with readings, as far as it says on which.

    Of a kind, one that is read will do; what rotation and translation do to each other is of second
    order where one of the two is hidden.
    """
    loaded = {name in TRANSLATIONS for name in variant.acts_on}
    return loaded == {name in TRANSLATIONS for name in variant.acts_on if name in coordinates}


def _possible(spreads: Sequence[PlaceSpread], specimens: int) -> list[PlaceSpread]:
    """With one specimen, what is shared by all specimens and what is of one are the same."""
    if specimens > 1:
        return list(spreads)
    same = {
        PlaceSpread.BY_SPECIMEN: PlaceSpread.SHARED,
        PlaceSpread.EACH: PlaceSpread.BY_JOINT,
        PlaceSpread.ONE: PlaceSpread.ONE_JOINT,
    }
    return list(dict.fromkeys(same.get(spread, spread) for spread in spreads))


def _forms(
    variant: Variant, spread: PlaceSpread, specimens: Sequence[str], joints: int
) -> list[CandidateForm]:
    if spread is PlaceSpread.ONE_JOINT:
        return [CandidateForm(variant, spread, joint) for joint in range(joints)]
    if spread is PlaceSpread.ONE:
        return [CandidateForm(variant, spread, j, s) for s in specimens for j in range(joints)]
    return [CandidateForm(variant, spread)]


def _columns(effect: Effect, *, strengths: bool) -> tuple[int, ...]:
    return tuple(c for c, p in enumerate(effect.parameters) if (p.off is not None) == strengths)


LOG_STIFFNESS_SD = 3.0
"""Prior SD of the logarithm of a base stiffness: it only keeps what no test tells from running."""

STRENGTH_SDS = 5.0
"""Prior of a strength in a fit, in its declared prior SDs: wide, bounds do the rest."""


@dataclass(frozen=True)
class ActiveTerm:
    """A form said to be there, with the values from which its fit starts.

    Attributes
    ----------
    start : (P,) values of all parameters, at each place the same.
    """

    form: CandidateForm
    start: Array

    def copies(self, specimen: str, tests: int) -> int:
        """How many effects it is in the model of a specimen."""
        if not self.form.acts_in(specimen):
            return 0
        return tests if self.form.spread is PlaceSpread.BY_TEST else 1


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

    @property
    def step(self) -> float:
        """Size of a first step: a prior SD, of base stiffnesses one in the logarithm."""
        return self.sd / STRENGTH_SDS if self.is_strength else min(self.sd, 1.0)


@dataclass(frozen=True)
class HypothesisMember:
    """A specimen's model at the start, its unknowns and their numbers among all."""

    model: SpineModel
    free: tuple[FreeParameter, ...]
    numbers: tuple[int, ...]

    def among_all(self, own: Array, unknowns: int) -> Array:
        """(N, m) columns (N, k) by its own unknowns put in their places among all."""
        whole = np.zeros((len(own), unknowns))
        np.add.at(whole.T, np.array(self.numbers), own.T)  # one number may stand for several
        return whole


@dataclass(frozen=True)
class Hypothesis:
    """Members by specimen and all unknowns."""

    members: Mapping[str, HypothesisMember]
    unknowns: tuple[Unknown, ...]
    supposed: tuple[ActiveTerm, ...]


def hypothesis(
    models: Mapping[str, SpineModel],
    base: Mapping[str, Sequence[FreeParameter]],
    supposed: Sequence[ActiveTerm],
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
            name: HypothesisMember(model, free, tuple(order[label] for label in labels))
            for name, (model, free, labels) in members.items()
        },
        tuple(unknowns.values()),
        tuple(supposed),
    )


def _scoped(one: ActiveTerm, joints: int, tests: Sequence[str]) -> list[ScopedEffect]:
    """The effect on its joints; one copy per test where it differs by test."""
    effect = one.form.variant.create()
    places = tuple(range(joints)) if one.form.joint is None else (one.form.joint,)
    rows = len(places) if effect.per_joint else 1
    scoped = ScopedEffect(effect, places, np.tile(one.start, (rows, 1)))
    if one.form.spread is PlaceSpread.BY_TEST:
        return [replace(scoped, tests=(test,)) for test in tests]
    return [scoped]


def _unknowns(
    one: ActiveTerm, number: int, model: SpineModel, specimen: str
) -> list[tuple[FreeParameter, Unknown]]:
    """Unknowns of the effect that stands last in the model."""
    index = len(model.effects) - 1
    scoped, variant, spread = model.effects[index], one.form.variant, one.form.spread
    every = tuple(range(len(scoped.values)))
    own_rows = spread in (PlaceSpread.BY_JOINT, PlaceSpread.EACH)
    strength_rows = [(row,) for row in every] if own_rows else [every]
    found = []
    for column in (*variant.strengths, *variant.shapes):
        is_strength = column in variant.strengths
        for rows in strength_rows if is_strength else [every]:
            place: list[str] = []
            if is_strength and spread in (
                PlaceSpread.BY_SPECIMEN,
                PlaceSpread.EACH,
                PlaceSpread.ONE,
            ):
                place.append(specimen)
            if (is_strength and own_rows) or one.form.joint is not None:
                place.append(model.joints[scoped.joints[rows[0]]])
            if spread is PlaceSpread.BY_TEST and is_strength:
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
