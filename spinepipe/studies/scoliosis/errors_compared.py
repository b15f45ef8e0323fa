"""Which law errs least, by how much, and whether anybody could read that from a film.

The error of a spine is the root mean square over the films of a group. Laws are compared over the
same spines only: those with a pose on every film of the group in each of them. A difference counts
where a paired test over spines says so, corrected over all pairs of laws (table ``statistics``),
and is told beside the least difference of two readings that can be detected.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd

from spinepipe.report.conclusions import Value
from spinepipe.statistics import mean_of
from spinepipe.studies.scoliosis.errors import by_patient, of_group, reading_floor, squares
from spinepipe.studies.scoliosis.tables import MEASURES

SIGNIFICANT = 0.05
"""p-values below this, corrected by Holm's method, are called significant."""

FEWEST = 3
"""Spines, below which nothing is said of a group."""

DETECTABLE = 1.96 * np.sqrt(2.0)
"""Least detectable difference of two readings, over the SD of one (95 %)."""

LAWS = {
    "tangent": "the published tangent",
    "tangent_fitted": "the fitted tangent",
    "linear_regions": "stiffness by region",
    "linear_per_segment": "stiffness by segment",
    "uniform": "uniform stiffness",
}
"""Laws of stiffness in sentences, in the order of figures."""

FILMS = {"held_out": "left-out films", "fitted": "fitted films"}

SIGNS = {"deg": "°", "mm": "mm"}


@dataclass(frozen=True)
class LawDifference:
    """How much less one law errs than another, over the spines of both.

    Attributes
    ----------
    errors : of both. margin : mean over spines, with its interval.
    significant : by the corrected test; not where there is none, or its ranks go the other way.
    """

    one: str
    other: str
    errors: tuple[Value, Value]
    margin: Value
    significant: bool

    @property
    def less(self) -> bool:
        """Whether the one errs less, by the corrected test."""
        return self.significant and self.margin.number > 0.0

    @property
    def more(self) -> bool:
        """Whether it errs more."""
        return self.significant and self.margin.number < 0.0


@dataclass(frozen=True, eq=False)
class Compared:
    """Errors of all laws in a measure on a group of films.

    Attributes
    ----------
    each : a row for each spine, a column for each law that has a pose of any; NaN without a pose.
    noise : SD of a reading, deg or mm; None where nobody knows.
    tests : rows of the table ``statistics`` of this measure and group.
    """

    group: str
    measure: str
    each: pd.DataFrame
    noise: float | None
    tests: pd.DataFrame

    @classmethod
    def of(cls, tables: Mapping[str, pd.DataFrame], group: str, measure: str) -> "Compared":
        """From tables of results, which may be missing or without rows."""
        parts = [tables.get(name, pd.DataFrame()) for name in ("positions", "displacements")]
        parts.append(tables.get("curves", pd.DataFrame()))
        each = pd.DataFrame()
        if all(len(rows) for rows in parts):
            chosen = [of_group(rows, group) for rows in parts]
            each = by_patient(squares(measure, *chosen)).dropna(axis=1, how="all")
            names = [name for name in LAWS if name in each]
            each = each[names] if names else pd.DataFrame()
        accuracy, tests = (tables.get(name, pd.DataFrame()) for name in ("accuracy", "statistics"))
        noise = reading_floor(accuracy, measure) if len(accuracy) else np.nan
        own = tests[tests["family"] == f"{group}/{measure}"] if len(tests) else tests
        return cls(group, measure, each, float(noise) if np.isfinite(noise) else None, own)

    @cached_property
    def same(self) -> pd.DataFrame:
        """Of the spines that all laws have."""
        return self.each.dropna()

    @cached_property
    def laws(self) -> list[str]:
        """The least error first, over the same spines."""
        order = self.same.mean().sort_values(kind="stable")
        return [str(name) for name in order.index]

    @property
    def group_words(self) -> str:
        """The films."""
        return FILMS[self.group]

    @property
    def sign(self) -> str:
        """Unit of errors."""
        return SIGNS[MEASURES[self.measure][0]]

    @property
    def detectable(self) -> float | None:
        """Least difference of two readings that can be detected, deg or mm."""
        return None if self.noise is None else float(DETECTABLE * self.noise)

    @property
    def told_detectable(self) -> Value:
        """The same as a number of a sentence; only where the reading noise is known."""
        how = "accuracy: 1.96 √2 reading_noise"
        return Value(self.detectable or 0.0, self.sign, source=how)

    def error(self, law: str) -> Value:
        """Mean over the same spines, with its interval."""
        return self.mean(self.same[law])

    def mean(self, values: pd.Series) -> Value:
        """Mean over spines of an error or of a difference of errors."""
        found = mean_of(values.to_numpy(float))
        how = f"positions, displacements, curves: {FILMS[self.group]}, {self.measure}"
        low, high = found.interval or (None, None)
        return Value(float(found.value or 0.0), self.sign, low, high, found.n, how)

    def difference(self, one: str, other: str) -> LawDifference:
        """How much less the one errs."""
        both = self.each[[one, other]].dropna()
        margin = self.mean(both[other] - both[one])
        # the effect is below zero where the response errs less
        toward = {(one, other): -1.0, (other, one): 1.0}
        significant = any(
            row["p_holm"] < SIGNIFICANT
            and toward[row["response"], row["factor"]] * row["effect"] * margin.number > 0.0
            for row in self.tests.to_dict("records")
            if (row["response"], row["factor"]) in toward
        )
        errors = self.mean(both[one]), self.mean(both[other])
        return LawDifference(one, other, errors, margin, significant)

    @cached_property
    def beside_best(self) -> list[LawDifference]:
        """Of the law of least error to each other one, the nearest first."""
        best, *others = self.laws
        found = [self.difference(best, other) for other in others]
        return sorted(found, key=lambda one: one.margin.number)

    @property
    def verdict(self) -> str:
        """Whether one law is best.

        ``none``: no spine has poses; ``few``: too few; ``alone``: one law; ``alike``: some cannot
        be distinguished from the first; else the first errs less than all others: ``clear`` by
        what can be detected, ``small`` by less, ``unread`` where that is not known.
        """
        if self.each.empty:
            return "none"
        if len(self.same) < FEWEST:
            return "few"
        if len(self.laws) == 1:
            return "alone"
        if not all(one.less for one in self.beside_best):
            return "alike"
        if self.detectable is None:
            return "unread"
        return "clear" if self.beside_best[0].margin.number > self.detectable else "small"

    @property
    def nearest(self) -> LawDifference:
        """The law from which the first differs least; where some are alike, of these."""
        alike = [one for one in self.beside_best if not one.less]
        return (alike or self.beside_best)[0]
