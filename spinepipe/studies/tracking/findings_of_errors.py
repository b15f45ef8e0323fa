"""Which approach is nearest the truth, and whether persons tell approaches apart.

An error of a person is the mean over levels, then over trials. Two approaches are held against each
other person by person: the difference counts where its 95 % interval over persons is all on one
side of zero, and of fewer than three persons nothing is said to be better.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.report.page.document import ResultTables
from spinepipe.report.words import capital, count, listed, number
from spinepipe.statistics.outcome import Mean, corrected, mean_of
from spinepipe.status import Status
from spinepipe.studies.tracking.settings import LEARNT, Tracking
from spinepipe.studies.tracking.tables import MARKER_OFF, MEASURES
from spinepipe.studies.tracking.trials import STANCE, kinds_of_trials
from spinepipe.studies.tracking.words import error_text, phrase, short_of, sort_approaches

FEWEST = 3
"""Persons that a verdict needs."""

SIGNIFICANT = 0.05
SAID = ("centre_mm", "angle_deg")
"""Measures that are spoken of, the one that the answer hangs on first."""

IK, ZERO, GENERIC = "ik", "optk_zero", "optk_generic"
CALIBRATED = ("optk_calibrated", *LEARNT)
MOVING_WORDS, STANCE_WORDS = "in motion", "in stance"

_SAME = 1e-9
"""Of the errors: differences that rounding makes."""

_MOST_NAMES = 4


@dataclass(frozen=True)
class PairedDifference:
    """How much larger the error of one approach is than that of another, within persons.

    Attributes
    ----------
    mean : of the differences, with its interval. scale : the largest error of both.
    """

    mean: Mean
    scale: float

    @property
    def verdict(self) -> str:
        """``too_few``, ``same``, ``smaller``, ``larger`` or ``unsure``."""
        if self.mean.n < FEWEST or self.mean.value is None:
            return "too_few"
        if self.mean.interval is None:
            return "same" if abs(self.mean.value) <= _SAME * self.scale else "unsure"
        low, high = self.mean.interval
        return "smaller" if high < 0.0 else "larger" if low > 0.0 else "unsure"


@dataclass(frozen=True, eq=False)
class ApproachRanking:
    """Errors of a measure by person (rows) and approach (columns), the least mean first.

    Attributes
    ----------
    words : over what, ``in motion`` or ``in stance``. trials : their names.
    lacking : approaches that do not have all motions whose truth is known.
    """

    measure: str
    words: str
    trials: tuple[str, ...]
    values: pd.DataFrame
    lacking: tuple[str, ...]

    @property
    def approaches(self) -> list[str]:
        """Names, the least error first."""
        return [str(name) for name in self.values]

    @property
    def n(self) -> int:
        """Number of persons."""
        return len(self.values)

    def error_text(self, approach: str) -> str:
        """Mean error with its unit."""
        return error_text(float(self.values[approach].mean()), self.measure)

    def paired(self, one: str, other: str) -> PairedDifference:
        """The error of one approach less that of another, within persons."""
        apart = (self.values[one] - self.values[other]).to_numpy(float)
        scale = float(np.abs(self.values[[one, other]].to_numpy(float)).max())
        return PairedDifference(mean_of(apart), scale)

    @property
    def ties(self) -> list[str]:
        """Approaches whose error is not told from the least, corrected for how many there are."""
        best, *others = self.approaches
        ps = [self.paired(name, best).mean.p for name in others]
        held = zip(others, corrected(ps, "holm"), strict=True)
        return [name for name, p in held if p is None or p >= SIGNIFICANT]


def rankings(cohort: Cohort, results: ResultTables, measure: str) -> list[ApproachRanking]:
    """Of motions, then of stances, where a truth is known."""
    errors = results.table("errors")
    if errors.empty:
        return []
    kinds = kinds_of_trials(cohort)
    keys = zip(errors["specimen"], errors["trial"], strict=True)
    stands = np.array([kinds.get((str(a), str(b))) == STANCE for a, b in keys])
    own = errors["measure"] == measure
    groups = ((MOVING_WORDS, errors[own & ~stands]), (STANCE_WORDS, errors[own & stands]))
    return [one for words, rows in groups for one in _ranking(measure, words, rows)]


def _ranking(measure: str, words: str, rows: pd.DataFrame) -> Iterator[ApproachRanking]:
    """Of approaches that have all motions; none where no approach has."""
    if rows.empty:
        return
    keys = ["specimen", "trial", "approach"]
    wide = rows.groupby(keys, observed=True)["mean"].mean().unstack("approach")
    whole = wide.dropna(axis="columns")
    if whole.empty:
        return
    # a person counts once: the mean over levels, then over trials
    values = whole.groupby(level="specimen").mean()
    means = {
        name: float(values[name].to_numpy(float).mean())
        for name in sort_approaches(map(str, values))
    }
    order = sorted(means, key=lambda name: means[name])
    lacking = tuple(sort_approaches(set(wide.columns) - set(whole.columns)))
    trials = tuple(dict.fromkeys(rows["trial"]))
    yield ApproachRanking(measure, words, trials, values[order], lacking)


def nearest_approach(study: Tracking, cohort: Cohort, results: ResultTables) -> Iterator[str]:
    """The least error of each measure, and what cannot be told from it."""
    for measure in SAID:
        for one in rankings(cohort, results, measure):
            said = f"{capital(one.words)}, {MEASURES[measure][1]}: {_least(one)}"
            if one.lacking:
                names = listed(map(phrase, one.lacking))
                said += f" Left out, as not all motions were found: {names}."
            yield said + _unsettled(one, results.table("fits"))


def _least(one: ApproachRanking) -> str:
    best = one.approaches[0]
    said = f"the least error has {phrase(best)}, {one.error_text(best)}{interval_text(one, best)}"
    if len(one.approaches) < 2:
        return f"{said}; nothing is there to compare it with."
    worst = one.approaches[-1]
    said += f", the largest {phrase(worst)}, {one.error_text(worst)}"
    if one.n < FEWEST:
        return f"{said}. {too_few(one.n)}"
    others = one.approaches[1:]
    ties = one.ties
    held = f"over {one.n} persons, corrected for {count(len(others), 'comparison')}"
    if not ties:
        return f"{said}. It is smaller than that of all others ({held})."
    if len(ties) == len(others):
        return f"{said}. No other can be told from it ({held}), so none is shown to be the best."
    names = listed([phrase(name) for name in ties], _MOST_NAMES)
    return f"{said}. Not told from the least ({held}): {names}."


def _unsettled(one: ApproachRanking, fits: pd.DataFrame) -> str:
    """Fits behind the least error that did not settle."""
    if fits.empty:
        return ""
    own = fits[fits["trial"].isin(one.trials) & (fits["approach"] == one.approaches[0])]
    lost = own[~own["status"].isin([Status.CONVERGED.value, MARKER_OFF])]
    if lost.empty:
        return ""
    return f" Of the fits behind the least error {len(lost)} of {len(own)} did not settle."


def interval_text(one: ApproachRanking, approach: str) -> str:
    """Interval of a mean error; errors are not negative, whatever Student's interval says."""
    ends = mean_of(one.values[approach].to_numpy(float)).interval
    if ends is None or one.n < FEWEST:
        return ""
    low, high = (max(end, 0.0) for end in ends)
    return f" (95 % interval {number(low, 2)} to {error_text(high, one.measure)})"


def too_few(n: int) -> str:
    """Why there is no verdict."""
    return f"{capital(count(n, 'person'))} cannot tell approaches apart: that takes {FEWEST}."


def beside_kinematics(study: Tracking, cohort: Cohort, results: ResultTables) -> Iterator[str]:
    """Whether dynamics are better than inverse kinematics, without passive elements and with."""
    for first in (ZERO, GENERIC):
        for measure in SAID:
            every = rankings(cohort, results, measure)
            there = [one for one in every if {first, IK} <= set(one.approaches)]
            if there:
                both = f"{capital(phrase(first))} beside {phrase(IK)}"
                compared = "; ".join(comparison_text(one, first, IK) for one in there)
                yield f"{both}, {MEASURES[measure][1]}: {compared}."


def comparison_text(one: ApproachRanking, first: str, other: str) -> str:
    """Errors of two approaches, and whether persons tell them apart."""
    verdicts = {
        "smaller": "better",
        "larger": "worse",
        "same": "as good",
        "unsure": "not told apart",
        "too_few": f"{count(one.n, 'person')} cannot tell them apart",
    }
    found = one.paired(first, other)
    sizes = f"{one.error_text(first)} against {one.error_text(other)}"
    said = f"{one.words} {sizes}, {verdicts[found.verdict]}"
    if found.verdict == "too_few" or found.mean.interval is None or found.mean.value is None:
        return said
    low, high = (number(end, 2) for end in found.mean.interval)
    value = number(found.mean.value, 2)
    return f"{said} (difference {value}, 95 % interval {low} to {high}, {one.n} persons)"


def calibration_errors(study: Tracking, cohort: Cohort, results: ResultTables) -> Iterator[str]:
    """Whether calibrated passive elements are better or worse than generic ones."""
    for measure in SAID:
        for one in rankings(cohort, results, measure):
            there = [name for name in CALIBRATED if name in one.approaches]
            if there and GENERIC in one.approaches:
                yield _beside_generic(one, there)


def _beside_generic(one: ApproachRanking, there: list[str]) -> str:
    names = {name: short_of(name).removeprefix("dynamics, ") for name in there}
    values = [f"{names[name]} {one.error_text(name)}" for name in there]
    said = (
        f"Calibrated passive elements, {MEASURES[one.measure][1]} {one.words}: "
        f"{listed(values, len(values))}, against {one.error_text(GENERIC)} with generic ones. "
        f"{worse_words(one, there)}"
    )
    sure = {name: one.paired(name, GENERIC).verdict for name in there}
    if one.n < FEWEST:
        return f"{said} {too_few(one.n)}"
    kinds = {"smaller": "Better", "larger": "Worse"}
    parts = [
        f"{words}, with an interval that leaves out zero: "
        f"{listed([names[name] for name in there if sure[name] == kind])}."
        for kind, words in kinds.items()
        if kind in sure.values()
    ]
    if not parts:
        return f"{said} Over {one.n} persons none of these differences is larger than its interval."
    return f"{said} {' '.join(parts)}"


def all_worse(one: ApproachRanking, there: list[str]) -> bool:
    """Whether every one of some calibrations has a larger mean error than generic elements."""
    generic = float(one.values[GENERIC].mean())
    return all(float(one.values[name].mean()) > generic for name in there)


def worse_words(one: ApproachRanking, there: list[str]) -> str:
    """Whether calibration makes the mean error larger or smaller."""
    worse = [name for name in there if all_worse(one, [name])]
    if len(worse) == len(there):
        return "On average calibration makes it worse."
    if not worse:
        return "On average calibration does not make it worse."
    return f"On average {len(worse)} of {len(there)} calibrations make it worse."


def close_to_markers(study: Tracking, cohort: Cohort, results: ResultTables) -> Iterator[str]:
    """Whether the approach that is closest to the markers is nearest the truth as well."""
    fits = results.table("fits")
    for one in rankings(cohort, results, SAID[0])[:1]:
        if fits.empty or len(one.approaches) < 2:
            return
        own = fits[fits["trial"].isin(one.trials) & fits["approach"].isin(one.approaches)]
        off = own.groupby("approach", observed=True)["marker_rmse_mm"].mean().dropna()
        best = one.approaches[0]
        if best not in off:
            return
        closest = str(off.idxmin())
        here = f"{capital(one.words)}, closest to the markers is {phrase(closest)}"
        here += f" ({error_text(float(off[closest]), SAID[0])}, root mean square)"
        if closest == best:
            yield f"{here}, which has the least error of {MEASURES[one.measure][1]} too."
            return
        place = one.approaches.index(closest) + 1
        yield (
            f"{here}, but in errors of {MEASURES[one.measure][1]} it is number {place} of "
            f"{len(one.approaches)}; {phrase(best)} leaves markers "
            f"{error_text(float(off[best]), SAID[0])} off. How closely markers are met does not "
            "show which posture is right."
        )
