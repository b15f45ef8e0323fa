"""The goals, and how far the scored cohorts are from them."""

from collections.abc import Sequence
from typing import Any

from tests.validation.discrepancy.judged import NULLS, Judged
from tests.validation.discrepancy.parameters import Compared, compared
from tests.validation.discrepancy.rates import Goal, median, share

Rows = list[dict[str, Any]]

LARGE, SMALL = 0.5, 0.2


def goals(rows: Sequence[Judged]) -> Rows:
    """One row per goal, and per count that stands beside one."""
    singles = [row for row in rows if row.kind == "single"]
    return [
        *_false_alarms(rows),
        *_singles(singles, "all designs"),
        *_singles([row for row in singles if row.shown], "designs that show it by algebra"),
        *_singles([row for row in singles if row.testable], "designs judged able to show it"),
        *_singles([row for row in singles if row.below_limit is False], "above the limit"),
        *_below(singles),
        *_others(rows),
        *_held_out([row for row in singles if row.top1 and row.at_least(LARGE)]),
        *_parameters([row for row in singles if row.top1 and row.at_least(LARGE)]),
    ]


def _false_alarms(rows: Sequence[Judged]) -> Rows:
    nulls = [row for row in rows if row.kind in NULLS]
    few = Goal(high=0.02)
    found = [
        share("null: NAMED or SET", (r.verdict in ("NAMED", "SET") for r in nulls), few),
        share("null: not NULL", (r.verdict != "NULL" for r in nulls), few),
        share("null: UNKNOWN", (r.verdict == "UNKNOWN" for r in nulls)),
    ]
    for kind in NULLS:
        those = [r for r in nulls if r.kind == kind]
        found.append(share(f"{kind}: NAMED or SET", (r.verdict in ("NAMED", "SET") for r in those)))
        found.append(share(f"{kind}: not NULL", (r.verdict != "NULL" for r in those)))
    return found


def _singles(singles: Sequence[Judged], over: str) -> Rows:
    large = [row for row in singles if row.at_least(LARGE)]
    small = [row for row in singles if row.level == SMALL]
    return [
        share(f"one effect, gap >= 0.5, top-1; {over}", (r.top1 for r in large), Goal(low=0.95)),
        share(
            f"one effect, gap >= 0.5, truth named or in the set; {over}",
            (r.truth_in_set for r in large),
            Goal(low=0.98),
        ),
        share(f"one effect, gap >= 0.5, wrong name; {over}", (r.wrong_name for r in large)),
        share(f"one effect, gap 0.2, top-1; {over}", (r.top1 for r in small), Goal(low=0.8)),
        share(
            f"one effect, gap 0.2, wrong name; {over}",
            (r.wrong_name for r in small),
            Goal(high=0.03),
        ),
    ]


def _below(singles: Sequence[Judged]) -> Rows:
    below = [row for row in singles if row.below_limit]
    tiny = [row for row in singles if row.level <= 0.1]
    return [
        share(
            "one effect below the detection limit: NULL or SET",
            (r.verdict in ("NULL", "SET") for r in below),
            Goal(low=0.95),
        ),
        share(
            "one effect below the detection limit: NULL, SET or top-1",
            (r.verdict in ("NULL", "SET") or r.top1 for r in below),
        ),
        share("one effect below the detection limit: top-1", (r.top1 for r in below)),
        share("one effect below the detection limit: wrong name", (r.wrong_name for r in below)),
        share("one effect, gap 0.1 or less: top-1", (r.top1 for r in tiny)),
        share("one effect, gap 0.1 or less: wrong name", (r.wrong_name for r in tiny)),
    ]


def _others(rows: Sequence[Judged]) -> Rows:
    pairs = [row for row in rows if row.kind == "pair"]
    large = [row for row in pairs if row.testable]
    foreign = [row for row in rows if row.kind == "foreign"]
    mistakes = [row for row in rows if row.kind == "mistake"]
    both = "two effects: both named and no extra"
    return [
        share(both, (r.top1 for r in pairs), Goal(low=0.85)),
        share(f"{both}; designs judged able to show both", (r.top1 for r in large), Goal(low=0.85)),
        share("two effects: both named or in the set", (r.truth_in_set for r in pairs)),
        share("two effects: wrong name", (r.wrong_name for r in pairs)),
        share("out of library: not NAMED", (not r.is_named for r in foreign), Goal(low=0.9)),
        share("out of library: UNKNOWN", (r.verdict == "UNKNOWN" for r in foreign)),
        share("mistake in the files: wrong name", (r.wrong_name for r in mistakes)),
        share("mistake in the files: pointed to", map(_pointed_to, mistakes)),
    ]


def _pointed_to(row: Judged) -> bool:
    return bool((row.row.get("suspected") or {}).get("errors"))


def _held_out(right: Sequence[Judged]) -> Rows:
    """Over effects named right at a gap of 0.5 or more."""
    told = [(row.row.get("held_out") or {}).get("tests", {}) for row in right]
    closed = [one["closed"] for one in told if one.get("closed") is not None]
    rms = [one["rms"] for one in told if one.get("rms") is not None]
    return [
        median("unseen test: share of the gap closed, median", closed, Goal(low=0.9)),
        median("unseen test: rms residual, median", rms, Goal(high=1.1)),
        share("unseen test: rms residual <= 1.1", (value <= 1.1 for value in rms)),
    ]


def _parameters(right: Sequence[Judged]) -> Rows:
    found: list[Compared] = [one for row in right for one in compared(row.row)]
    inside = [one.inside for one in found if one.inside is not None]
    return [
        share("parameters: within 10 % of the truth", (one.close for one in found)),
        median(
            "parameters: error as a share of the truth, median",
            [o.error for o in found],
            Goal(high=0.1),
        ),
        share("parameters: truth in the 95 % interval", inside, Goal(0.9, 0.98)),
    ]
