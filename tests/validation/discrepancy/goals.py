"""The goals of the search, and how far the scored cohorts are from them."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from tests.generators.hidden import LOAD_UNIT
from tests.validation.discrepancy.judged import NULLS, Judged
from tests.validation.discrepancy.parameters import Compared, compared
from tests.validation.discrepancy.rates import Goal, median, percentile, share

Rows = list[dict[str, Any]]


def goals(rows: Sequence[Judged]) -> Rows:
    """One row per goal, and per count that stands beside one."""
    singles = [row for row in rows if row.kind in ("one", "small")]
    large = [row for row in singles if row.band == ">= 0.5" and row.above]
    small = [row for row in singles if row.band == "0.2-0.5" and row.above]
    below = [row for row in singles if row.shown and row.below_limit]
    return [
        *_false_alarms(rows),
        *_large(large),
        *_own_name([row for row in large if row.has_own_name], "gap >= 0.5"),
        *_small(small),
        *_own_name([row for row in small if row.has_own_name], "gap 0.2-0.5"),
        share("below the limit: wrong name", _wrong(below), Goal(high=0.02)),
        share("below the limit: truth named", (r.top1 for r in below)),
        *_pairs([row for row in rows if row.kind == "two" and row.above]),
        *_aliens([row for row in rows if row.kind == "alien" and row.band == ">= 0.5"]),
        *_parts([row for row in rows if row.kind == "part"]),
        *_mistakes([row for row in rows if row.kind == "mistake"]),
        *_unseen([row for row in singles if row.verdict == "NAMED"]),
        *_parameters([row for row in large if row.top1]),
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
        share("null and dirty null: NAMED, PART or SET", _said(nulls, naming), Goal(high=0.02)),
        share("null and dirty null: not NULL", (r.verdict != "NULL" for r in nulls)),
    ]
    for kind in NULLS:
        those = [r for r in nulls if r.kind == kind]
        found.append(share(f"{kind}: NAMED, PART or SET", _said(those, naming)))
    return found


def _said(rows: Sequence[Judged], verdicts: Sequence[str]) -> Iterable[bool]:
    return (row.verdict in verdicts for row in rows)


def _large(large: Sequence[Judged]) -> Rows:
    found = []
    for over in ("same formula", "other formula", "all"):
        those = [r for r in large if over == "all" or f"{r.formula} formula" == over]
        told = f"one effect, gap >= 0.5, above its limit; {over}"
        found += [
            share(f"{told}: top-1, NAMED or PART", (r.top1 for r in those), Goal(low=0.95)),
            share(f"{told}: top-1, NAMED alone", _named_alone(those)),
            share(f"{told}: truth in set", (r.truth_in_set for r in those), Goal(low=0.99)),
            share(f"{told}: wrong name", _wrong(those), Goal(high=0.02)),
            share(f"{told}: wrong name, of PART alone", _wrong(_parts_of(those))),
        ]
    return found


def _named_alone(rows: Sequence[Judged]) -> Iterable[bool]:
    return (row.top1 and row.verdict == "NAMED" for row in rows)


def _parts_of(rows: Sequence[Judged]) -> list[Judged]:
    return [row for row in rows if row.verdict == "PART"]


def _own_name(rows: Sequence[Judged], gap: str) -> Rows:
    """Where the tests, to first order, tell the effect from every other one."""
    told = f"one effect, {gap}, told from all others by the tests"
    return [
        share(f"{told}: top-1, NAMED or PART", (r.top1 for r in rows)),
        share(f"{told}: wrong name", _wrong(rows)),
    ]


def _small(small: Sequence[Judged]) -> Rows:
    told = "one effect, gap 0.2-0.5, above its limit"
    return [
        share(f"{told}: top-1, NAMED or PART", (r.top1 for r in small), Goal(low=0.8)),
        share(f"{told}: top-1, NAMED alone", _named_alone(small)),
        share(f"{told}: truth in set", (r.truth_in_set for r in small)),
        share(f"{told}: wrong name", _wrong(small), Goal(high=0.03)),
    ]


def _pairs(pairs: Sequence[Judged]) -> Rows:
    told = "two effects, both above the limit"
    return [
        share(f"{told}: both named and no other", (r.top1 for r in pairs), Goal(low=0.85)),
        share(f"{told}: the same, NAMED alone", _named_alone(pairs)),
        share(f"{told}: both named or in the set", (r.truth_in_set for r in pairs)),
        share(f"{told}: wrong name", _wrong(pairs), Goal(high=0.03)),
    ]


def _aliens(aliens: Sequence[Judged]) -> Rows:
    """Place and table count over those where something is told to be missing without a name."""
    told = "out of library, gap >= 0.5"
    left = [row for row in aliens if row.verdict in ("UNKNOWN", "PART")]
    return [
        share(f"{told}: no wrong name", (not r.wrong_name for r in aliens), Goal(low=0.93)),
        share(f"{told}: UNKNOWN or PART", _said(aliens, ("UNKNOWN", "PART"))),
        share(f"{told}: place right", (r.place_right for r in left), Goal(low=0.85)),
        share(f"{told}: gap shrunk by a tabulated law", map(_shrunk, left), Goal(low=0.7)),
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
        share("mistake in the files: pointed to, nothing named", right, Goal(low=0.95)),
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
