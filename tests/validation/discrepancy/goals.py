"""The goals of the search, and how far the scored cohorts are from them."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from tests.generators.hidden import KNOWN, LOAD_UNIT
from tests.validation.discrepancy.judged import NULLS, Judged
from tests.validation.discrepancy.parameters import Compared, compared
from tests.validation.discrepancy.rates import Goal, median, percentile, ratio, share

Rows = list[dict[str, Any]]


def goals(rows: Sequence[Judged]) -> Rows:
    """One row per goal, and per count that stands beside one."""
    singles = [row for row in rows if row.kind in ("one", "small")]
    above = [row for row in singles if row.above]
    pairs = [row for row in rows if row.kind == "two" and row.above]
    return [
        *_named(above),
        share(
            "one effect, below its limit: wrong name",
            _wrong(row for row in singles if row.shown and row.below_limit),
            Goal(high=0.03),
        ),
        *_false_alarms(rows),
        *_pairs(pairs),
        *_aliens([row for row in rows if row.kind == "alien" and row.band == ">= 0.5"]),
        *_parts([row for row in rows if row.kind == "part"]),
        *_calibration([row for row in rows if row.kind not in ("mistake", "alien", "part")]),
        *_mistakes([row for row in rows if row.kind == "mistake"]),
        *_unseen([row for row in singles if row.verdict == "NAMED"]),
        *_parameters([row for row in above if row.band == ">= 0.5" and row.top1]),
        share("all cohorts with a known effect: other formula", _other(rows), Goal(low=0.5)),
    ]


def _wrong(rows: Iterable[Judged]) -> Iterable[bool]:
    return (row.wrong_name for row in rows)


def _other(rows: Iterable[Judged]) -> Iterable[bool]:
    return (row.formula != "same" for row in rows if row.known)


def _false_alarms(rows: Sequence[Judged]) -> Rows:
    nulls = [row for row in rows if row.kind in NULLS]
    naming = ("NAMED", "PART", "SET")
    found = [
        share("null and dirty null: NAMED, PART or SET", _said(nulls, naming), Goal(high=0.01)),
        share("null and dirty null: not NULL", (r.verdict != "NULL" for r in nulls)),
    ]
    for kind in NULLS:
        those = [r for r in nulls if r.kind == kind]
        found.append(share(f"{kind}: NAMED, PART or SET", _said(those, naming)))
    return found


def _said(rows: Sequence[Judged], verdicts: Sequence[str]) -> Iterable[bool]:
    return (row.verdict in verdicts for row in rows)


def _named(above: Sequence[Judged]) -> Rows:
    """Of one effect, above its limit; names as a share of what anybody could name."""
    found = []
    for band, goal in ((">= 0.5", 0.95), ("0.2-0.5", 0.85)):
        those = [row for row in above if row.band == band]
        told = f"one effect, gap {band}, above its limit"
        right, nameable = [row.top1 for row in those], [_nameable(row) for row in those]
        expected = f"{told}: named right, as a share of what the oracle expects"
        found += [
            ratio(expected, right, nameable, Goal(low=goal)),
            share(f"{told}: named right", right),
            share(f"{told}: NAMED alone", _named_alone(those)),
        ]
    every = "one effect, above its limit"
    for formula in ("same formula", "other formula"):
        those = [row for row in above if f"{row.formula} formula" == formula]
        found.append(share(f"{every}; {formula}: named right", (row.top1 for row in those)))
    in_set = (row.top1 or row.truth_in_set for row in above)
    return [
        *found,
        share(f"{every}: right or in the set", in_set, Goal(low=0.96)),
        share(f"{every}: wrong name", _wrong(above), Goal(high=0.015)),
    ]


def _nameable(row: Judged) -> float:
    """With which probability anybody could name the truth (`oracle`)."""
    return float((row.row.get("oracle") or {}).get("nameable", 0.0))


def _named_alone(rows: Sequence[Judged]) -> Iterable[bool]:
    return (row.top1 and row.verdict == "NAMED" for row in rows)


def _pairs(pairs: Sequence[Judged]) -> Rows:
    told = "two effects, both above the limit"
    right, nameable = [row.top1 for row in pairs], [_nameable(row) for row in pairs]
    expected = f"{told}: both named and no other, as a share of what the oracle expects"
    return [
        ratio(expected, right, nameable, Goal(low=0.8)),
        share(f"{told}: both named and no other", right),
        share(f"{told}: both named or in the set", (r.truth_in_set for r in pairs)),
        share(f"{told}: wrong name", _wrong(pairs), Goal(high=0.03)),
    ]


def _calibration(rows: Sequence[Judged]) -> Rows:
    """How often names are true that are said with a probability, where the truth has a name."""
    said = [
        (p, name in row.truth)
        for row in rows
        for name, p in row.row.get("probabilities", {}).items()
        if name in KNOWN
    ]
    return [
        share(
            f"said with {low:g} to {high:g}: true",
            (true for p, true in said if low <= p < high or p == high == 1.0),
            Goal(low, high),
        )
        for low, high in ((0.95, 1.0), (0.8, 0.95), (0.5, 0.8))
    ]


def _aliens(aliens: Sequence[Judged]) -> Rows:
    """Place and table count over those where something is told to be missing without a name."""
    told = "out of library, gap >= 0.5"
    left = [row for row in aliens if row.verdict in ("UNKNOWN", "PART")]
    return [
        share(f"{told}: a known name", _wrong(aliens), Goal(high=0.08)),
        share(f"{told}: UNKNOWN or PART", _said(aliens, ("UNKNOWN", "PART"))),
        share(f"{told}: place right", (r.place_right for r in left), Goal(low=0.9)),
        share(f"{told}: gap shrunk by a tabulated law", map(_shrunk, left), Goal(low=0.75)),
    ]


def _shrunk(row: Judged) -> bool:
    """On readings that the table has not seen."""
    closed = (row.row.get("table") or {}).get("held_out_closed")
    return closed is not None and closed > 0.0


def _parts(parts: Sequence[Judged]) -> Rows:
    told = "a known effect beside one out of the library"
    return [
        share(f"{told}: it is named, as a part", (r.top1 for r in parts)),
        share(f"{told}: wrong name", _wrong(parts)),
    ]


def _mistakes(mistakes: Sequence[Judged]) -> Rows:
    """A unit that leaves stiffness inside the published range is counted by itself."""
    inside = [row for row in mistakes if _unit_factor(row) == INSIDE_THE_RANGE]
    tellable = [row for row in mistakes if _unit_factor(row) != INSIDE_THE_RANGE]
    right = (_pointed_to(row) and not row.named for row in tellable)
    return [
        share("mistake in the files: pointed to, nothing named", right, Goal(low=0.93)),
        share("mistake in the files: something named", (bool(r.named) for r in tellable)),
        share("loads in lbf in taken for N m: pointed to", map(_pointed_to, inside)),
        share("loads in lbf in taken for N m: something named", (bool(r.named) for r in inside)),
    ]


INSIDE_THE_RANGE = 8.85
"""lbf in for N m: published stiffness of one joint spans a factor of 60, so nothing is amiss."""


def _unit_factor(row: Judged) -> float | None:
    """What moments were multiplied by; None where no unit is wrong."""
    wrong = row.row["recipe"]["errors"].get(LOAD_UNIT)
    return None if wrong is None else float(wrong["factor"])


def _pointed_to(row: Judged) -> bool:
    """Refused at the door with a message, or told beside the verdict."""
    told = bool((row.row.get("suspected") or {}).get("errors"))
    return told or row.row["status"] == "refused"


def _unseen(named: Sequence[Judged]) -> Rows:
    told = [(row.row.get("held_out") or {}).get("tests", {}) for row in named]
    closed = [one["closed"] for one in told if one.get("closed") is not None]
    rms = [one["rms"] for one in told if one.get("rms") is not None]
    return [
        median(
            "NAMED, unseen test: share of excess misfit (chi squared), median",
            closed,
            Goal(low=0.95),
        ),
        percentile("NAMED, unseen test: rms residual, 90th percentile", rms, 0.9, Goal(high=1.1)),
    ]


def _parameters(right: Sequence[Judged]) -> Rows:
    found: list[Compared] = [one for row in right for one in compared(row.row)]
    scored = [one for one in found if one.inside is not None]
    inside = [one.inside for one in scored]
    known = [one.inside for one in scored if one.identifiable]
    errors = [one.error for one in found if np.isfinite(one.error)]
    return [
        median("parameters: error over truth, median", errors, Goal(high=0.05)),
        share("parameters: truth in the 95 % interval", inside, Goal(0.92, 0.98)),
        share("the same where both its ends are known", known),
    ]
