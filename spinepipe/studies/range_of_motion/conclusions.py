"""What a study of range of motion concludes; the sentences stand in conclusions.csv."""

from collections.abc import Iterator, Sequence
from math import inf
from typing import Any

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.report.conclusions import Conclusion, Value
from spinepipe.report.page.study_page import ResultTables
from spinepipe.report.words import level, listed, plain
from spinepipe.studies.range_of_motion.settings import RangeOfMotion
from spinepipe.studies.range_of_motion.tables import EVERY, FACTORS
from spinepipe.units import COORDINATES

SOURCES = {
    "specimen": "differences between specimens",
    "pose": "where joint frames are",
    "stiffness": "stiffness",
    "rest": "joint frames and stiffness together",
}
"""Parts of the variance in words."""

MOST = 0.5
"""Of the variance: more than this comes from a source for sure where its interval lies above."""

FEW_DRAWS = 10
FEWEST_FOR_QUARTILES = 4
MANY_LOST = 0.1
"""Share of runs without equilibrium above which the others no longer stand for all."""


def whole(cohort: Cohort, rows: pd.DataFrame) -> pd.DataFrame:
    """Rows of the whole cohort, or of its only specimen."""
    chosen = EVERY if len(cohort.specimen_names) > 1 else cohort.specimen_names[0]
    return rows[rows["specimen"] == chosen] if len(rows) else rows


def conclusions(
    study: RangeOfMotion, cohort: Cohort, results: ResultTables
) -> Iterator[Conclusion]:
    """All of them."""
    summary = whole(cohort, results.table("rom_summary"))
    variance = whole(cohort, results.table("rom_variance"))
    moved = summary[(summary["role"] == "loaded") & (summary["n"] > 0)]
    shared = variance[variance["status"] == "done"] if len(variance) else variance
    if len(moved):
        yield from _motion(moved, shared)
        if moved["joint"].nunique() > 1 and moved["n"].min() >= FEWEST_FOR_QUARTILES:
            yield _levels(moved)
    else:
        yield Conclusion("motion", "none")
    if len(shared):
        yield _dominant(shared)
    yield _draws(study)
    virtual = study.virtual_tests
    if virtual and virtual.follower_n == 0.0 and not cohort.gravity:
        yield Conclusion("origins", "no_trace")
    yield _runs(summary)
    yield _sample(variance, shared)
    yield _methods(study, cohort, len(moved["test"].unique()))
    if len(shared):
        yield Conclusion("methods_shares", "anova")


def _motion(moved: pd.DataFrame, shared: pd.DataFrame) -> Iterator[Conclusion]:
    """The test in which some joint moves most, and what that motion comes from."""
    widest = _row(moved, moved["median"].abs().idxmax())
    joints = moved[moved["test"] == widest["test"]]
    least = _row(joints, joints["median"].abs().idxmin())
    names = {"test": plain(widest["test"]), "joint": level(widest["joint"])}
    how = "rom_summary: absolute median of the runs"
    ends = {
        "least": Value(abs(least["median"]), "°", n=int(least["n"]), source=how),
        "most": Value(abs(widest["median"]), "°", n=int(widest["n"]), source=how),
    }
    places = {"least_joint": level(least["joint"]), "most_joint": level(widest["joint"])}
    own = shared[shared["test"] == widest["test"]] if len(shared) else shared
    factor = _source(own) if len(own) else None
    verdict = "alone" if not len(own) else "mixed" if factor is None else "most"
    told = {"factor": SOURCES[factor]} if factor else {}
    yield Conclusion("motion", verdict, ends, {**names, **places, **told})
    sign = -1.0 if widest["median"] < 0.0 else 1.0  # flexion is negative extension
    low, high = sorted(sign * widest[f"percentile_{end}"] for end in (5, 95))
    between = Value(abs(widest["median"]), "°", low, high, int(widest["n"]), how)
    yield Conclusion("widest", "by_test", {"value": between}, names)
    if factor:
        lowest = _row(own, own[f"{factor}_share"].idxmin())
        share = _percent(lowest, factor)
        yield Conclusion("factor", "by_test", {"value": share}, {**names, **told})


def _row(rows: pd.DataFrame, at: Any) -> dict[str, Any]:
    """One row by its label."""
    return {str(name): value for name, value in rows.loc[at].items()}


def _source(joints: pd.DataFrame) -> str | None:
    """The source of most of the variance at every joint, for sure; None where there is none."""
    for name in FACTORS:
        if joints[f"{name}_low"].notna().all() and (joints[f"{name}_low"] > MOST).all():
            return name
    return None


def _percent(row: dict[str, Any], factor: str) -> Value:
    share, low, high = (100.0 * float(row[f"{factor}_{end}"]) for end in ("share", "low", "high"))
    draws = int(row["n_poses"] * row["n_stiffness"] * row["n_specimens"])
    return Value(share, "%", low, high, draws, f"rom_variance: {factor}_share")


def _levels(moved: pd.DataFrame) -> Conclusion:
    """Whether joints differ by more than the middle half of the runs of one."""
    found = []
    for test, joints in moved.groupby("test", sort=False):
        sizes = joints["median"].abs()
        middle = float((joints["high_quartile"] - joints["low_quartile"]).median())
        spread = float(sizes.max() - sizes.min())
        ends = {"most_joint": sizes.idxmax(), "least_joint": sizes.idxmin()}
        names = {name: level(str(joints.at[at, "joint"])) for name, at in ends.items()}
        found.append((spread - middle, spread, middle, {"test": plain(str(test)), **names}))
    # the test in which joints are farthest apart for the spread of one
    beyond, spread, middle, names = max(found, key=lambda one: one[1] / (one[2] or inf))
    values = {
        "medians": Value(spread, "°", source="rom_summary: largest less least median"),
        "middle": Value(middle, "°", source="rom_summary: interquartile range, median of joints"),
    }
    return Conclusion("levels", "beyond" if beyond > 0.0 else "within", values, names)


def _dominant(shared: pd.DataFrame) -> Conclusion:
    """In how many tests one source makes most of the variance at every joint."""
    sources = {test: _source(rows) for test, rows in shared.groupby("test", sort=False)}
    held = [name for name in sources.values() if name]
    if not held:
        return Conclusion("dominant", "none")
    factor, *others = sorted(dict.fromkeys(held), key=held.count, reverse=True)
    tests = [test for test, name in sources.items() if name == factor]
    rows = shared[shared["test"].isin(tests)]
    least = _row(rows, rows[f"{factor}_share"].idxmin())
    values = {
        "share": _percent(least, factor),
        "held": Value(len(tests), source="rom_variance: tests"),
        "tests": Value(len(sources), source="rom_variance: tests"),
    }
    names = {"factor": SOURCES[factor]}
    if others:
        told = listed(SOURCES[name] for name in others)
        return Conclusion("dominant", "differ", values, {**names, "other": told})
    return Conclusion("dominant", "all" if len(tests) == len(sources) else "some", values, names)


def _draws(study: RangeOfMotion) -> Conclusion:
    drawn = (study.stiffness_sets > 1, study.n_poses > 1)
    verdict = {
        (True, True): "both",
        (True, False): "stiffness",
        (False, True): "frames",
        (False, False): "neither",
    }[drawn]
    sd = study.pose_sd
    frames = f"SD {sd.translation_mm:g} mm, {sd.rotation_deg:g}°" if sd else "the cohort's SD"
    spread = f"up to {study.stiffness_spread:g}-fold either way"
    return Conclusion("draws", verdict, names={"stiffness": spread, "frames": frames})


def _runs(summary: pd.DataFrame) -> Conclusion:
    # a run has a row for each coordinate and joint: it is counted in one of them
    one = summary[summary["coordinate"] == COORDINATES[0]].drop_duplicates("test")
    lost, runs = int(one["n_without"].sum()), int((one["n"] + one["n_without"]).sum())
    verdict = "ok" if not lost else "check" if lost <= MANY_LOST * runs else "stop"
    source = "rom_summary: n and n_without over tests"
    values = {"lost": Value(lost, source=source), "runs": Value(runs, source=source)}
    return Conclusion("runs", verdict, values)


def _sample(variance: pd.DataFrame, shared: pd.DataFrame) -> Conclusion:
    if shared.empty:
        why = variance["message"].iloc[0] if len(variance) else "the study asks for none"
        return Conclusion("sample", "check_none", names={"why": str(why)})
    first = shared.iloc[0]
    names: Sequence[tuple[str, str]] = (
        ("specimens", "n_specimens"),
        ("poses", "n_poses"),
        ("sets", "n_stiffness"),
    )
    values = {
        name: Value(int(first[column]), source=f"rom_variance: {column}") for name, column in names
    }
    few = min(first["n_poses"], first["n_stiffness"]) < FEW_DRAWS
    return Conclusion("sample", "check" if few else "ok", values)


def _methods(study: RangeOfMotion, cohort: Cohort, tests: int) -> Conclusion:
    virtual = study.virtual_tests
    values = {
        "tests": Value(tests, source="rom_summary: tests"),
        "poses": Value(study.n_poses, source="settings: poses"),
        "sets": Value(study.stiffness_sets, source="settings: stiffness_sets"),
    }
    if virtual is None:
        return Conclusion("methods", "cohort", values)
    moment = Value(virtual.moment_nm, "N m", source="settings: moment_nm")
    return Conclusion("methods", "virtual", {**values, "moment": moment})
