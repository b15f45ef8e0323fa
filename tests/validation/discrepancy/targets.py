"""All cohorts that are scored, and the order in which they are."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from tests.generators.hidden import ERRORS, KNOWN, LOAD_UNIT, UNKNOWN, USUAL, Recipe
from tests.validation.discrepancy.designs import plain, soiled, suited, with_effects

FIRST_SEED = 9000
"""Seeds below were looked at while the search was made; those to 9508 before its last change."""

GAPS = (0.1, 0.2, 0.5, 1.0)
REPEATS = 8
DIRTY = 0.2
SUITED = {"single": 0.75, "preload_stiffening": 0.5}


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


def _null(noise: str) -> Draw:
    def draw(number: int, seed: int) -> Target:
        zeroed, translations = bool(number % 2), bool(number // 2 % 2)
        recipe = plain(seed, noise=noise, zeroed=zeroed, translations=translations)
        return Target(f"null_{noise}", noise, recipe)

    return draw


def _dirty(number: int, seed: int) -> Target:
    """Each dirt alone, then all together."""
    kinds = [*USUAL, "all"]
    label = kinds[number % len(kinds)]
    dirt = dict(USUAL) if label == "all" else {label: USUAL[label]}
    return Target("null_dirty", label, plain(seed, dirt=dirt))


def _single(number: int, seed: int) -> Target:
    """Each effect once, then each again at its next gap; gaps are mixed within a turn too."""
    turn, place = divmod(number, len(KNOWN))
    name, gap = KNOWN[place], GAPS[(turn + place) % len(GAPS)]
    fields = suited(seed, SUITED.get(name, SUITED["single"]), name)
    recipe = soiled(with_effects(plain(seed, gap=gap, **fields), name), DIRTY)
    return Target("single", name, recipe)


def _pair(number: int, seed: int) -> Target:
    """Pairs of effects in a shuffled order, in designs that show both."""
    pairs = list(combinations(KNOWN, 2))
    order = np.random.default_rng(FIRST_SEED).permutation(len(pairs))
    pair = pairs[order[number % len(pairs)]]
    gap = float(np.random.default_rng(seed).uniform(0.5, 1.0))
    recipe = with_effects(plain(seed, gap=gap, **suited(seed, 1.0, *pair)), *pair)
    return Target("pair", "+".join(pair), recipe)


def _foreign(number: int, seed: int) -> Target:
    turn, place = divmod(number, len(UNKNOWN))
    name, gap = UNKNOWN[place], (0.5, 1.0)[(turn + place) % 2]
    return Target("foreign", name, with_effects(plain(seed, gap=gap), name))


def _mistake(number: int, seed: int) -> Target:
    """Each mistake in the files, without and with a real effect."""
    names = [*ERRORS, LOAD_UNIT]
    name, real = names[number % len(names)], bool(number // len(names) % 2)
    recipe = plain(seed, errors={name: {}}, noise="white")
    if real:
        effect = KNOWN[int(np.random.default_rng(seed).integers(len(KNOWN)))]
        fields = suited(seed, 1.0, effect)
        recipe = with_effects(plain(seed, errors={name: {}}, noise="white", **fields), effect)
    return Target("mistake", name, recipe)


def _full(number: int, seed: int) -> Target:
    """One of each kind at the size of a real cohort."""
    size = {"n_specimens": 6, "design": "directions", "steps": 20, "preload_n": 0.0}
    hidden = ((), ("neutral_zone",), ("hysteresis",), ("facet_contact", "load_offset"))
    names = (*hidden, ("angle_bump",), ())[number]
    recipe = plain(seed, gap=0.5, unloading="hysteresis" in names, **size)
    recipe = with_effects(recipe, *names)
    label = "+".join(names) or ("null" if number == 0 else "dirty null")
    if number == 5:
        recipe = plain(seed, dirt=dict(USUAL), unloading=False, **size)
    return Target("full", label, recipe)


def _any_null(number: int, seed: int) -> Target:
    """Nulls of all kinds of noise by turns."""
    noise = ("white", "serial", "outliers")[number % 3]
    return _null(noise)(number // 3, seed)


def _part(number: int, seed: int) -> Target:
    """An effect that is known and one that is not, on other coordinates where that can be."""
    rng = np.random.default_rng([seed, 1])
    known, alien = str(rng.choice(PLAIN_LAWS)), str(rng.choice(UNKNOWN))
    recipe = plain(seed, gap=float(rng.uniform(0.7, 1.2)), **suited(seed, 1.0, known))
    return Target("part", f"{known}+{alien}", with_effects(recipe, known, alien))


PLAIN_LAWS = (
    "nonlinear_stiffening",
    "neutral_zone",
    "flexion_extension_asymmetry",
    "facet_contact",
    "hysteresis",
)

DRAWN: dict[str, Draw] = {
    "null": _any_null,
    "dirty": _dirty,
    "one": _single,
    "two": _pair,
    "part": _part,
    "alien": _foreign,
    "mistake": _mistake,
}
"""What can be asked for while tuning, by a short name."""

TUNING = (20000, 30000)
"""Seeds for looking at while the search is changed: from, and below."""

KINDS: dict[str, tuple[int, Draw]] = {
    "null_white": (150, _null("white")),
    "null_serial": (75, _null("serial")),
    "null_outliers": (75, _null("outliers")),
    "null_dirty": (60, _dirty),
    "single": (len(KNOWN) * len(GAPS) * REPEATS, _single),
    "pair": (100, _pair),
    "foreign": (98, _foreign),
    "mistake": (40, _mistake),
    "full": (6, _full),
}
"""How many of each kind."""

AT_THE_END = ("full",)


def targets(kinds: tuple[str, ...] = tuple(KINDS)) -> list[Target]:
    """All of these kinds, interleaved so that any first part is a fair sample of them."""
    placed = [
        (kind in AT_THE_END, (number + 0.5) / KINDS[kind][0], kind, number)
        for kind in kinds
        for number in range(KINDS[kind][0])
    ]
    return [KINDS[kind][1](number, seed_of(kind, number)) for *_, kind, number in sorted(placed)]


def seed_of(kind: str, number: int) -> int:
    """Seeds of different kinds differ; the first of each kind come first."""
    return FIRST_SEED + len(KINDS) * number + list(KINDS).index(kind)


def of_seeds(wanted: list[Target], first: int, last: int) -> Iterator[Target]:
    """Those whose seed lies in a range, both ends included."""
    return (target for target in wanted if first <= target.seed <= last)
