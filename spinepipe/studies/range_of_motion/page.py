"""The report of a study of range of motion."""

from collections.abc import Iterator

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.report.page.document import Document, ResultTables, Sortable, sortable
from spinepipe.report.words import count, fixed, percent
from spinepipe.studies.range_of_motion.settings import RangeOfMotion
from spinepipe.studies.range_of_motion.tables import (
    EVERY,
    ROM_SUMMARY,
    ROM_VARIANCE,
    STIFFNESS_SETS,
)

QUESTION = (
    "How far do the joints of these spines move in tests, and does that hang on the spine, on "
    "where its joint frames are, or on the stiffness?"
)

READ = ("rom_summary", "rom_variance", "stiffness_sets", "frames")
"""Tables whose rows the page needs; of the others it tells where they come from."""

OWN_POSE = 0
"""The pose with the cohort's own joint frames."""

_FACTORS = {
    "specimen": "differences between specimens",
    "pose": "where the joint frames are",
    "stiffness": "the stiffness",
    "rest": "what these do only together",
}


def document(study: RangeOfMotion, cohort: Cohort, results: ResultTables) -> Document:
    """What the report says and shows."""
    frames = results.table("frames")
    return Document(
        question=QUESTION,
        findings=findings(study, cohort, results),
        pictures=list(results.pictures.values()),
        tables=[table for table in _tables(cohort, results) if table.rows],
        metadata=results.metadata,
        left_out=left_out(study),
        poses=frames[frames["pose"] > OWN_POSE] if len(frames) else frames,
        with_loads=study.virtual_tests is None,
    )


def left_out(study: RangeOfMotion) -> tuple[str, ...]:
    """Draws that the settings leave out, each with the setting that does."""
    parts = (
        ("drawn joint frames", f"poses: {study.poses}", study.n_poses > 1),
        ("drawn stiffness sets", "stiffness_sets: 1", study.stiffness_sets > 1),
    )
    return tuple(f"{part} ({setting})" for part, setting, drawn in parts if not drawn)


def _tables(cohort: Cohort, results: ResultTables) -> Iterator[Sortable]:
    """Rows of the whole cohort, or of its only specimen; those of each specimen are in the file."""
    chosen = EVERY if len(cohort.specimen_names) > 1 else cohort.specimen_names[0]
    shown = (
        (ROM_SUMMARY, "Range of motion", True),
        (ROM_VARIANCE, "Shares of variance", True),
        (STIFFNESS_SETS, "Stiffness sets", False),
    )
    for table, title, by_specimen in shown:
        frame = results.table(table.name)
        if by_specimen:
            frame = frame[frame["specimen"] == chosen]
        yield sortable(table.name, title, table.about, frame, table.columns)


def findings(study: RangeOfMotion, cohort: Cohort, results: ResultTables) -> list[str]:
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
    # Sizes where all motion is to one side; across zero the signs are kept.
    same_side = row["percentile_5"] * row["percentile_95"] > 0.0
    ends = (low, high) if same_side else (row["percentile_5"], row["percentile_95"])
    return f"{fixed(ends[0], 1)} to {fixed(ends[1], 1)}°"


def _dominant(rows: pd.DataFrame) -> Iterator[str]:
    """The factor with the largest share (median over the joints), test by test."""
    for test, joints in rows[rows["status"] == "done"].groupby("test", sort=False):
        shares = {name: joints[f"{name}_share"].dropna() for name in _FACTORS}
        medians = {name: share.median() for name, share in shares.items() if len(share)}
        first = max(medians, key=lambda name: medians[name])
        share = shares[first]
        part = "most" if share.min() > 0.5 else "the largest share"
        # median and range over the joints, or one number where all are alike
        low, high = (_percent(end) for end in (share.min(), share.max()))
        if low == high:
            told = low if len(share) == 1 else f"{low} at every joint"
        else:
            told = f"median {_percent(share.median())}, {low} to {high} over the joints"
        yield (
            f"{str(test).replace('_', ' ').capitalize()}: {part} of the variance is due to "
            f"{_FACTORS[first]} ({told})."
        )


def _percent(share: float) -> str:
    return percent(round(1e6 * share), 1_000_000)


def _where(study: RangeOfMotion, cohort: Cohort) -> str:
    virtual = study.virtual_tests
    if virtual is None or virtual.follower_n > 0.0 or cohort.gravity:
        return ""
    return (
        "The tests are pure moments without weight: they load no translation, and only how joint "
        "frames are turned matters, not where their origins lie."
    )
