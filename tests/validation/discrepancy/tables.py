"""Tables over all scored cohorts."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from tests.generators.hidden import KNOWN
from tests.validation.discrepancy.judged import Judged
from tests.validation.discrepancy.parameters import Compared, compared
from tests.validation.discrepancy.rates import share
from tests.validation.discrepancy.row import Row

ANSWERS = (*KNOWN, "several", "SET with the truth", "SET without it", "NULL", "UNKNOWN")
LEVEL_NAMES = {0.0: "none", 0.1: "0.1", 0.2: "0.2", 0.5: "0.5", 1.0: "1.0"}


def answer(row: Judged) -> str:
    """One of `ANSWERS`."""
    if row.verdict == "SET":
        return "SET with the truth" if row.truth_in_set else "SET without it"
    if row.verdict == "NAMED":
        return row.named[0] if len(row.named) == 1 else "several"
    return row.verdict


def truth_name(row: Judged) -> str:
    """What was hidden, in the words of the confusion table."""
    if row.kind in ("pair", "mistake"):
        return row.kind if row.kind == "pair" else f"mistake: {row.label}"
    return "+".join(row.truth) or "NULL"


def confusion(rows: Sequence[Judged]) -> pd.DataFrame:
    """Truth by answer, for each level of the gap; a row of counts."""
    found: dict[tuple[str, str], dict[str, int]] = {}
    for row in rows:
        key = truth_name(row), LEVEL_NAMES[row.level] if row.truth else "none"
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
    singles = [row for row in rows if row.kind == "single"]
    found = []
    for name in (*KNOWN, "all"):
        for level, gap in LEVEL_NAMES.items():
            those = [r for r in singles if name in ("all", *r.truth) and r.level == level]
            if those:
                found.append({"effect": name, "gap": gap, **_counts(those)})
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
    right = [row for row in rows if row.kind == "single" and row.top1 and row.at_least(0.2)]
    found: dict[tuple[str, str, str], list[Compared]] = {}
    for row in right:
        for one in compared(row.row):
            gap = ">= 0.5" if row.at_least(0.5) else "0.2"
            found.setdefault((one.effect, one.name, gap), []).append(one)
    return pd.DataFrame(
        [
            {
                "effect": effect,
                "parameter": name,
                "gap": gap,
                "n": len(ones),
                "within_10_percent": sum(one.close for one in ones),
                "median_error": float(np.median([one.error for one in ones])),
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
        "cpu_seconds": row.get("seconds", {}).get("search_cpu"),
        "message": row["message"] or _why_not(row, one),
    }


def _why_not(row: Row, one: Judged | None) -> str:
    """What the search says for itself where it is not right."""
    right = one is not None and (one.top1 or (not one.truth and one.verdict == "NULL"))
    return "" if right else str(row.get("why", ""))


def _design(recipe: dict[str, Any]) -> str:
    words = [recipe["design"], recipe["noise"]]
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
