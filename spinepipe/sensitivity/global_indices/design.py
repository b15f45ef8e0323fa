"""A design of a global analysis: which points of the unit cube are computed, and how they hang
together."""

from dataclasses import dataclass, replace
from enum import StrEnum

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
    second_order: bool = True
    levels: int = 4
    harmonics: int = 4

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
