"""Tables over all scored cohorts."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from tests.generators.hidden import CATALOGUE, KNOWN
from tests.validation.discrepancy.designs import DESIGNS, design_of
from tests.validation.discrepancy.judged import NULLS, Judged
from tests.validation.discrepancy.parameters import Compared, compared
from tests.validation.discrepancy.rates import share
from tests.validation.discrepancy.row import Row

ANSWERS = (
    *KNOWN,
    *("several", "PART", "SET with the truth", "SET without it", "NULL", "UNKNOWN", "REFUSED"),
)
BANDS = ("none", "< 0.2", "0.2-0.5", ">= 0.5")


def answer(row: Judged) -> str:
    """One of `ANSWERS`."""
    if row.verdict == "SET":
        return "SET with the truth" if row.truth_in_set else "SET without it"
    if row.is_named and len(row.named) == 1 and row.named[0] in KNOWN:
        return row.named[0]
    return "several" if row.verdict == "NAMED" else row.verdict


def truth_name(row: Judged) -> str:
    """What was hidden, in the words of the confusion table."""
    if row.kind in ("two", "part"):
        return row.kind
    if row.kind == "mistake":
        return f"mistake: {row.label}"
    return "+".join(row.truth) or "NULL"


def confusion(rows: Sequence[Judged]) -> pd.DataFrame:
    """Truth by answer, for each level of the gap; a row of counts."""
    found: dict[tuple[str, str], dict[str, int]] = {}
    for row in rows:
        key = truth_name(row), row.band
        counts = found.setdefault(key, dict.fromkeys(ANSWERS, 0))
        counts[answer(row)] += 1
    lines = [
        {"truth": truth, "gap": gap, "n": sum(counts.values()), **counts}
        for (truth, gap), counts in sorted(found.items(), key=_order)
    ]
    return pd.DataFrame(lines, columns=["truth", "gap", "n", *ANSWERS])


def _order(item: tuple[tuple[str, str], Any]) -> tuple[int, str, str]:
    truth, gap = item[0]
    place = 0 if truth == "NULL" else 1 + KNOWN.index(truth) if truth in KNOWN else 99
    return place, truth, gap


def by_effect(rows: Sequence[Judged]) -> pd.DataFrame:
    """Single effects by name and gap, over all designs and over those that show it by algebra."""
    singles = [row for row in rows if row.kind in ("one", "small")]
    found = []
    for name in (*KNOWN, "all"):
        for formula in ("same", "other"):
            for band in BANDS:
                of_name = [r for r in singles if name in ("all", *r.truth) and r.band == band]
                those = [r for r in of_name if r.formula == formula]
                if those:
                    row = {"effect": name, "formula": formula, "gap": band, **_counts(those)}
                    found.append(row)
    return pd.DataFrame(found)


def by_formula(rows: Sequence[Judged]) -> pd.DataFrame:
    """Large single effects above their limit by each formula: which are found, and as what."""
    singles = [row for row in rows if row.kind == "one" and row.above and row.band == ">= 0.5"]
    groups: dict[tuple[str, str], list[Judged]] = {}
    for row in singles:
        one = row.row["recipe"]["hidden"][0]
        groups.setdefault((one["name"], str(one["shape"].get("formula", ""))), []).append(row)
    return pd.DataFrame(
        [
            {
                "effect": name,
                "formula": formula,
                "library": CATALOGUE[name].formulas.get(formula, "other"),
                **_counts(those),
            }
            for (name, formula), those in sorted(groups.items())
        ]
    )


def by_design(rows: Sequence[Judged]) -> pd.DataFrame:
    """Nulls and single effects above their limit by design."""
    found = []
    for design in DESIGNS:
        nulls = [r for r in rows if r.kind in NULLS and r.design == design]
        those = [r for r in rows if r.kind in ("one", "small") and r.above and r.design == design]
        alarms = sum(r.verdict in ("NAMED", "PART", "SET") for r in nulls)
        if nulls or those:
            found.append(
                {"design": design, "n_null": len(nulls), "alarms": alarms, **_counts(those)}
            )
    return pd.DataFrame(found)


def _counts(those: Sequence[Judged]) -> dict[str, Any]:
    top1 = share("", (row.top1 for row in those))
    shown = [row for row in those if row.shown]
    return {
        "n": len(those),
        "top1": top1["count"],
        "top1_low": top1["low"],
        "top1_high": top1["high"],
        "truth_in_set": sum(row.truth_in_set for row in those),
        "wrong_name": sum(row.wrong_name for row in those),
        "part": sum(row.verdict == "PART" for row in those),
        "set": sum(row.verdict == "SET" for row in those),
        "null": sum(row.verdict == "NULL" for row in those),
        "unknown": sum(row.verdict == "UNKNOWN" for row in those),
        "n_shown": len(shown),
        "top1_shown": sum(row.top1 for row in shown),
        "n_testable": sum(row.testable is True for row in those),
        "top1_testable": sum(row.top1 for row in those if row.testable),
        "n_below_limit": sum(row.below_limit is True for row in those),
    }


def parameters(rows: Sequence[Judged]) -> pd.DataFrame:
    """Parameters of effects named right, by gap from 0.2 on."""
    bands = (">= 0.5", "0.2-0.5")
    right = [r for r in rows if r.kind in ("one", "small") and r.top1 and r.band in bands]
    found: dict[tuple[str, str, str], list[Compared]] = {}
    for row in right:
        for one in compared(row.row):
            found.setdefault((one.effect, one.name, row.band), []).append(one)
    return pd.DataFrame(
        [
            {
                "effect": effect,
                "parameter": name,
                "gap": gap,
                "n": len(ones),
                "within_10_percent": sum(one.close for one in ones),
                "median_error": float(np.nanmedian([one.error for one in ones])),
                "with_interval": sum(one.inside is not None for one in ones),
                "in_interval": sum(one.inside is True for one in ones),
            }
            for (effect, name, gap), ones in sorted(found.items())
        ]
    )


def sets(rows: Sequence[Row], judgements: dict[int, Judged]) -> pd.DataFrame:
    """One line per cohort, those without an answer too."""
    return pd.DataFrame([_line(row, judgements.get(row["target"]["seed"])) for row in rows])


def _line(row: Row, one: Judged | None) -> dict[str, Any]:
    target, recipe = row["target"], row["recipe"]
    held_out = (row.get("held_out") or {}).get("tests", {})
    return {
        "seed": target["seed"],
        "kind": target["kind"],
        "label": target["label"],
        "formulas": "+".join(str(h["shape"].get("formula", "")) for h in recipe["hidden"]),
        "formula": one.formula if one else "",
        "wanted_gap": target["gap"] if recipe["hidden"] else 0.0,
        "gap": row.get("truth", {}).get("gap"),
        "design": _design(recipe),
        "dirt": "+".join(recipe["dirt"]),
        "status": row["status"],
        "verdict": row.get("verdict", ""),
        "named": "+".join(row.get("named", [])),
        "tied": "+".join(row.get("tied", [])),
        "top1": one.top1 if one else None,
        "shown": one.shown if one else None,
        "testable": one.testable if one else None,
        "below_limit": one.below_limit if one else None,
        "margin": _margin(row),
        "gap_base": row.get("gap", {}).get("base"),
        "gap_final": row.get("gap", {}).get("final"),
        "held_out_closed": held_out.get("closed"),
        "held_out_rms": held_out.get("rms"),
        "cpu_seconds": sum(row.get("seconds", {}).values()),
        "message": row["message"] or _why_not(row, one),
    }


def _why_not(row: Row, one: Judged | None) -> str:
    """What the search says for itself where it is not right."""
    right = one is not None and (one.top1 or (not one.truth and one.verdict == "NULL"))
    return "" if right else str(row.get("why", ""))


def _design(recipe: dict[str, Any]) -> str:
    words = [design_of(recipe), recipe["noise"]]
    words += [key for key in ("unloading", "translations", "zeroed") if recipe[key]]
    if recipe["preload_n"]:
        words.append(f"preload {recipe['preload_n']:g} N")
    return " ".join(words)


def _margin(row: Row) -> float | None:
    """Log evidence over the nearest rival that is not named itself."""
    names = {one["name"] for one in row.get("standing", [])}
    margins = [
        margin
        for one in row.get("standing", [])
        for name, margin in one["rivals"]
        if name not in names and margin is not None
    ]
    return min(margins, default=None)
