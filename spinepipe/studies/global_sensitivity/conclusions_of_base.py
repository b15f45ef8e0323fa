"""What the indices rest on: the spine that inputs start from, their spreads, and failed runs."""

from collections.abc import Iterator
from math import exp, inf

import pandas as pd

from spinepipe.report.conclusions import Conclusion, Value
from spinepipe.report.page.study_page import ResultTables
from spinepipe.report.words import AXIS, listed, plain
from spinepipe.studies.global_sensitivity.factors import StiffnessFactor, Times
from spinepipe.studies.global_sensitivity.outputs import factor_name
from spinepipe.studies.global_sensitivity.settings import GlobalSensitivity
from spinepipe.studies.global_sensitivity.tables import EVERY

MANY_FAILED = 0.1
"""Share of runs that failed above which the indices no longer stand for the spreads as a whole."""

REACH = 2.0
"""SDs of a log-normal spread that count as its ends."""


def of_base(study: GlobalSensitivity, results: ResultTables) -> Iterator[Conclusion]:
    """All of them."""
    stiffness, motion = (results.table(name) for name in ("base_stiffness", "base_motion"))
    yield _stiffness(study, stiffness)
    yield from _starting_spine(motion)
    if study.is_fitted and len(stiffness):
        yield from _spreads(study, stiffness)
    yield from _runs(study, results.table("failed_runs"))


def _stiffness(study: GlobalSensitivity, rows: pd.DataFrame) -> Conclusion:
    """Where the stiffness comes from that factors multiply."""
    if not study.is_fitted or rows.empty:
        return Conclusion("stiffness", "check_given")
    for source, verdict in (("no_fit", "stop"), ("at_bound", "check_bound")):
        lost = rows[rows["source"] == source]
        if len(lost):
            coordinates = [AXIS[name].lower() for name in dict.fromkeys(lost["coordinate"])]
            names = {
                "specimens": listed(dict.fromkeys(lost["specimen"])),
                "coordinates": listed(coordinates),
            }
            return Conclusion("stiffness", verdict, names=names)
    asked = [one.coordinate for one in study.factors if isinstance(one, StiffnessFactor)]
    own = rows[rows["coordinate"].isin(asked)]
    kept, open_ = own["source"] == "not_free", own["identifiable"].eq(False)
    for chosen, verdict in ((kept, "check_free"), (open_, "check_open")):
        if chosen.any():
            told = dict.fromkeys(own.loc[chosen, "coordinate"])
            names = {"coordinates": listed(AXIS[name].lower() for name in told)}
            return Conclusion("stiffness", verdict, names=names)
    return Conclusion("stiffness", "ok")


def _starting_spine(motion: pd.DataFrame) -> Iterator[Conclusion]:
    """Whether the spine, before any factor changes it, moves like the specimens."""
    if motion.empty:
        return
    falls = motion[motion["verdict"] == "no_equilibrium"]
    if len(falls):
        tests = listed(plain(name) for name in dict.fromkeys(falls["test"]))
        yield Conclusion("base_spine", "stop_falls", names={"test": tests})
        return
    rows = motion[(motion["joint"] == EVERY) & motion["loaded"]]
    known = rows[rows["verdict"].isin(("near", "far"))].dropna(subset=["ratio"])
    if known.empty:
        yield Conclusion("base_spine", "check")
        return
    far = known[known["verdict"] == "far"]
    chosen = far if len(far) else known
    worst = chosen.iloc[int((chosen["ratio"] - 1.0).abs().argmax())]
    source = "base_motion: ratio, mean over joints, worst test"
    values = {"ratio": Value(float(worst["ratio"]), n=len(known), source=source)}
    names = {"test": plain(str(worst["test"]))}
    yield Conclusion("base_spine", "stop_far" if len(far) else "ok", values, names)


def _spreads(study: GlobalSensitivity, rows: pd.DataFrame) -> Iterator[Conclusion]:
    """Whether spreads of stiffness reach values that the data of the fit exclude."""
    beyond = []
    for factor in study.factors:
        if not isinstance(factor, StiffnessFactor):
            continue
        own = rows[(rows["coordinate"] == factor.coordinate) & (rows["source"] == "fitted")]
        low, high = _ends(factor.times)
        # an open end is empty, and nothing is below it
        below, above = low * own["stiffness"] < own["low"], high * own["stiffness"] > own["high"]
        if (below | above).any():
            beyond.append(factor_name(factor.label))
    if beyond:
        yield Conclusion("spread", "check", names={"factor": listed(beyond)})
    elif any(isinstance(factor, StiffnessFactor) for factor in study.factors):
        yield Conclusion("spread", "ok")


def _ends(times: Times) -> tuple[float, float]:
    """Lowest and highest multiplier of a spread."""
    reach = exp(REACH * times.sd) if times.sd is not None else None
    low, high = times.low, times.high
    if reach is not None:
        low = max(low or 0.0, times.middle / reach)
        high = min(high or inf, times.middle * reach)
    assert low is not None
    assert high is not None  # a spread without an SD has both
    return low, high


def _runs(study: GlobalSensitivity, rows: pd.DataFrame) -> Iterator[Conclusion]:
    """How many runs failed, test by test; one light where none did."""
    one = rows.drop_duplicates(["specimen", "test"]) if len(rows) else rows
    if one.empty:
        return
    if not one["failed"].any():
        every = Value(study.n_runs, source="settings: design")
        yield Conclusion("runs", "ok", {"runs": every})
        return
    for test, part in one.groupby("test", sort=False):
        runs, failed = int(part["runs"].sum()), int(part["failed"].sum())
        if failed:
            source = "failed_runs: sums over specimens"
            values = {"runs": Value(runs, source=source), "failed": Value(failed, source=source)}
            names = {"test": "fits of stiffness" if test == EVERY else plain(str(test))}
            verdict = "stop" if failed > MANY_FAILED * runs else "check"
            yield Conclusion("runs", verdict, values, names)
