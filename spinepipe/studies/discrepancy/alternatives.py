"""What a search concludes of other explanations, of what has no name, and of what to do next."""

from collections.abc import Iterator
from typing import Any

import pandas as pd

from spinepipe.report.conclusions import Conclusion, Value
from spinepipe.report.words import listed, plain
from spinepipe.studies.discrepancy.misfits import (
    NOISE,
    WITH_EFFECTS,
    bare,
    change_of_misfit,
    place_of_most,
)
from spinepipe.studies.discrepancy.tables import ADVICE, UNNAMED
from spinepipe.studies.discrepancy.verdict import NOTHING, SOMETHING_ELSE, SURE, Verdict
from spinepipe.studies.discrepancy.verdict import VerdictKind as Ended
from spinepipe.studies.discrepancy.verdict_unnamed import Reason
from spinepipe.studies.discrepancy.words import (
    general,
    in_words,
    name_at,
    readable,
    shape_in_words,
)

_MOST_WORDS_OF_CURVE = 7

USEFUL = ADVICE[:2]
"""Status of runs that would tell something."""


def alternatives(verdict: Verdict) -> Iterator[Conclusion]:
    """The next best explanation: of the named effect whose lead is least, or of a set."""
    if not verdict.probabilities:
        return

    def probable(name: str) -> Value:
        return Value(verdict.probabilities.get(name, 0.0), source="verdict: probabilities")

    with_rivals = [one for one in verdict.effects if one.rivals]
    if with_rivals:
        leads = [min(one.rivals, key=lambda r: r.log_evidence_margin) for one in with_rivals]
        rival, effect = min(
            zip(leads, with_rivals, strict=True), key=lambda both: both[0].log_evidence_margin
        )
        values = {"own": probable(effect.name), "other": probable(rival.name)}
        names = {
            "effect": name_at(effect.name, effect.scope.coordinates),
            "rival": name_at(rival.name, rival.coordinates),
        }
        yield Conclusion("alternatives", "ahead", values, names)
    elif verdict.effects:
        first = verdict.effects[0]
        names = {"effect": name_at(first.name, first.scope.coordinates)}
        yield Conclusion("alternatives", "alone", {"own": probable(first.name)}, names)
    if verdict.verdict is Ended.SET:
        best, *others = sorted(verdict.in_set, key=lambda one: (one.behind is None, one.behind))
        names = {"first": name_at(best.name, best.coordinates)}
        other = next((one for one in others if one.name != best.name), None)
        if other is None:  # the answer has told both
            return
        names["second"] = name_at(other.name, other.coordinates)
        if other.behind is None or best.behind is None:
            yield Conclusion("alternatives", "set_silent", names=names)
        else:
            needed = Value(SURE, source="a name is said from here on")
            values = {"own": probable(best.name), "other": probable(other.name), "needed": needed}
            yield Conclusion("alternatives", "set", values, names)
    if verdict.reason in (Reason.NO_KNOWN_EFFECT, Reason.A_PART_STAYS):
        known = {
            n: p for n, p in verdict.probabilities.items() if n not in (SOMETHING_ELSE, NOTHING)
        }
        if known:
            nearest = max(known, key=lambda name: (known[name], name))
            values = {"own": probable(nearest), "other": probable(SOMETHING_ELSE)}
            yield Conclusion("alternatives", "nearest", values, {"effect": general(nearest)})


def unnamed(verdict: Verdict, where: pd.DataFrame, gap: pd.DataFrame) -> Iterator[Conclusion]:
    """Where and what the part without a name is, and how well it can be described without one."""
    told = verdict.part or verdict.unknown
    if told is not None and verdict.reason not in (Reason.NO_BASE, Reason.DATA_ERRORS):
        motion, joint, left = place_of_most(where, gap, WITH_EFFECTS)
        if left is not None:
            sizes = {"value": left, "left": bare(left)}
            rule = "remains" if verdict.effects else "unexplained"
            yield Conclusion(rule, "place", sizes, {"place": motion, "joint": joint})
        shape = (
            verdict.part.left_shape if verdict.part else verdict.unknown and verdict.unknown.shape
        )
        names = {"shape": shape_in_words(shape or "")}
        yield Conclusion("shape", "seen" if shape else "unseen", names=names)
    if (table := verdict.tabulated) is not None:
        values = {"after": Value(table.gap, NOISE, source="verdict: tabulated")}
        laws = readable(table.place).split("; ")
        curve = in_words([laws], _MOST_WORDS_OF_CURVE) or f"{len(laws)} motions"
        if (closed := table.held_out_closed) is not None:
            how = "verdict: tabulated, held_out_closed"
            values["closed"] = Value(change_of_misfit(closed), "%", source=how)
        yield Conclusion(
            "curve", "left_out" if "closed" in values else "fit", values, {"curve": curve}
        )


def next_test(verdict: Verdict, next_tests: pd.DataFrame) -> Iterator[Conclusion]:
    """The run that is advised first."""
    best = advised(verdict, next_tests)
    if best is None:
        if len(next_tests):
            yield Conclusion("next", "none")
        return
    subject, how = best["effect_or_pair"], "next_tests: advised"
    values = {
        "gain": Value(float(best["gain_in_log_evidence"]), source=how),
        "cycles": Value(int(best["cycles"]), source=how),
    }
    names = {
        "subject": listed(map(general, subject.split(" or "))),
        "run": run_in_words(best["test"]),
    }
    yield Conclusion("next", _asks(subject), values, names)


def advised(verdict: Verdict, next_tests: pd.DataFrame) -> dict[str, Any] | None:
    """For a set the run that distinguishes its names, else what shows the unexplained."""
    if next_tests.empty:
        return None
    runs = next_tests[next_tests["status"] == USEFUL[0]]
    order = ["unnamed", "separate"]
    if verdict.verdict is Ended.SET:
        order = ["separate", "unnamed"]
    rows = [{str(name): cell for name, cell in row.items()} for row in runs.to_dict("records")]
    return min(rows, key=lambda row: order.index(_asks(row["effect_or_pair"])), default=None)


def _asks(subject: str) -> str:
    return "unnamed" if subject.startswith(UNNAMED) else "separate"


def run_in_words(run: str) -> str:
    """``flexion–extension, loads 1.5 times as large``."""
    test, colon, what = run.partition(": ")
    return f"{plain(test)}{colon.replace(':', ',')}{what}"
