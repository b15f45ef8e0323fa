"""What a study of joint poses concludes of motion and of joint frames."""

from collections.abc import Iterator

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.report.conclusions import Conclusion, Value
from spinepipe.report.page.study_page import ResultTables
from spinepipe.report.words import AXIS, unit
from spinepipe.status import USABLE
from spinepipe.studies.joint_pose_sensitivity.retained import place_of
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.units import COORDINATES

MISSED = 10.0
"""Percent of the measured motion: a larger error is told as missed."""

ROUNDING = 1e-9
"""Errors below this, mm or degrees, are rounding: no instrument and no fit resolves them."""

KEYS = ["specimen", "joint", "coordinate"]


def conclusions(
    study: JointPoseSensitivity, cohort: Cohort, results: ResultTables
) -> Iterator[Conclusion]:
    """All of them."""
    shares = results.table("variance_shares")
    if len(shares):
        yield from _grid(shares)
    summary = results.table("summary")
    if len(summary):
        chosen = summary[(summary["part"] == "poses") & (summary["dataset"] == "reduced")]
        yield from _agreement(study, cohort, chosen[chosen["quantity"] == "error"])
        yield from _frames(chosen[chosen["quantity"].isin(["origin", "orientation"])])
    runs = results.table("simulations")
    if len(runs):
        each = runs.drop_duplicates(["specimen", "pose", "stiffness", "test", "cycle", "step"])
        lost = int((~each["status"].isin(USABLE)).sum())
        values = {"runs": Value(len(each)), "lost": Value(lost, source="simulations: status")}
        yield Conclusion("runs", "check" if lost else "ok", values)
    if study.loading == "settle":
        time = Value(study.settle_time_s, "s", source="settings: settle_time_s")
        yield Conclusion("rest", "check", {"time": time})


def _grid(shares: pd.DataFrame) -> Iterator[Conclusion]:
    """In how many errors poses or stiffness have the larger share, their intervals apart.

    Of errors with their sign: where sizes are taken an error is folded at zero, and folding makes
    an interaction of pose and stiffness that is none.
    """
    done = shares[(shares["status"] == "done") & shares["signed_share"].notna()]
    pose, stiffness = (
        done[done["factor"] == factor].set_index(KEYS) for factor in ("pose", "stiffness")
    )
    if pose.empty:
        return
    stiffness = stiffness.reindex(pose.index)
    above = {
        "pose": int((pose["signed_share_low"] > stiffness["signed_share_high"]).sum()),
        "stiffness": int((stiffness["signed_share_low"] > pose["signed_share_high"]).sum()),
    }
    source = "variance_shares: signed_share, intervals apart"
    values = {name: Value(n, n=len(pose), source=source) for name, n in above.items()}
    values["errors"] = Value(len(pose), source="variance_shares: joints and coordinates")
    models = int(done["n_stiffness"].max())
    values["models"] = Value(models, source="variance_shares: n_stiffness")
    larger = [name for name, n in above.items() if n]
    verdict = "both" if len(larger) == 2 else larger[0] if larger else "neither"
    yield Conclusion("grid", verdict, values)


def _agreement(
    study: JointPoseSensitivity, cohort: Cohort, errors: pd.DataFrame
) -> Iterator[Conclusion]:
    """The motion above reading error that fitted models miss most, as a share of itself."""
    known = errors[errors["median"].notna() & errors["percent_of_measured"].notna()]
    if known.empty:
        return
    sd = cohort.reading_sd()
    reading = dict(zip(COORDINATES, [0.0] * 6 if sd is None else sd.tolist(), strict=True))
    above = known[known["median"] > 2.0 * known["coordinate"].map(reading)]
    if (known["maximum"] < ROUNDING).all() or above.empty:
        yield Conclusion("agreement", "within" if above.empty else "exact")
        return
    worst = max(above.to_dict("records"), key=lambda row: row["percent_of_measured"])
    percent, way, n = float(worst["percent_of_measured"]), worst["coordinate"], int(worst["n"])
    source = "summary: error of retained fits"
    values = {
        "error": Value(float(worst["median"]), unit(way), n=n, source=f"{source}, median"),
        "percent": Value(percent, "%", n=n, source=source),
    }
    place = place_of(worst["specimen"], worst["joint"], cohort)
    shared = study.calibration.grouping == "per_specimen" and len(cohort.joint_names) > 1
    missed = "misses_shared" if shared else "misses"
    names = {"motion": f"{AXIS[way].lower()} motion of {place}"}
    yield Conclusion("agreement", missed if percent > MISSED else "follows", values, names)


def _frames(rows: pd.DataFrame) -> Iterator[Conclusion]:
    """The widest middle half of joint centres and of axes."""
    known = rows[rows["iqr"].notna()]
    widest = known.groupby("quantity")["iqr"].max()
    if {"origin", "orientation"} <= set(widest.index):
        source = "summary: largest interquartile range of retained fits"
        shift, turn = (float(widest[name]) for name in ("origin", "orientation"))
        values = {
            "shift": Value(shift, "mm", source=source),
            "turn": Value(turn, "°", source=source),
        }
        yield Conclusion("frames", "told", values)
