"""Findings about errors: which stiffness predicts better, and where errors are large."""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from spinepipe.jobs.cohort_stiffness.claims import Claim, Row, above_zero, joined, listed, words
from spinepipe.jobs.cohort_stiffness.error_claims import COMPARISONS, RATIO, UNIFORM, Errors
from spinepipe.report.stage_errors import of_joint_fits, of_single_cases
from spinepipe.statistics import wilcoxon_signed_rank
from spinepipe.tables.specimen_errors import rotations, specimen_rms

EVERY_LEVEL = Claim(
    "wrong_level_ratio_worse_at_every_level",
    "The published ratio of levels, scaled to a specimen, describes every joint worse than one "
    "stiffness for all joints.",
    "joints with the larger mean error over specimens",
    "joints",
)
LOADED = Claim(
    "error_is_largest_in_loaded_direction",
    "With one stiffness per specimen the error is larger in the direction of the load than in the "
    "others.",
    "error in the loaded coordinate less that of the other rotations: root mean square, mean over "
    "specimens, t interval",
    "deg",
)


def error_findings(errors: pd.DataFrame, significance: float) -> Iterator[Row]:
    """Rows of the table ``findings`` that follow from those of ``errors``."""
    seen = rotations(errors)
    for comparison in COMPARISONS:
        larger, smaller = (_of(seen, one) for one in (comparison.larger, comparison.smaller))
        pair = specimen_pairs(larger, smaller, seen)
        if pair.empty:
            yield comparison.claim.unknown(_missing(comparison.larger, larger, smaller))
        else:
            difference = pair["larger"] - pair["smaller"]
            yield above_zero(comparison.claim, difference, significance, _note(pair))
    yield every_level(_of(seen, RATIO), _of(seen, UNIFORM), seen)
    yield loaded_direction(_of(seen, UNIFORM), seen, significance)
    yield from overpredictions(seen, significance)


def _of(errors: pd.DataFrame, wanted: Errors) -> pd.DataFrame:
    stage = of_single_cases if wanted.single else of_joint_fits
    chosen = stage(errors, wanted.stage)
    return chosen[chosen["representation"] == wanted.representation]


def specimen_pairs(
    larger: pd.DataFrame, smaller: pd.DataFrame, errors: pd.DataFrame
) -> pd.DataFrame:
    """Both errors of each specimen that has both."""
    named = {"larger": specimen_rms(larger, errors), "smaller": specimen_rms(smaller, errors)}
    return pd.DataFrame(named).dropna()


def _missing(first: Errors, larger: pd.DataFrame, smaller: pd.DataFrame) -> str:
    if larger.empty and smaller.empty:
        return "neither was computed in this study"
    if larger.empty or smaller.empty:
        missing = "first" if larger.empty else "second"
        return f"the {missing} was not computed in this study"
    return "no specimen has all results of both"


def _note(pair: pd.DataFrame) -> str:
    larger, smaller = pair["larger"], pair["smaller"]
    tested = wilcoxon_signed_rank(larger.to_numpy(float), smaller.to_numpy(float))
    means = f"{larger.mean():.3g} less {smaller.mean():.3g} deg"
    return joined(means, "" if tested.p is None else f"Wilcoxon p {tested.p:.2g}")


def every_level(ratio: pd.DataFrame, uniform: pd.DataFrame, errors: pd.DataFrame) -> Row:
    """Yes where the ratio of levels is worse at all joints, no where it is not at one."""
    worse: list[str] = []
    better: list[str] = []
    unknown: list[str] = []
    for joint in errors["joint"].unique():
        parts = [table[table["joint"] == joint] for table in (ratio, uniform, errors)]
        pair = specimen_pairs(*parts)
        above = pair["larger"].mean() > pair["smaller"].mean()
        (unknown if pair.empty else worse if above else better).append(str(joint))
    if not worse + better:
        return EVERY_LEVEL.unknown("no specimen has all results of both")
    lost = f"nothing to compare at: {listed(unknown)}" if unknown else ""
    message = f"of {len(worse + better)} joints; not worse at: {listed(better)}; no test"
    holds = "no" if better else "undecided" if unknown else "yes"
    return EVERY_LEVEL.row(holds, joined(message, lost), float(len(worse)))


def loaded_direction(fitted: pd.DataFrame, errors: pd.DataFrame, significance: float) -> Row:
    """Error in the loaded direction against that in the others."""
    pair = [
        specimen_rms(fitted[fitted["loaded"] == loaded], errors[errors["loaded"] == loaded])
        for loaded in (True, False)
    ]
    difference = (pair[0] - pair[1]).dropna()
    return above_zero(LOADED, difference, significance)


def overpredictions(errors: pd.DataFrame, significance: float) -> Iterator[Row]:
    """Does the published stiffness predict too much motion? One finding per load case."""
    published = errors[(errors["representation"] == "literature") & errors["loaded"].astype(bool)]
    for test, rows in published.groupby("test", sort=False):
        claim = Claim(
            f"literature_overpredicts_motion_{test}",
            f"The published stiffness predicts too much motion under {words(str(test))}.",
            "predicted less measured motion in the loaded coordinate at the largest load, mean "
            "over joints as a share of the mean measured motion; mean over specimens, t interval",
            "percent",
        )
        yield above_zero(claim, overprediction_percent(rows), significance)


def overprediction_percent(rows: pd.DataFrame) -> pd.Series:
    """Excess of motion by specimen, in percent of what was measured; all joints must be known."""
    measured = rows[rows["measured_peak"].notna()]
    sign = np.sign(measured["measured_peak"])
    by = measured["specimen"]
    excess = (measured["peak_error"].astype(float) * sign).groupby(by)
    motion = measured["measured_peak"].abs().groupby(by).sum()
    known = (excess.count() == excess.size()) & (motion > 0.0)
    return (100.0 * excess.sum() / motion.where(motion > 0.0))[known]
