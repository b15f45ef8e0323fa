"""Forms of an effect that a search tries: which variant, and how its values may differ where."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from spinepipe.effects import Effect, Parameter, Spread, Trial, create, registered
from spinepipe.effects.contract import Array
from spinepipe.units import COORDINATES

SHAPE_SDS = (-1.0, 0.0, 1.0)
"""Prior SDs from its default at which a parameter of shape is tried before it is fitted."""

Options = tuple[tuple[str, Any], ...]


@dataclass(frozen=True)
class Variant:
    """An effect with its options, apart from where it acts."""

    effect: str
    options: Options

    def create(self) -> Effect:
        """The effect itself."""
        return create(self.effect, dict(self.options))

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
class Form:
    """A variant and how its values may differ; joint, specimen and test for one place only."""

    variant: Variant
    spread: Spread
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
    forms: tuple[Form, ...]

    def log_share(self, form: Form) -> float:
        """Logarithm of a form's share of its effect: equal for variants, ways to differ, places."""
        spreads = len({one.spread for one in self.forms})
        like = [f for f in self.forms if (f.variant, f.spread) == (form.variant, form.spread)]
        return -float(np.log(len(self.variants) * spreads * max(len(like), 1)))


def shape_at(parameter: Parameter, sds: float) -> float:
    """Value of a shape that many prior SDs from its default, inside its bounds."""
    away = sds * parameter.prior_scale
    value = parameter.default * np.exp(away) if parameter.logarithmic else parameter.default + away
    return float(np.clip(value, parameter.low, parameter.high))


def shape_grid(variant: Variant) -> list[tuple[float, ...]]:
    """Prior SDs of the shapes at which a variant is tried; one empty point without shapes."""
    return list(product(SHAPE_SDS, repeat=len(variant.shapes)))


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
        trial: Trial | None = getattr(cls, "trial", None)
        if trial is not None and (names is None or name in names):
            every = (Variant(name, _options(options)) for options in trial.variants)
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
    """Whether a variant acts on coordinates with readings, as far as it says on which."""
    options = dict(variant.options)
    named = [c for c in (options.get("coordinate"), *options.get("pair", ())) if c in COORDINATES]
    return not named or bool(set(named) & set(coordinates))


def _options(options: Mapping[str, Any]) -> Options:
    return tuple(
        (key, tuple(value) if isinstance(value, list) else value) for key, value in options.items()
    )


def _possible(spreads: Sequence[Spread], specimens: int) -> list[Spread]:
    """With one specimen, what is shared by all specimens and what is of one are the same."""
    if specimens > 1:
        return list(spreads)
    same = {
        Spread.BY_SPECIMEN: Spread.SHARED,
        Spread.EACH: Spread.BY_JOINT,
        Spread.ONE: Spread.ONE_JOINT,
    }
    return list(dict.fromkeys(same.get(spread, spread) for spread in spreads))


def _forms(variant: Variant, spread: Spread, specimens: Sequence[str], joints: int) -> list[Form]:
    if spread is Spread.ONE_JOINT:
        return [Form(variant, spread, joint) for joint in range(joints)]
    if spread is Spread.ONE:
        return [Form(variant, spread, j, s) for s in specimens for j in range(joints)]
    return [Form(variant, spread)]


def _columns(effect: Effect, *, strengths: bool) -> tuple[int, ...]:
    return tuple(c for c, p in enumerate(effect.parameters) if (p.off is not None) == strengths)
