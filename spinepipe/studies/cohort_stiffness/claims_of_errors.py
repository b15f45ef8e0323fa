"""What is claimed of errors: which stiffness predicts better, and where errors are large.

The errors that are compared stand first, then the claims, then how they are decided.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from spinepipe.statistics import corrected, wilcoxon_signed_rank
from spinepipe.status import joined
from spinepipe.studies.cohort_stiffness.claims import (
    BY_CONSTRUCTION,
    CIRCULAR,
    NO_SUCH_FITS,
    CohortClaim,
    Row,
    above_zero,
    listed,
    words,
)
from spinepipe.studies.cohort_stiffness.representations import ASKED_FOR, EVERY, named
from spinepipe.studies.cohort_stiffness.stages import (
    FACTORS,
    FITTED,
    LEFT_OUT_CASE,
    LEFT_OUT_SPECIMEN,
    LITERATURE,
    MOTIONS,
    compared_motion,
    measured_specimens,
    of_joint_fits,
    of_single_cases,
    specimen_rms,
    unit_of,
    without_result,
)

QUANTITY = (
    "error with {} less that with {}: root mean square of all measured {}, mean over specimens, "
    "t interval"
)


@dataclass(frozen=True)
class Errors:
    """Errors of one representation in one stage.

    Attributes
    ----------
    single : whether of fits to single load cases, as published, or to all of them.
    """

    words: str
    representation: str
    stage: str
    single: bool = True


@dataclass(frozen=True)
class Comparison:
    """The claim that one error is larger than another.

    Attributes
    ----------
    own_readings : whether only the smaller one is of stiffness fitted to the very readings by
        which both are judged.
    """

    finding: str
    statement: str
    larger: Errors
    smaller: Errors
    own_readings: bool = False

    def claim(self, unit: str = "deg") -> CohortClaim:
        """The claim in words, about errors in that unit."""
        quantity = QUANTITY.format(self.larger.words, self.smaller.words, MOTIONS[unit])
        return CohortClaim(self.finding, self.statement, quantity, unit)


PUBLISHED = Errors("published stiffness", "literature", LITERATURE)
PUBLISHED_LEVELS = Errors("published stiffness of the levels", "literature_levels", LITERATURE)
UNIFORM = Errors("one stiffness per specimen", "per_specimen", FITTED)

UNIFORM_OF_OTHERS = Errors(
    "median of the other specimens, one stiffness for all joints",
    *("per_specimen", LEFT_OUT_SPECIMEN),
)

UNIFORM_OF_CASES = Errors(
    "one stiffness per specimen from its other load cases", "per_specimen", LEFT_OUT_CASE
)

RATIO = Errors("published ratio of levels, scaled", "level_ratio", FITTED)

RATIO_OF_OTHERS = Errors(
    "median of the other specimens, published ratio of levels", "level_ratio", LEFT_OUT_SPECIMEN
)

RATIO_OF_CASES = Errors(
    "published ratio of levels, scaled by the other load cases", "level_ratio", LEFT_OUT_CASE
)

PUBLISHED_FINDINGS = (
    Comparison(
        "optimised_beats_literature",
        "One stiffness per specimen, fitted to a load case, describes that load case better than "
        "the published stiffness.",
        *(PUBLISHED, UNIFORM, True),
    ),
    Comparison(
        "optimised_beats_literature_left_out_case",
        "One stiffness per specimen predicts a load case it was not fitted to better than the "
        "published stiffness.",
        *(PUBLISHED, UNIFORM_OF_CASES),
    ),
    Comparison(
        "cross_validation_beats_literature",
        "The median stiffness of the other specimens predicts a specimen better than the "
        "published stiffness.",
        *(PUBLISHED, UNIFORM_OF_OTHERS),
    ),
    Comparison(
        "optimised_beats_cross_validation",
        "A specimen's own stiffness describes it better than the median of the others.",
        *(UNIFORM_OF_OTHERS, UNIFORM, True),
    ),
    Comparison(
        "optimised_level_ratio_beats_literature",
        "Scaling the published stiffness of the levels to a specimen describes it better than "
        "leaving it as published.",
        *(PUBLISHED_LEVELS, RATIO, True),
    ),
    Comparison(
        "wrong_level_ratio_worse_than_uniform",
        "The published ratio of levels, scaled to a specimen, describes it worse than one "
        "stiffness for all joints.",
        *(RATIO, UNIFORM),
    ),
    Comparison(
        "wrong_level_ratio_worse_than_uniform_left_out_specimen",
        "The published ratio of levels predicts a specimen from the others worse than one "
        "stiffness for all joints.",
        *(RATIO_OF_OTHERS, UNIFORM_OF_OTHERS),
    ),
    Comparison(
        "wrong_level_ratio_worse_than_uniform_left_out_case",
        "The published ratio of levels predicts a load case from the others worse than one "
        "stiffness for all joints.",
        *(RATIO_OF_CASES, UNIFORM_OF_CASES),
    ),
)

HELD_OUT = {
    LEFT_OUT_SPECIMEN: "a specimen from the others",
    LEFT_OUT_CASE: "a load case from the others",
}

CONTESTS = tuple((one.name, worse) for one in EVERY for worse in one.beats)
"""Pairs of representations of which the first is claimed to predict better what is held out."""


def _contest(better: str, worse: str, stage: str) -> Comparison:
    first, second = named(better).sentence, named(worse).sentence
    statement = f"{first[0].upper()}{first[1:]} predicts {HELD_OUT[stage]} better than {second}."
    return Comparison(
        f"{better}_beats_{worse}_{stage}",
        statement,
        Errors(second, worse, stage, single=False),
        Errors(first, better, stage, single=False),
    )


COMPARISONS = (
    *PUBLISHED_FINDINGS,
    *(_contest(better, worse, stage) for better, worse in CONTESTS for stage in HELD_OUT),
)

OWN_READINGS = "expected by construction: fitted to the readings it is judged by"

EVERY_LEVEL = CohortClaim(
    "wrong_level_ratio_worse_at_every_level",
    "The published ratio of levels, scaled to a specimen, describes every joint worse than one "
    "stiffness for all joints.",
    "joints with the larger error, mean over specimens, t test joint by joint",
    "joints",
)

LOADED = CohortClaim(
    "error_is_largest_in_loaded_direction",
    "With one stiffness per specimen the error is larger in the direction of the load than in the "
    "others.",
    "error in the loaded coordinate less that of the other {}: root mean square, mean over "
    "specimens, t interval",
    "deg",
)

ERROR_CLAIMS = {"per_specimen": "", "level_ratio": "level_ratio_"}
"""Representations of the paper of which it is claimed, and how the names of the claims begin."""


def error_findings(errors: pd.DataFrame, significance: float) -> Iterator[Row]:
    """Rows of the table ``findings`` that follow from those of ``errors``."""
    seen, asked = compared_motion(errors), set(errors["representation"])
    for comparison in COMPARISONS:
        better = comparison.smaller.representation
        if better in ASKED_FOR and better not in asked:
            continue  # fitted only where a study asks for it: of nobody else is it claimed
        yield compare_errors(comparison, seen, significance)
    yield every_level(_of(seen, RATIO), _of(seen, UNIFORM), seen, significance)
    yield loaded_direction(_of(seen, UNIFORM), seen, significance)
    yield from overpredictions(seen, significance)


def compare_errors(comparison: Comparison, errors: pd.DataFrame, significance: float) -> Row:
    """The row of a comparison; specimens that a side cannot predict are named."""
    larger, smaller = (_of(errors, one) for one in (comparison.larger, comparison.smaller))
    claim, unit = comparison.claim(unit_of(errors)), unit_of(errors)
    results = _results(larger, smaller, errors)
    pair = pd.DataFrame(results).dropna()
    if pair.empty:
        return _nothing(claim, larger, smaller)
    # Both sides should have a result of a specimen, but that one load case leaves none out.
    held_out = LEFT_OUT_CASE in (comparison.larger.stage, comparison.smaller.stage)
    cases = errors.groupby("specimen")["test"].nunique()
    asked = list(cases.index[cases >= (2 if held_out else 1)])
    sides = (comparison.larger.words, comparison.smaller.words)
    lost = _lost(dict(zip(sides, results.values(), strict=True)), asked)
    compared = [pair[side] for side in ("larger", "smaller")]
    p = wilcoxon_signed_rank(*(values.to_numpy(float) for values in compared)).p
    numbers = f"{compared[0].mean():.3g} less {compared[1].mean():.3g} {unit}"
    numbers = joined(numbers, "" if p is None else f"Wilcoxon p {p:.2g}")
    note = joined(numbers, OWN_READINGS if comparison.own_readings else "", lost)
    row = _against(claim, results, asked, significance, note)
    if not comparison.own_readings:
        return row
    holds = CIRCULAR if row["holds"] == "yes" else row["holds"]
    return row | {"holds": holds, BY_CONSTRUCTION: True}


def every_level(
    ratio: pd.DataFrame, uniform: pd.DataFrame, errors: pd.DataFrame, significance: float
) -> Row:
    """Decided where it is at every joint: yes where the ratio of levels is worse at all."""
    of: dict[str, list[str]] = {"yes": [], "no": [], "undecided": []}
    rows = []
    for joint in errors["joint"].unique():
        here = [table[table["joint"] == joint] for table in (ratio, uniform, errors)]
        results = _results(*here)
        row = _against(EVERY_LEVEL, results, measured_specimens(here[2]), significance)
        of[row["holds"]].append(str(joint))
        rows.append(row)
    if all(row["value"] is None for row in rows):
        return _nothing(EVERY_LEVEL, ratio, uniform)
    told = f"better at: {listed(of['no'])}; undecided at: {listed(of['undecided'])}"
    sides = {RATIO.words: specimen_rms(ratio, errors)}
    sides |= {UNIFORM.words: specimen_rms(uniform, errors)}
    lost = _lost(sides, measured_specimens(errors))
    message = joined(f"of {len(rows)} joints; {told}", lost)
    holds = "undecided" if of["undecided"] else "no" if of["no"] else "yes"
    # p that all joints are worse, or that one is better (Bonferroni); the fewest specimens
    decided = [row for row in rows if row["p"] is not None and row["holds"] == holds]
    ps = [row["p"] for row in decided]
    p = None if not ps else max(ps) if holds == "yes" else min(1.0, len(rows) * min(ps))
    p = None if holds == "undecided" else p
    specimens = min(row["specimens"] for row in decided or rows)
    return EVERY_LEVEL.row(holds, message, float(len(of["yes"])), p=p, specimens=specimens)


def loaded_direction(fitted: pd.DataFrame, errors: pd.DataFrame, significance: float) -> Row:
    """Error in the loaded direction against that in the others."""
    unit = unit_of(errors)
    claim = replace(LOADED, quantity=LOADED.quantity.format(MOTIONS[unit]), unit=unit)
    pair, read = {}, []
    for name, loaded in (("loaded", True), ("others", False)):
        here = errors[errors["loaded"] == loaded]
        pair[name] = specimen_rms(fitted[fitted["loaded"] == loaded], here)
        read.append(set(measured_specimens(here)))
    difference = (pair["loaded"] - pair["others"]).dropna()
    return above_zero(claim, difference, significance, _lost(pair, set.intersection(*read)))


def _of(errors: pd.DataFrame, wanted: Errors) -> pd.DataFrame:
    stage = of_single_cases if wanted.single else of_joint_fits
    chosen = stage(errors, wanted.stage)
    return chosen[chosen["representation"] == wanted.representation]


def _results(
    larger: pd.DataFrame, smaller: pd.DataFrame, errors: pd.DataFrame
) -> dict[str, pd.Series]:
    """Error by specimen of both sides."""
    return {"larger": specimen_rms(larger, errors), "smaller": specimen_rms(smaller, errors)}


def _lost(found: Mapping[str, pd.Series], asked: Iterable[str]) -> str:
    """Specimens left out, for a message."""
    lost = without_result(found, asked)
    return f"left out, without a result: {lost}" if lost else ""


def _against(
    claim: CohortClaim,
    results: Mapping[str, pd.Series],
    asked: Iterable[str],
    significance: float,
    note: str = "",
) -> Row:
    """Undecided where the side that comes out better has failed: hard specimens may be lost."""
    pair = pd.DataFrame(results).dropna()
    row = above_zero(claim, pair["larger"] - pair["smaller"], significance, note)
    if row["holds"] == "undecided":
        return row
    # Where the side that wins has no result of some specimens, these may be the hard ones.
    better = results["smaller" if row["holds"] == "yes" else "larger"]
    return row if set(asked) <= set(better.index) else row | {"holds": "undecided"}


def _nothing(claim: CohortClaim, larger: pd.DataFrame, smaller: pd.DataFrame) -> Row:
    """The row where there is nothing to compare: was it asked for at all?"""
    if larger.empty and smaller.empty:
        return claim.not_asked("neither was computed in this study")
    if larger.empty or smaller.empty:
        missing = "first" if larger.empty else "second"
        return claim.not_asked(f"the {missing} was not computed in this study")
    return claim.unknown("no specimen has all results of both")


def overpredictions(errors: pd.DataFrame, significance: float) -> Iterator[Row]:
    """Does the published stiffness predict too much motion? One finding per load case."""
    published = errors[(errors["representation"] == "literature") & errors["loaded"].astype(bool)]
    for test, rows in published.groupby("test", sort=False):
        claim = CohortClaim(
            f"literature_overpredicts_motion_{test}",
            f"The published stiffness predicts too much motion under {words(str(test))}.",
            "predicted less measured motion in the loaded coordinate at the largest load, mean "
            "over joints as a share of the mean measured motion; mean over specimens, t interval",
            "percent",
        )
        excess = overprediction_percent(rows)
        lost = _lost({"published stiffness": excess}, measured_specimens(rows))
        yield above_zero(claim, excess, significance, lost)


def overprediction_percent(rows: pd.DataFrame) -> pd.Series:
    """Excess of motion by specimen, in percent of what was measured; all joints must be known."""
    measured = rows[rows["measured_peak"].notna()]
    sign = np.sign(measured["measured_peak"])
    by = measured["specimen"]
    excess = (measured["peak_error"].astype(float) * sign).groupby(by)
    motion = measured["measured_peak"].abs().groupby(by).sum()
    known = (excess.count() == excess.size()) & (motion > 0.0)
    return (100.0 * excess.sum() / motion.where(motion > 0.0))[known]


def error_spreads(statistics: pd.DataFrame, significance: float) -> Iterator[Row]:
    """Do errors in the loaded coordinate differ between specimens, and between levels?"""
    for representation, prefix in ERROR_CLAIMS.items():
        described = named(representation).sentence
        for what in FACTORS:
            claim = CohortClaim(
                f"{prefix}errors_differ_between_{what}",
                f"With {described}, fitted, errors in the loaded coordinate differ between {what} "
                "under some load case.",
                "largest Kendall's W of Friedman tests over load cases; p smallest, corrected "
                "by Holm's method for these",
                "",
            )
            family = statistics["family"] == f"between_{what}/{representation}/fitted"
            tests = statistics[family & (statistics["test"] == "Friedman")]
            tests = tests[tests["response"] == "loaded_error"]
            yield _errors_differ(claim, what, tests, significance)


def _errors_differ(claim: CohortClaim, what: str, tests: pd.DataFrame, significance: float) -> Row:
    """Yes where a test is significant, else undecided: a small cohort cannot tell no difference."""
    known = tests.dropna(subset="p")
    if tests.empty:
        return claim.not_asked(NO_SUCH_FITS)
    if known.empty:
        return claim.unknown(joined(*tests["message"].unique()))
    # for the tests of the claim alone: the family has those of all motion too
    holm = np.array(corrected(known["p"].to_list(), "holm"), dtype=float)
    p, below = float(holm.min()), known.loc[holm < significance, "stratum"]
    message = f"by itself under: {listed(list(below))}; {len(known)} load cases; no interval"
    value = float(known["effect"].max())
    holds = "yes" if p < significance else "undecided"
    # Specimens in the test of least p: its blocks, or what it compares. Friedman's statistic is
    # W n (k - 1) for n blocks of k, which gives k but where W is 0.
    least = known.sort_values("p", kind="stable").iloc[0]
    blocks, w = int(least["n"]), float(least["effect"])
    specimens: int | None = blocks
    if what != "levels":
        specimens = None if w == 0.0 else 1 + round(float(least["statistic"]) / (w * blocks))
    return claim.row(holds, message, value, None, p, specimens)
