"""Key findings of a study of trunk loads as sentences, what is not to be trusted first."""

from collections.abc import Callable, Iterator
from typing import Any

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.report.page.document import ResultTables
from spinepipe.report.page.tables import judged
from spinepipe.report.words import capital, count, fixed, listed, number, percent, plain
from spinepipe.studies.trunk_loads.findings_of_loads import (
    by_level,
    filled,
    largest,
    most,
    muscles,
    persons,
    relaxation,
    simplified,
    sound_rows,
    upright,
)
from spinepipe.studies.trunk_loads.headline import leading, missed
from spinepipe.studies.trunk_loads.selection import sound
from spinepipe.studies.trunk_loads.settings import TrunkLoads
from spinepipe.studies.trunk_loads.words import ENDED, TIERS, factor, mpa, unbroken

_MOST_PLACES = 4
_MOST_SHARE = 1.1
"""Sobol's estimate of a share may exceed 1 by chance; by more than this it is no number."""

_NEAR_LIMIT = 0.8
"""Tasks that take more of the strength than this are named."""

Finding = Callable[[TrunkLoads, Cohort, ResultTables], Iterator[str]]


def findings(study: TrunkLoads, cohort: Cohort, results: ResultTables) -> list[str]:
    """The sentences, without those that the study has no table for."""
    return [unbroken(told) for make in MAKERS for told in make(study, cohort, results)]


def ended(study: TrunkLoads, cohort: Cohort, results: ResultTables) -> Iterator[str]:
    """Tasks that did not settle or cannot be held, by how they ended."""
    rows = results.table("tasks")
    if rows.empty:
        return
    others = rows[~sound(rows)]
    if others.empty:
        yield f"All {count(len(rows), 'task')} of all persons settled, and are held."
    for status, part in others.groupby("status", sort=False):
        some = f"{len(part)} of {count(len(rows), 'task')} of all persons"
        last = part[part["message"] != ""]["message"]
        why = f" One message: {last.iloc[0].rstrip('.')}." if len(last) else ""
        ending = ENDED.get(str(status), plain(str(status)))
        yield f"{some} ended {ending} ({_places(part)}).{why}"


def _places(rows: pd.DataFrame) -> str:
    """Tasks, each with how many persons it is of, where several are."""
    counts = rows.groupby("task", sort=False)["specimen"].nunique()
    persons = rows["specimen"].nunique()
    words = [
        f"{plain(str(task))}" + (f" of {count(int(n), 'person')}" if persons > 1 else "")
        for task, n in counts.items()
    ]
    more = len(words) - _MOST_PLACES
    return "; ".join(words[:_MOST_PLACES]) + (f"; and {more} more" if more > 0 else "")


def outside(study: TrunkLoads, cohort: Cohort, results: ResultTables) -> Iterator[str]:
    """Pressures outside the range of Eq 6."""
    known = filled(sound_rows(results, "tasks"), "inside_eq_6")
    if known.empty:
        return
    out = known[~known["inside_eq_6"].astype(bool)]
    if out.empty:
        yield "All pressures lie where the formula of the pressure was fitted."
        return
    yield (
        "Extrapolated, as outside the range in which the formula of the pressure was fitted (0 to "
        f"1.86 MPa of nominal pressure, 0 to 10° of flexion): {len(out)} of "
        f"{count(len(known), 'pressure')} ({percent(len(out), len(known))}), {_places(out)}."
    )


def slack(study: TrunkLoads, cohort: Cohort, results: ResultTables) -> Iterator[str]:
    """The largest moment that no muscle holds, in tasks that settled."""
    rows = filled(sound_rows(results, "tasks"), "largest_slack_nm")
    if rows.empty:
        return
    worst = most(rows, "largest_slack_nm")
    yield (
        "In tasks that settled, the largest moment that no muscle holds is "
        f"{number(float(worst['largest_slack_nm']), 2)} N m ({plain(worst['task'])} of "
        f"{worst['specimen']})."
    )


def agreement(study: TrunkLoads, cohort: Cohort, results: ResultTables) -> Iterator[str]:
    """Computed beside measured pressures, tier by tier, each goal reached or missed."""
    for row in results.table("agreement").to_dict("records"):
        name = f"{capital(plain(row['tier']))} ({TIERS[row['tier']]})"
        if pd.isna(row["rmse_mpa"]):
            yield f"{name}: no computed pressure can be held against a measured one."
            continue
        r = ", too few for a correlation"
        if pd.notna(row["r"]):
            ends = ", without an interval"
            if pd.notna(row["r_low"]) and pd.notna(row["r_high"]):
                ends = f" (95 % interval {fixed(row['r_low'])} to {fixed(row['r_high'])})"
            r = f", r {fixed(row['r'])}{ends}"
        goal = f"The goal of {mpa(float(row['goal_rmse_mpa']))} is reached."
        if not row["reached"]:
            goal = f"The goal is not reached: {missed(row)}."
        yield (
            f"{name}: over {count(int(row['n_tasks']), 'task')} computed pressures are off from "
            f"measured ones by {mpa(row['rmse_mpa'])} (root mean square){r}. {goal}"
        )


def unsettled(study: TrunkLoads, cohort: Cohort, results: ResultTables) -> Iterator[str]:
    """Pressures that count although their forces did not settle."""
    rows = results.table("pressures")
    if rows.empty:
        return
    counted = rows[rows["counted"]]
    gone = counted[counted["computed_mpa"].isna()]
    loose = counted[~sound(counted) & counted["computed_mpa"].notna()]
    for part, words in (
        (gone, "have no computed pressure and are left out of the agreement"),
        (loose, "count in the agreement although their forces did not settle or do not hold them"),
    ):
        if len(part):
            told = [
                f"{plain(str(tier))} {listed([plain(str(task)) for task in own['task']])}"
                for tier, own in part.groupby("tier", sort=False)
            ]
            yield f"Tasks with a measured pressure that {words}: {'; '.join(told)}."


def uncounted(study: TrunkLoads, cohort: Cohort, results: ResultTables) -> Iterator[str]:
    """Tasks whose measured pressure does not count, with both pressures."""
    rows = results.table("pressures")
    if rows.empty:
        return
    others = rows[~rows["counted"] & (rows["tier"] == "untuned")].dropna(subset=["computed_mpa"])
    told = [
        f"{plain(row['task'])} {fixed(row['computed_mpa'])} (measured {fixed(row['measured_mpa'])})"
        for row in others.to_dict("records")
    ]
    if told:
        yield (
            "Beside measured pressures that are not confirmed, with nothing fitted, MPa: "
            f"{listed(told, len(told))}."
        )


def tuned(study: TrunkLoads, cohort: Cohort, results: ResultTables) -> Iterator[str]:
    """Numbers that were fitted, and whether they end at a bound."""
    rows = results.table("tuning")
    if rows.empty:
        return
    own = rows[rows["tier"] == "tuned"].to_dict("records")
    told = [
        f"{factor(row['parameter'])} {number(row['value'])}"
        f"{row['unit'] and ' ' + row['unit']} instead of {number(row['default'])}{_ends(row)}"
        + (", at the end of its range" if row["at_bound"] else "")
        for row in own
    ]
    if told:
        bound = " A number at the end of its range is no finding." * any(
            row["at_bound"] for row in own
        )
        yield f"Fitted to measured pressures: {'; '.join(told)}.{bound}"
    open_ones = [
        factor(row["parameter"])
        for row in own
        if pd.notna(row["identifiable"]) and not row["identifiable"]
    ]
    if open_ones:
        yield (
            f"Measured pressures do not tell {listed(open_ones)}: its region is open, so the "
            "fitted value is a number of the fit and nothing known of the volunteer."
            if len(open_ones) == 1
            else f"Measured pressures tell neither {' nor '.join(open_ones)}: their regions are "
            "open, so the fitted values are numbers of the fit and nothing known of the volunteer."
        )


def _ends(row: dict[Any, Any]) -> str:
    """Region of a fitted number in words, where one was looked for."""
    if pd.isna(row["open_below"]):
        return ""
    if row["open_below"] and row["open_above"]:
        return " (open on both sides)"
    if row["open_above"]:
        return f" ({number(row['low'], 2)} or more)"
    if row["open_below"]:
        return f" ({number(row['high'], 2)} or less)"
    return f" ({number(row['low'], 2)} to {number(row['high'], 2)})"


def drivers(study: TrunkLoads, cohort: Cohort, results: ResultTables) -> Iterator[str]:
    """What the pressure of every sampled task hangs on."""
    rows = results.table("intervals")
    if rows.empty:
        return
    several = rows["specimen"].nunique() > 1
    told, lost = [], rows.drop_duplicates(["specimen", "task"])
    for place in lost.to_dict("records"):
        first = leading(results, place)[:2]
        name = plain(place["task"]) + (f" of {place['specimen']}" if several else "")
        if first and first[0].total > _MOST_SHARE:
            few = (
                "its share of the variance comes out above all of it: too few samples for a number"
            )
            told.append(f"{name}: {factor(first[0].factor)} ({few})")
        elif first:
            parts = [
                f"{factor(one.factor)} {fixed(one.total)} ({fixed(one.low)} to {fixed(one.high)})"
                for one in first
            ]
            told.append(f"{name}: {listed(parts)}")
    if told:
        yield (
            "What the pressure in L4L5 hangs on most, as share of its variance with interactions "
            f"and 95 % interval: {'; '.join(told)}."
        )
    failed, n = int(lost["n_failed"].sum()), int((lost["n_failed"] + lost["n_samples"]).sum())
    yield f"{failed} of {count(n, 'sample')} ({percent(failed, n)}) did not hold and are left out."


def strength(study: TrunkLoads, cohort: Cohort, results: ResultTables) -> Iterator[str]:
    """How much of the strength tasks take."""
    known = filled(sound_rows(results, "tasks"), "strength_used")
    if known.empty:
        return
    near = known[known["strength_used"] > _NEAR_LIMIT]
    worst = most(known, "strength_used")
    share = number(100.0 * float(worst["strength_used"]), 2)
    yield (
        f"Of tasks that settled, {plain(worst['task'])} of {worst['specimen']} takes most of the "
        f"strength, {share} % of it; more than {number(100.0 * _NEAR_LIMIT, 2)} % is taken by "
        f"{len(near)} of {count(len(known), 'task')}."
    )


def stability(study: TrunkLoads, cohort: Cohort, results: ResultTables) -> Iterator[str]:
    """Whether the spine stands when pushed a little, and what co-activation that takes."""
    rows = sound_rows(results, "tasks")
    known = filled(rows, "stable")
    if known.empty:
        return
    fall = known[~known["stable"].astype(bool)]
    which = f" (not: {_places(fall)})" if len(fall) else ""
    yield (
        f"{len(known) - len(fall)} of {count(len(known), 'posture')} asked about would stand when "
        f"pushed a little{which}."
    )
    asked = known[(known["tone"] == "stable") & known["tone_share"].notna()]
    least = asked[asked["stable"].astype(bool)]
    if len(never := asked[~asked["stable"].astype(bool)]):
        yield f"No tone that can be held makes these postures stable: {_places(never)}."
    if len(least):
        told = [
            f"{plain(row['task'])} of {row['specimen']} {number(100.0 * row['tone_share'], 2)} %"
            for row in least.to_dict("records")
        ]
        yield f"Least activation of all muscles that makes a posture stable: {listed(told)}."


def paper_agreement(study: TrunkLoads, cohort: Cohort, results: ResultTables) -> Iterator[str]:
    """How published quantities were judged."""
    told = judged(results.table("against_ghezelbash_2016"))
    if told:
        yield capital(told)


MAKERS: tuple[Finding, ...] = (
    *(ended, outside, slack, agreement, unsettled, uncounted, tuned, relaxation, largest),
    *(by_level, muscles, persons, drivers, strength, stability, simplified, upright),
    paper_agreement,
)
