"""Key findings of a range-of-motion study as sentences, their numbers computed from its tables."""

from collections.abc import Iterator

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.report.page.results import Results
from spinepipe.report.range_of_motion.panels import EVERY
from spinepipe.report.words import count, fixed, percent
from spinepipe.studies import RangeOfMotion

_FACTORS = {
    "specimen": "differences between specimens",
    "pose": "where the joint frames are",
    "stiffness": "the stiffness",
    "rest": "what these do only together",
}


def findings(study: RangeOfMotion, cohort: Cohort, results: Results) -> list[str]:
    """The sentences, without those that the tables have nothing for."""
    summary, variance = results.table("rom_summary"), results.table("rom_variance")
    chosen = EVERY if len(cohort.specimen_names) > 1 else cohort.specimen_names[0]
    told = [
        _runs(summary[summary["specimen"] == chosen]),
        *_motion(summary[(summary["specimen"] == chosen) & (summary["role"] == "loaded")]),
        *_dominant(variance[variance["specimen"] == chosen]),
        _where(study, cohort),
    ]
    return [sentence.replace(" %", "\u00a0%") for sentence in told if sentence]


def _runs(rows: pd.DataFrame) -> str:
    one = rows.drop_duplicates("test")
    runs, without = int((one["n"] + one["n_without"]).sum()), int(one["n_without"].sum())
    lost = f"{without} ({percent(without, runs)})" if without else "none"
    return (
        f"{count(runs, 'run')} of {count(len(one), 'test')}: {lost} without a stable equilibrium."
    )


def _motion(rows: pd.DataFrame) -> Iterator[str]:
    """Smallest and largest median of the joints, test by test."""
    for test, joints in rows.dropna(subset=["median"]).groupby("test", sort=False):
        ordered = joints.sort_values("median", key=abs, kind="stable")
        low, high = ordered.iloc[0], ordered.iloc[-1]
        spread = f"middle 90 % {_ends(low)} and {_ends(high)}"
        yield (
            f"{str(test).replace('_', ' ').capitalize()}: median motion of a joint in the loaded "
            f"direction from {fixed(abs(low['median']), 1)}° ({low['joint']}) to "
            f"{fixed(abs(high['median']), 1)}° ({high['joint']}), {spread}."
        )


def _ends(row: pd.Series) -> str:
    low, high = sorted((abs(row["percentile_5"]), abs(row["percentile_95"])))
    same_side = row["percentile_5"] * row["percentile_95"] > 0.0
    ends = (low, high) if same_side else (row["percentile_5"], row["percentile_95"])
    return f"{fixed(ends[0], 1)} to {fixed(ends[1], 1)}°"


def _dominant(rows: pd.DataFrame) -> Iterator[str]:
    """The factor with the largest share (median over the joints), test by test."""
    for test, joints in rows[rows["status"] == "done"].groupby("test", sort=False):
        shares = {name: joints[f"{name}_share"].dropna() for name in _FACTORS}
        medians = {name: share.median() for name, share in shares.items() if len(share)}
        first = max(medians, key=lambda name: medians[name])
        part = "most" if shares[first].min() > 0.5 else "the largest share"
        yield (
            f"{str(test).replace('_', ' ').capitalize()}: {part} of the variance is due to "
            f"{_FACTORS[first]} ({_over_joints(shares[first])})."
        )


def _over_joints(shares: pd.Series) -> str:
    """Median and range over the joints."""
    low, high = (_percent(end) for end in (shares.min(), shares.max()))
    if low == high:
        return low if len(shares) == 1 else f"{low} at every joint"
    return f"median {_percent(shares.median())}, {low} to {high} over the joints"


def _percent(share: float) -> str:
    return percent(round(1e6 * share), 1_000_000)


def _where(study: RangeOfMotion, cohort: Cohort) -> str:
    if study.virtual_tests is None or cohort.gravity:
        return ""
    return (
        "The tests are pure moments without weight: they load no translation, and only how joint "
        "frames are turned matters, not where their origins lie."
    )
