"""Which approach is nearest the truth, and what subjects show of it.

An error of a subject is the mean over levels, then over trials. Approaches are compared in pairs
within subjects, by t tests of which all that a page could tell of are corrected together (Holm): no
sentence rests on any other rule. Fewer than three subjects show nothing.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np
import pandas as pd
from scipy import stats

from spinepipe.cohort import Cohort
from spinepipe.report.conclusions import Value
from spinepipe.statistics.outcome import SAME, Array, corrected, family_size, mean_of
from spinepipe.studies.recordings import STANCE
from spinepipe.studies.tracking.settings import LEARNT, OWN
from spinepipe.studies.tracking.tables import MEASURES
from spinepipe.studies.tracking.trials import kinds_of_trials
from spinepipe.studies.tracking.words import sort_approaches

FEWEST = 3
"""Subjects that a statement about a difference needs."""

LEVEL, POWER = 0.05, 0.8
MOST_SUBJECTS = 1000
"""More than this are not counted: nobody tracks them."""

CENTRES, ANGLES = "centre_mm", "angle_deg"
COMPARED = (CENTRES, ANGLES)
"""Measures in which approaches are compared, the one that the answer rests on first."""

IK, ZERO, GENERIC = "ik", "optk_zero", "optk_generic"
CALIBRATED = (OWN, *LEARNT)
PREFERRED = (GENERIC, "optk_from_both", OWN)
"""Which approach shares are told of where no truth says which is nearest."""


@dataclass(frozen=True, eq=False)
class Ranking:
    """Errors of a measure by subject (rows) and approach (columns), the least mean first.

    Attributes
    ----------
    where : ``in motion`` or ``in stance``. trials : their names.
    lacking : approaches that do not have all motions whose truth is known.
    p : of a pair of approaches, corrected; None where there is none. tests : in the family.
    """

    measure: str
    where: str
    trials: tuple[str, ...]
    values: pd.DataFrame
    lacking: tuple[str, ...]
    p: Mapping[frozenset[str], float | None] = field(default_factory=dict)
    tests: int = 0

    @property
    def approaches(self) -> list[str]:
        """Names, the least error first."""
        return [str(name) for name in self.values]

    @property
    def n(self) -> int:
        """Number of subjects."""
        return len(self.values)

    def error(self, approach: str) -> Value:
        """Mean error with its interval over subjects; errors are not negative."""
        mean = mean_of(self.values[approach].to_numpy(float))
        low, high = (mean.interval if self.n >= FEWEST else None) or (None, None)
        assert mean.value is not None
        unit = {"deg": "°"}.get(MEASURES[self.measure][0], "mm")
        source = f"errors: mean over levels, trials ({self.where}) and subjects"
        low = None if low is None else max(low, 0.0)
        return Value(mean.value, unit, low, high, self.n, source)

    def shown(self, one: str, other: str) -> int:
        """-1 where the error of one is shown to be smaller, 1: larger, 0: neither."""
        p = self.p.get(frozenset((one, other)))
        if p is None or p >= LEVEL:
            return 0
        return int(np.sign(self.differences(one, other).mean()))

    def differences(self, one: str, other: str) -> Array:
        """(n,) error of one approach less that of another."""
        return np.asarray(self.values[one] - self.values[other], dtype=float)

    def needed(self, one: str, other: str) -> int | None:
        """Subjects with which such a difference is shown, see `paired_sample_size`."""
        apart = self.differences(one, other)
        if self.p.get(frozenset((one, other))) is None:
            return None
        level = LEVEL / self.tests
        return paired_sample_size(float(apart.mean()), float(apart.std(ddof=1)), level)


def paired_sample_size(mean: float, sd: float, level: float) -> int | None:
    """Pairs that a two-sided paired t test needs for a power of 80 %; None above `MOST_SUBJECTS`.

    The least n of at least three for which n >= (t(1 - level / 2) + t(0.8))^2 sd^2 / mean^2, both
    quantiles with n - 1 degrees of freedom (Chow, Shao and Wang 2008, doi:10.1201/9781584889830).
    """
    if mean == 0.0:
        return None
    n = np.arange(FEWEST, MOST_SUBJECTS + 1)
    quantiles = stats.t.ppf(1.0 - level / 2.0, n - 1) + stats.t.ppf(POWER, n - 1)
    enough = n >= (quantiles * sd / mean) ** 2
    return int(n[np.argmax(enough)]) if enough.any() else None


def rankings(cohort: Cohort, errors: pd.DataFrame) -> list[Ranking]:
    """By measure, motions before stances, where a truth is known; all pairs corrected together."""
    if errors.empty:
        return []
    kinds = kinds_of_trials(cohort)
    keys = zip(errors["specimen"], errors["trial"], strict=True)
    stands = np.array([kinds.get((str(a), str(b))) == STANCE for a, b in keys])
    groups = (("in motion", errors[~stands]), ("in stance", errors[stands]))
    found = [
        one
        for measure in COMPARED
        for where, rows in groups
        for one in _ranking(measure, where, rows[rows["measure"] == measure])
    ]
    pairs = [(k, *pair) for k, one in enumerate(found) for pair in combinations(one.approaches, 2)]
    raw = [paired_p(found[k].differences(one, other)) for k, one, other in pairs]
    p: list[dict[frozenset[str], float | None]] = [{} for _ in found]
    for (k, *pair), value in zip(pairs, corrected(raw, "holm"), strict=True):
        p[k][frozenset(pair)] = value
    tests = family_size(raw)
    return [replace(one, p=own, tests=tests) for one, own in zip(found, p, strict=True)]


def paired_p(apart: Array) -> float | None:
    """Of a paired t test; 0 of a difference that is the same in all subjects, none of too few."""
    found = mean_of(apart)
    if found.n < FEWEST or found.value is None:
        return None
    return 0.0 if found.interval is None and abs(found.value) > SAME else found.p


def _ranking(measure: str, where: str, rows: pd.DataFrame) -> Iterator[Ranking]:
    """Of approaches that have all motions; none where no approach has."""
    keys = ["specimen", "trial", "approach"]
    wide = rows.groupby(keys, observed=True)["mean"].mean().unstack("approach")
    whole = wide.dropna(axis="columns")
    if whole.empty:
        return
    # a subject counts once: the mean over levels, then over trials
    values = whole.groupby(level="specimen", sort=False).mean()
    names = sort_approaches(map(str, values))
    order = sorted(names, key=lambda name: float(values[name].to_numpy(float).mean()))
    lacking = tuple(sort_approaches(set(wide.columns) - set(whole.columns)))
    trials = tuple(dict.fromkeys(map(str, rows["trial"])))
    yield Ranking(measure, where, trials, values[order], lacking)


def chosen_approach(cohort: Cohort, errors: pd.DataFrame | None, found: Iterable[object]) -> str:
    """Whose motion is told of: the nearest to the truth, without one the first preferred one.

    Parameters
    ----------
    found : approaches that found a motion, at least one.
    """
    there = sort_approaches(map(str, found))
    ranked = [] if errors is None else rankings(cohort, errors)[:1]
    wanted = (*(one.approaches[0] for one in ranked), *PREFERRED)
    return next((name for name in wanted if name in there), there[0])
