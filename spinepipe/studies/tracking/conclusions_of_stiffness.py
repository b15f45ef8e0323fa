"""What markers tell of stiffness, and what calibrations tell beyond what they began with."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.motion.joint_tables import SIDES
from spinepipe.motion.passive import passive_elements
from spinepipe.motion.skeleton import JOINTS
from spinepipe.report.conclusions import Conclusion, Value, numbers_from
from spinepipe.report.words import AXIS, count, level, listed, plain, tick
from spinepipe.status import Status
from spinepipe.studies.tracking.conclusions_of_errors import (
    Tables,
)
from spinepipe.studies.tracking.settings import LEARNT, Tracking
from spinepipe.studies.tracking.tables import LIMIT
from spinepipe.studies.tracking.trials import PASSIVE
from spinepipe.studies.tracking.words import phrase
from spinepipe.units import COORDINATES

WIDE = 1.96
"""SDs to each side that hold 95 % of a normal distribution."""

EXPECTED = 0.05
"""Share of values that the prior alone leaves outside its range."""

PAIR = ("optk_from_flexion", "optk_from_bending")
"""Calibrations on one kind of motion each."""

SHOWN_FIRST = ("optk_from_both", *LEARNT)
"""Which calibration is told of: the first of these that there is."""

PLACE = ["specimen", "region", "coordinate"]


def judged_profiles(tables: Tables) -> pd.DataFrame:
    """A row for each profile, with what its points say.

    Columns beside its own: ``says`` (``told``, ``one_sided``: as the table has it; ``edge``: the
    least cost is at an end of what converged, and something is excluded; ``gap``: something between
    is, no end; ``flat``: nothing is; ``lost``: fewer than two fits converged), ``only`` (whether
    all but the end is excluded), ``most`` (largest cost over the best) and ``end`` (``softest`` or
    ``stiffest``).

    Ends are found by the place of a point among the others, not by its ratio: a ratio that went
    through a logarithm is not the same number as before.
    """
    rows: list[dict[str, Any]] = []
    points = tables["profile_points"]
    for row in tables["profiles"].to_dict("records"):
        cells = {str(name): cell for name, cell in row.items()}
        own = points[(points[PLACE] == [row[name] for name in PLACE]).all(axis=1)]
        cost = own.sort_values("point")["cost_over_best"].dropna().to_numpy(float)
        says, end, only = str(row["verdict"]), "", False
        if len(cost) < 2:
            says = "lost"
        elif (cost <= LIMIT).all():
            says = "flat"
        elif says == "not_told":
            end = {0: "softest", len(cost) - 1: "stiffest"}.get(int(np.argmin(cost)), "")
            says = "edge" if end else "gap"
            only = bool((cost > LIMIT).sum() == len(cost) - 1)
        most = float(cost.max()) if len(cost) else np.nan
        rows.append({**cells, "says": says, "only": only, "end": end, "most": most})
    return pd.DataFrame(rows)


def conclusions_of_stiffness(
    study: Tracking, cohort: Cohort, tables: Tables
) -> Iterator[Conclusion]:
    """All of them, where profiles were made or stiffness was calibrated."""
    if len(tables["profiles"]):
        yield from _profiles(judged_profiles(tables), tables["profile_points"]["ratio"])
    rows = tables["stiffness"]
    if len(rows):
        yield from _ended(rows)
        values = calibrated_values(study, cohort, rows)
        yield from _prior(values)
        yield from _between(values)


def _profiles(rows: pd.DataFrame, ratios: "pd.Series[float]") -> Iterator[Conclusion]:
    """What most can be said of: a bound on both sides, on one, a fall to an end, nothing."""
    counts = {name: int((rows["says"] == name).sum()) for name in rows["says"].unique()}
    order = ("told", "one_sided", "edge", "gap", "flat", "lost")
    verdict = next(name for name in order if counts.get(name))
    if verdict == "told" and counts["told"] == len(rows):
        verdict = "all_told"
    edges = rows[rows["says"] == "edge"]
    if verdict == "edge" and edges["only"].all():
        verdict = "edge_only"
    source = "profiles and profile_points"
    values = {
        "profiles": Value(len(rows), source=source),
        **{name: Value(counts.get(name, 0), source=source) for name in order},
    }
    own = rows[rows["says"] == verdict.removeprefix("all_").removesuffix("_only")]
    sizes = {"most": own["most"].max(), "low": ratios.min(), "high": ratios.max()}
    values |= {n: Value(float(x), source="profile_points") for n, x in sizes.items() if pd.notna(x)}
    who = list(dict.fromkeys(map(str, rows["specimen"])))
    subjects = listed(who) if len(who) <= 3 else count(len(who), "subject")
    end = listed(dict.fromkeys(edges["end"]), last="or")
    names = {"whose": subjects, "end": end, "places": _places(own)}
    yield Conclusion("profiles", verdict, values, names)
    partly = rows["message"].fillna("").str.contains("did not settle") | (rows["says"] == "lost")
    lost = {"lost": Value(int(partly.sum()), source=source), "profiles": values["profiles"]}
    yield Conclusion("profile_fits", "check" if partly.any() else "ok", lost)


def _places(rows: pd.DataFrame) -> str:
    """A few profiles with their ends; of more than three the first."""
    parts = []
    for row in rows.head(3).to_dict("records"):
        low, high = row["low"], row["high"]
        ends = f"{tick(round(low, 2))} to" if pd.notna(low) else "below"
        between = f"{ends} {tick(round(high, 2))}" if pd.notna(high) else f"above {low:.2g}"
        parts.append(f"{plain(row['region'])} {AXIS[row['coordinate']].lower()} {between}")
    return listed(parts)


def _ended(rows: pd.DataFrame) -> Iterator[Conclusion]:
    fits = rows.drop_duplicates(["specimen", "law"])
    lost = int((fits["status"] != Status.CONVERGED.value).sum())
    values = {
        "lost": Value(lost, source="stiffness: status"),
        "fits": Value(len(fits), source="stiffness"),
    }
    yield Conclusion("calibrations", "check" if lost else "ok", values)


def calibrated_values(study: Tracking, cohort: Cohort, rows: pd.DataFrame) -> pd.DataFrame:
    """Loaded elements with the range of the prior alone, of the ratio to generic stiffness.

    A stiffness B (F + A) at the load F has, to first order, a logarithm whose prior SD follows from
    those of the logarithms of A and B. Columns `prior_low`, `prior_high` are the ends of its 95 %,
    `outside` says whether the calibrated value is beyond them: what is not, silent data explain.
    """
    known = rows.dropna(subset=["ratio_to_generic"])
    known = known[known["ratio_to_generic"] > 0.0].copy()
    generic = passive_elements(cohort.further.get(PASSIVE.stem), PASSIVE.file).a
    places = zip(known["joint"], known["coordinate"], known["side"], strict=True)
    a = np.array(
        [generic[JOINTS.index(j), COORDINATES.index(c), SIDES.index(s)] for j, c, s in places]
    )
    share = a / (known["high_moment_nm"].to_numpy(float) + a)
    sd = np.hypot(study.scales.shape_sd, share * study.scales.size_sd)
    known["prior_low"], known["prior_high"] = np.exp(-WIDE * sd), np.exp(WIDE * sd)
    ratio = known["ratio_to_generic"]
    known["outside"] = (ratio < known["prior_low"]) | (ratio > known["prior_high"])
    return known


def law_told_of(values: pd.DataFrame) -> str:
    """The calibration whose values are shown."""
    there = [str(name) for name in dict.fromkeys(values["law"])]
    return next((name for name in SHOWN_FIRST if name in there), there[0])


def _prior(values: pd.DataFrame) -> Iterator[Conclusion]:
    """Whether calibrated stiffness is anywhere the prior alone would not have left it."""
    if values.empty:
        yield Conclusion("prior", "unloaded")
        return
    law = law_told_of(values)
    own = values[values["law"] == law]
    outside = int(own["outside"].sum())
    source = "stiffness: ratio_to_generic beside the prior of A and B"
    moved = own.loc[own["outside"], "joint"].value_counts()
    counts = {"values": len(own), "outside": outside, "inside": len(own) - outside}
    told = {name: Value(n, source=source) for name, n in counts.items()}
    median = float(own["ratio_to_generic"].median())
    told["median"] = Value(median, n=len(own), source="stiffness: median of ratio_to_generic")
    names = {"approach": phrase(law), "joint": level(str(moved.index[0])) if outside else ""}
    verdict = "beyond" if outside > EXPECTED * len(own) else "within"
    yield Conclusion("prior", verdict, told, names)


def _between(values: pd.DataFrame) -> Iterator[Conclusion]:
    """Whether calibrations on two kinds of motion agree where data moved either of them."""
    keys = ["specimen", "joint", "coordinate", "side"]
    one, other = (values[values["law"] == law].set_index(keys) for law in PAIR)
    both = one.index.intersection(other.index)
    if both.empty:
        return
    ratio = one["ratio_to_generic"][both] / other["ratio_to_generic"][both]
    apart = np.abs(np.log(ratio.to_numpy(float)))
    moved = (one["outside"][both] | other["outside"][both]).to_numpy(bool)
    within = moved.sum() <= EXPECTED * len(both)
    told = np.exp(apart if within else apart[moved])
    source = "stiffness: larger over smaller ratio_to_generic less 1, median of elements"
    values_told = {
        "apart": Value(100.0 * (float(np.median(told)) - 1.0), "%", n=len(told), source=source),
        **numbers_from(source, elements=len(both), moved=int(moved.sum())),
    }
    yield Conclusion("between", "prior" if within else "moved", values_told)
