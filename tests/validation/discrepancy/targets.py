"""All cohorts that are scored, and the order in which they are."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np

from tests.generators.hidden import ERRORS, KNOWN, LOAD_UNIT, UNKNOWN, USUAL, Recipe
from tests.validation.discrepancy.designs import (
    OF_LAWS,
    known_effects,
    plain,
    soiled,
    with_effects,
)

STREAM = 11
DIRTY = 0.2

LARGE, SMALL = (0.55, 1.6), (0.21, 0.48)
"""Wanted gaps, log-uniform. Scaling may miss them by 5 %."""


@dataclass(frozen=True)
class Target:
    """A cohort to score. ``label`` : what is special about it, in a word."""

    kind: str
    label: str
    recipe: Recipe

    @property
    def seed(self) -> int:
        """The recipe's."""
        return self.recipe.seed


Draw = Callable[[int, int], Target]
"""From a number within the kind and a seed."""


def _gap(seed: int, ends: tuple[float, float]) -> float:
    rng = np.random.default_rng([seed, STREAM])
    return float(np.exp(rng.uniform(*np.log(ends))))


def _null(number: int, seed: int) -> Target:
    """Every kind of noise by turns."""
    noise = ("white", "serial", "outliers")[number % 3]
    return Target("null", noise, plain(seed, noise=noise))


def _dirty(number: int, seed: int) -> Target:
    """Each dirt alone, then all together."""
    kinds = [*USUAL, "all"]
    label = kinds[number % len(kinds)]
    dirt = dict(USUAL) if label == "all" else {label: USUAL[label]}
    return Target("dirty", label, plain(seed, dirt=dirt))


def _single(kind: str, ends: tuple[float, float]) -> Draw:
    def draw(number: int, seed: int) -> Target:
        names = known_effects()
        name = names[number % len(names)]
        recipe = with_effects(plain(seed, name, gap=_gap(seed, ends)), name)
        return Target(kind, name, soiled(recipe, DIRTY))

    return draw


def _pair(number: int, seed: int) -> Target:
    """Pairs of effects in a shuffled order, in designs that show both."""
    pairs = list(combinations(KNOWN, 2))
    order = np.random.default_rng(STREAM).permutation(len(pairs))
    pair = pairs[order[number % len(pairs)]]
    recipe = plain(seed, *pair, gap=_gap(seed, LARGE))
    return Target("two", "+".join(pair), with_effects(recipe, *pair))


def _alien(number: int, seed: int) -> Target:
    name = UNKNOWN[number % len(UNKNOWN)]
    fields: dict[str, Any] = {"gap": _gap(seed, LARGE)}
    recipe = plain(seed, name, **fields)
    return Target("alien", name, with_effects(recipe, name))


def _part(number: int, seed: int) -> Target:
    """An effect that is known and one that is not, on another coordinate."""
    rng = np.random.default_rng([seed, STREAM + 1])
    known, alien = OF_LAWS[number % len(OF_LAWS)], str(rng.choice(UNKNOWN))
    recipe = plain(seed, known, alien, gap=_gap(seed, (0.8, 1.6)))
    return Target("part", f"{known}+{alien}", with_effects(recipe, known, alien))


OF_SEVERAL_JOINTS = ("swapped_specimens", "bad_markers")
"""Mistakes that one joint alone does not show: its stiffness, or all noise, would be another."""

TWO_JOINTS: Mapping[str, Any] = {
    "region": "lumbar",
    "joints": 2,
    "lowest": 1,
    "design": "sweeps",
    "peak_nm": 7.5,
    "peak_n": 0.0,
    "gravity": True,
    "only": (),
    "noise_sd_mm": 0.1,
}


def _mistake(number: int, seed: int) -> Target:
    """Each mistake in the files, without and with a real effect."""
    names = [*ERRORS, LOAD_UNIT]
    name, real = names[number % len(names)], bool(number // len(names) % 2)
    rng = np.random.default_rng([seed, STREAM + 2])
    options: dict[str, Any] = {}
    if name == LOAD_UNIT:
        options = {"factor": float(rng.choice([1000.0, 8.85]))}
    effect = (str(rng.choice(OF_LAWS)),) if real else ()
    fields = {"errors": {name: options}, "noise": "white", "n_specimens": 3, "cycles": 3}
    recipe = plain(seed, *effect, **fields)
    hidden_by_design = {LOAD_UNIT: recipe.design == "shear"}  # moments alone are in a wrong unit
    if hidden_by_design.get(name, name in OF_SEVERAL_JOINTS and recipe.joints == 1):
        recipe = plain(seed, *effect, **fields, **TWO_JOINTS)
    if name == "flipped_sign":
        flipped = {"coordinate": str(rng.choice(_loaded(recipe)))}
        recipe = replace(recipe, errors={name: flipped})
    return Target("mistake", name, with_effects(recipe, *effect))


def _loaded(recipe: Recipe) -> list[str]:
    """Coordinates that are read and moved by a load of their own."""
    if recipe.design == "shear":
        return ["anterior"]
    if recipe.design == "flexion_extension":
        return ["extension"]
    return ["extension", "right_bending", "left_rotation"]


DRAWN: dict[str, Draw] = {
    "null": _null,
    "dirty": _dirty,
    "one": _single("one", LARGE),
    "small": _single("small", SMALL),
    "two": _pair,
    "part": _part,
    "alien": _alien,
    "mistake": _mistake,
}

COUNTS: Mapping[str, int] = {
    "null": 300,
    "dirty": 120,
    "one": 552,
    "small": 276,
    "two": 150,
    "part": 36,
    "alien": 112,
    "mistake": 84,
}
"""How many of each kind."""

NUMBER = sum(COUNTS.values())


def targets(first: int, kinds: tuple[str, ...] = tuple(DRAWN)) -> list[Target]:
    """All of these kinds, seeds from ``first`` on; any first part is a fair sample."""
    placed = sorted(
        ((number + 0.5) / COUNTS[kind], list(DRAWN).index(kind), kind, number)
        for kind in DRAWN
        for number in range(COUNTS[kind])
    )
    return [
        DRAWN[kind](number, first + place)
        for place, (*_, kind, number) in enumerate(placed)
        if kind in kinds
    ]


def of_seeds(wanted: list[Target], first: int, last: int) -> Iterator[Target]:
    """Those whose seed lies in a range, both ends included."""
    return (target for target in wanted if first <= target.seed <= last)
