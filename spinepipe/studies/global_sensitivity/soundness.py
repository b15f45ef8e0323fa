"""What the indices rest on, as sentences: the spine they were taken at, and the runs that failed.

Each sentence comes from rows of ``base_stiffness``, ``base_motion`` and ``failed_runs``. Doubts are
those that may change what the indices say.
"""

from collections.abc import Iterator
from math import exp, inf

import pandas as pd

from spinepipe.report.words import (
    after_number,
    case,
    count,
    fixed,
    listed,
    number,
    percent,
    plain,
)
from spinepipe.studies.global_sensitivity.factors import StiffnessFactor, Times
from spinepipe.studies.global_sensitivity.figures.panels import whole
from spinepipe.studies.global_sensitivity.settings import GlobalSensitivity
from spinepipe.studies.global_sensitivity.tables import EVERY
from spinepipe.units import STIFFNESS_UNITS

MOST = 4
"""Specimens, tests or coordinates that a sentence names."""

REACH = 2.0
"""SDs of a log-normal spread that count as its ends."""

_THIRD = {"lowest_third": ("low_third", "lowest"), "highest_third": ("high_third", "highest")}


def cautions(
    study: GlobalSensitivity, stiffness: pd.DataFrame, motion: pd.DataFrame, failed: pd.DataFrame
) -> Iterator[str]:
    """What may make the indices those of another spine, or of a part of the inputs only."""
    yield from _no_fit(stiffness)
    yield from _far(study, motion)
    yield from _too_wide(study, stiffness)
    yield from _failed(failed)


def starting_spine(
    study: GlobalSensitivity, stiffness: pd.DataFrame, motion: pd.DataFrame
) -> Iterator[str]:
    """From which stiffness the factors start, and how that spine moves."""
    if not stiffness.empty:
        yield _start(study, stiffness)
        yield from _held_back(stiffness)
    yield from _near(motion)


def _start(study: GlobalSensitivity, rows: pd.DataFrame) -> str:
    fitted = rows[rows["source"] == "fitted"]
    if not study.is_fitted:
        return (
            "Factors start from the stiffness of the study file (stiffness), which no measured "
            "motion decided."
        )
    if fitted.empty:
        return "Factors start from calibration.start: no stiffness could be fitted."
    told = [
        _of_coordinate(str(name), part) for name, part in fitted.groupby("coordinate", sort=False)
    ]
    whose = _names(fitted["specimen"])
    return (
        f"Factors start from the stiffness fitted to the measured motion of {whose}: "
        f"{'; '.join(told)}."
    )


def _of_coordinate(name: str, rows: pd.DataFrame) -> str:
    """``extension 21.1 N m/rad (95 % region 18.3 to 57.1)``, or the span over specimens."""
    unit, known = STIFFNESS_UNITS[name], int(rows["identifiable"].sum())
    values = rows["stiffness"]
    if len(rows) > 1:
        span = f"{number(values.min())} to {number(values.max())} {unit}"
        return f"{plain(name)} {span}, held by the data in {known} of {count(len(rows), 'fit')}"
    one = rows.iloc[0]
    told = f"{plain(name)} {number(one['stiffness'])} {unit}"
    if known:
        return f"{told} (95 % region {number(one['low'])} to {number(one['high'])})"
    below, above = (
        "" if open_ else number(end)
        for open_, end in ((one["open_below"], one["low"]), (one["open_above"], one["high"]))
    )
    ends = f"from {below} up" if below else f"up to {above}" if above else "any value"
    if below and above:
        ends = f"{below} to {above}, with a large error"
    return f"{told}, which the data do not hold ({ends})"


def _held_back(rows: pd.DataFrame) -> Iterator[str]:
    """Coordinates that the fit sent back to their start."""
    back = rows[rows["source"] == "at_bound"]
    for name, part in back.groupby("coordinate", sort=False):
        start = f"{number(part['start'].iloc[0])} {STIFFNESS_UNITS[str(name)]}"
        whose = _names(part["specimen"])
        yield (
            f"The fit of {plain(str(name))} ran to a bound for {whose}: factors start from "
            f"calibration.start there, {start}, and the others were fitted anew."
        )


def _no_fit(rows: pd.DataFrame) -> Iterator[str]:
    lost = rows[rows["source"] == "no_fit"] if len(rows) else rows
    if len(lost):
        why = listed([text for text in lost["message"].unique() if text], most=1)
        reason = f" ({why})" if why else ""
        yield (
            f"The stiffness of {_names(lost['specimen'])} could not be fitted{reason}: factors "
            "start from calibration.start there, which is nobody's own."
        )


def _of_tests(motion: pd.DataFrame, *verdicts: str) -> pd.DataFrame:
    """Rows of the loaded coordinate: means over measured joints."""
    if motion.empty:
        return motion
    rows = motion[(motion["joint"] == EVERY) & motion["loaded"]]
    return rows[rows["verdict"].isin(verdicts)]


def _far(study: GlobalSensitivity, motion: pd.DataFrame) -> Iterator[str]:
    far = _of_tests(motion, "far")
    every = len(_of_tests(motion, "near", "far"))
    if len(far):
        worst = [_moves(row) for _, row in far.head(MOST).iterrows()]
        remedy = (
            "its law or its geometry may be wrong (see base_motion)"
            if study.is_fitted
            else "stiffness: fitted takes each specimen's own"
        )
        yield (
            f"The base does not move like the specimens in {len(far)} of {count(every, 'test')}: "
            f"{listed(worst, MOST)}. Near is half to twice. The indices are those of another "
            f"spine: {remedy}."
        )
    gone = _without_equilibrium(motion)
    if gone:
        yield f"The base itself has no equilibrium: {listed(gone, MOST)}."


def _without_equilibrium(motion: pd.DataFrame) -> list[str]:
    """Specimens and tests in which the base does not stand."""
    if motion.empty:
        return []
    rows = motion[motion["verdict"] == "no_equilibrium"].drop_duplicates(["specimen", "test"])
    return [f"{row['specimen']} {plain(row['test'])}" for _, row in rows.iterrows()]


def _near(motion: pd.DataFrame) -> Iterator[str]:
    """Tests in which the base moves like the specimen."""
    near, far = _of_tests(motion, "near"), _of_tests(motion, "far")
    if motion.empty or (near.empty and far.empty and _without_equilibrium(motion)):
        return
    if near.empty and far.empty:
        yield (
            "No loaded coordinate was measured: nothing tells whether the base moves like the "
            "specimens."
        )
        return
    if len(near) == 1 and far.empty:
        yield f"The base moves like the specimen: {_moves(near.iloc[0])}."
    elif len(near):
        ratios = near["ratio"].dropna()
        span = ""
        if len(ratios):
            span = f", {fixed(ratios.min())} to {fixed(ratios.max())} of what was measured"
        yield (
            f"The base moves like the specimens in {len(near)} of "
            f"{count(len(near) + len(far), 'test')}{span}."
        )


def _moves(row: pd.Series) -> str:
    """``s01, flexion: 1.06 of the measured extension (−1.69° against −1.60°)``."""
    unit = after_number(row["unit"])
    ours, theirs = (f"{number(row[name])}{unit}" for name in ("predicted", "measured"))
    share = "" if pd.isna(row["ratio"]) else f"{fixed(row['ratio'])} of the measured "
    place = f"{row['specimen']}, {case(row['test']).lower()}"
    return f"{place}: {share}{plain(row['coordinate'])} ({ours} against {theirs})"


def _too_wide(study: GlobalSensitivity, rows: pd.DataFrame) -> Iterator[str]:
    """Stiffness whose spread reaches values that the data of the fit exclude."""
    if rows.empty:
        return
    for factor in study.factors:
        if not isinstance(factor, StiffnessFactor):
            continue
        own = rows[(rows["coordinate"] == factor.coordinate) & (rows["source"] == "fitted")]
        low, high = _ends(factor.times)
        below = low * own["stiffness"] < own["low"]  # an open end is empty, and below nothing
        above = high * own["stiffness"] > own["high"]
        out = int((below | above).sum())
        if out:
            sides = [side for side, of in (("below", below), ("above", above)) if of.any()]
            whose = f" for {out} of {count(len(own), 'specimen')}" if len(own) > 1 else ""
            yield (
                f"The spread of {plain(factor.label)} ({number(low)} to {number(high)} times) "
                f"reaches {listed(sides)} what the data of the fit allow{whose}: part of the "
                "variation is of spines that the measured motion excludes."
            )


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


def _failed(rows: pd.DataFrame) -> Iterator[str]:
    """How many runs failed in each test, where, and what that makes of the indices."""
    if rows.empty:
        return
    lost = rows[rows["failed"] > 0]
    for test, part in lost.groupby("test", sort=False):
        each = part.drop_duplicates("specimen")
        runs, failed = int(each["runs"].sum()), int(each["failed"].sum())
        how = [
            f"{int(each[name].sum())} {words}"
            for name, words in (
                ("tipped", "tipped over"),
                ("not_converged", "did not converge"),
                ("refused", "were no spine"),
            )
            if each[name].sum()
        ]
        what = "fits of stiffness" if test == EVERY else f"runs of {case(str(test)).lower()}"
        whose = "stiffness" if test == EVERY else case(str(test)).lower()
        yield (
            f"{whole(failed)} of {whole(runs)} {what} failed ({percent(failed, runs)}; "
            f"{listed(how)}), {_where(part)}. The indices of {whose} speak only of inputs at "
            "which the spine stands."
        )


def _where(part: pd.DataFrame) -> str:
    """The factors at whose ends failed runs lie."""
    sure = part[part["mostly"] != "nowhere"].sort_values("p", kind="stable")
    if sure.empty:
        return "at no end of a factor more often than by chance"
    several = part["specimen"].nunique() > 1
    told = []
    for row in sure.head(MOST).to_dict("records"):
        column, which = _THIRD[row["mostly"]]
        n, of = int(row[column]), int(row["failed"])
        whose = f" of {row['specimen']}" if several else ""
        told.append(f"{n} of {of}{whose} in the {which} third of {plain(row['factor'])}")
    return f"{listed(told, MOST)}, whose effect may then be understated"


def _names(column: pd.Series) -> str:
    names = list(dict.fromkeys(column))
    return listed(names, MOST)
