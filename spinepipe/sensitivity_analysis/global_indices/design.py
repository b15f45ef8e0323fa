"""A design of a global analysis: which points of the unit cube are computed, and in what order.

Its size and its faults are told before anything is drawn. Sampling is SALib's; the same seed gives
the same design.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any

import numpy as np
from SALib.sample import fast_sampler, latin, sobol
from SALib.sample.morris import morris

from spinepipe.effects.contract import Array

DUMMY = "dummy"
"""Name of the factor that changes nothing."""


class Method(StrEnum):
    """How the points of a design are chosen."""

    SOBOL = "sobol"
    LATIN_HYPERCUBE = "latin_hypercube"
    MORRIS = "morris"
    FAST = "fast"


@dataclass(frozen=True, eq=False)
class Design:
    """Points of the unit cube, one row a run.

    Attributes
    ----------
    factors : (D,) names, one for each column.
    groups : (D,) group of each factor; a factor without one is a group by its own name.
    unit : (n, D) points from 0 to 1, each column's share of its factor's distribution.
    samples : base samples of Sobol, trajectories of Morris, points of a Latin hypercube, points
        per curve of FAST.
    second_order : whether a Sobol design holds the runs for indices of pairs.
    levels : levels of Morris. harmonics : harmonics of FAST.

    Rows come in blocks that a failure can spoil, see `block`. A block of Sobol is one base sample:
    A, then A with each group's columns from B, then (second order) B with each group's from A,
    then B. A block of Morris is one trajectory, of FAST one factor's curve.
    """

    method: Method
    factors: tuple[str, ...]
    groups: tuple[str, ...]
    unit: Array
    samples: int
    seed: int
    second_order: bool
    levels: int
    harmonics: int

    @property
    def n(self) -> int:
        """How many runs there are."""
        return len(self.unit)

    @property
    def inputs(self) -> tuple[str, ...]:
        """(G,) what gets an index: groups in the order of their first factors."""
        return tuple(dict.fromkeys(self.groups))

    @property
    def block(self) -> int:
        """How many runs stand or fall together."""
        if self.method is Method.FAST:
            return self.samples
        return self.n // self.samples

    def first(self, samples: int) -> "Design":
        """The design's first base samples, trajectories or points; of FAST there is no part."""
        if self.method is Method.FAST and samples != self.samples:
            raise ValueError("a part of a FAST curve is no curve")
        if not 0 < samples <= self.samples:
            raise ValueError(f"samples must be 1 to {self.samples}, found {samples}")
        rows = self.n if self.method is Method.FAST else samples * self.block
        return replace(self, unit=self.unit[:rows], samples=samples)


def design_problems(
    method: str,
    factors: Sequence[str],
    groups: Sequence[str | None],
    samples: int,
    levels: int = 4,
    harmonics: int = 4,
) -> list[str]:
    """All that stands against a design, in plain words; empty where it can be drawn."""
    found = [] if factors else ["a design needs at least one factor"]
    if len(set(factors)) != len(factors):
        twice = sorted({name for name in factors if list(factors).count(name) > 1})
        found.append(f"factors of the same name: {', '.join(twice)}")
    if len(groups) != len(factors):
        found.append(f"{len(factors)} factors but {len(groups)} groups (None for a factor alone)")
    alone = {name for name, group in zip(factors, groups, strict=False) if group is None}
    found += [f"group {name!r} is also a factor" for name in sorted(alone & set(groups) - {None})]
    # Methods that look at one factor at a time have nothing to say of a group: SALib's Latin
    # hypercube gives all factors of a group the same share (rank correlation 1), so that opposite
    # effects cancel; its FAST knows no groups.
    own = Method(method)
    grouped = len(groups) == len(factors) and any(group is not None for group in groups)
    if grouped and own not in (Method.SOBOL, Method.MORRIS):
        found.append(
            f"{own.value} has no indices of groups: leave groups out, or use sobol or morris"
        )
    if own is Method.FAST:
        # with fewer samples SALib lets two other factors share a frequency: they then move as one
        least = 4 * harmonics**2 * max(1, len(factors) - 1) + 1
        if harmonics < 1 or samples < least:
            found.append(
                f"fast with {harmonics} harmonics and {len(factors)} factors needs at least "
                f"{least} samples per curve, for each factor its own frequency, found {samples}"
            )
    elif own is Method.SOBOL and (samples < 2 or samples & (samples - 1)):
        found.append(
            f"sobol needs a power of two as samples (balance of the sequence), found {samples}"
        )
    elif own is Method.MORRIS and (levels < 2 or levels % 2):
        found.append(f"morris needs an even number of levels, found {levels}")
    elif samples < 2:
        found.append(f"at least 2 samples are needed, found {samples}")
    return found


def draw(
    method: str,
    factors: Sequence[str],
    samples: int,
    seed: int,
    *,
    groups: Sequence[str | None] | None = None,
    second_order: bool = True,
    levels: int = 4,
    harmonics: int = 4,
    dummy: bool = False,
) -> Design:
    """A design of the factors.

    Parameters
    ----------
    method, samples, second_order, levels, harmonics : see `Design`. Sobol points are scrambled
        (scipy's generator), and their number is a power of two. Morris trajectories are not
        selected for spread: selected ones are no independent draws to bootstrap.
    groups : group of each factor, None for a factor alone; for Sobol and Morris.
    dummy : whether a last factor `DUMMY` that changes nothing is added.

    Raises
    ------
    ValueError
        With all that stands against the design.
    """
    names = (*factors, DUMMY) if dummy else tuple(factors)
    given = tuple(groups) if groups is not None else (None,) * len(factors)
    given = (*given, None) if dummy else given
    wrong = design_problems(method, names, given, samples, levels, harmonics)
    if wrong:
        raise ValueError("; ".join(wrong))
    own = tuple(name if g is None else g for name, g in zip(names, given, strict=True))
    bare = Design(
        Method(method),
        names,
        own,
        np.empty((0, len(names))),
        samples,
        seed,
        second_order,
        levels,
        harmonics,
    )
    return replace(bare, unit=_points(bare))


def _points(design: Design) -> Array:
    """(n, D) points; all of SALib's samplers that are used."""
    problem: dict[str, Any] = {
        "num_vars": len(design.factors),
        "names": list(design.factors),
        "bounds": [[0.0, 1.0]] * len(design.factors),
    }
    if design.groups != design.factors:
        problem["groups"] = list(design.groups)
    samples, seed = design.samples, design.seed
    if design.method is Method.SOBOL:
        order = design.second_order
        return sobol.sample(problem, samples, calc_second_order=order, seed=seed)
    if design.method is Method.LATIN_HYPERCUBE:
        return latin.sample(problem, samples, seed=seed)
    if design.method is Method.MORRIS:
        return morris.sample(problem, samples, num_levels=design.levels, seed=seed)
    return fast_sampler.sample(problem, samples, M=design.harmonics, seed=seed)
