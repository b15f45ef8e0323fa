"""What is asked besides the verdict: held-out motion by kind, what the design could tell.

A question that fails is a row with a message; it does not take the verdict with it.
"""

from collections.abc import Callable, Sequence
from functools import wraps
from typing import Any

import numpy as np

from spinepipe.studies.discrepancy.design.seen import seen_in
from spinepipe.studies.discrepancy.design.testable import judgements
from spinepipe.studies.discrepancy.proof.held_out import Asked, held_out
from spinepipe.studies.discrepancy.search.inquiry import Found, Rules
from spinepipe.studies.discrepancy.store import at_once

Told = dict[str, Any]


def _told(ask: Callable[..., Told]) -> Callable[..., Told]:
    """The answer, or why there is none."""

    @wraps(ask)
    def answer(*args: Any) -> Told:
        try:
            return ask(*args)
        except Exception as trouble:
            return {"message": f"{type(trouble).__name__}: {trouble}"}

    return answer


@_told
def held_out_told(found: Found) -> Told:
    """Of tests and of specimens that were left out: share of the gap closed, and rms residual."""
    told: Told = {}
    for kind in ("tests", "specimens"):
        asked = Asked(tests=kind == "tests", specimens=kind == "specimens")
        said = held_out(found, asked, at_once)
        told[kind] = {
            "closed": said.closed,
            "base_rms": said.base.rms if said.base else None,
            "rms": said.with_effects.rms if said.with_effects else None,
            "beats_base": said.beats_base,
            "beats_surrogate": said.over_surrogate.beats if said.over_surrogate else None,
        }
    return told


@_told
def testable_told(found: Found, rules: Rules, names: Sequence[str]) -> Told:
    """Of each true effect: whether the tests could show it, and the smallest gap that would.

    That gap is in SD of one reading, as the truth's is: repeats are averaged in a search.
    """
    mine = [one for one in rules.trials if one.effect in names]
    if not mine:
        return {}
    grounds = found.base
    of = {name: seen_in(grounds, name, mine) for name in grounds.readings}
    joints = next(iter(grounds.fit.models.values())).n_joints
    needed = found.stages[0].screen.threshold + rules.margin
    judged = judgements(mine, of, joints, grounds.tests, needed, rules.seed)
    repeats = _repeats(found)
    return {
        one.effect: {
            "testable": one.testable,
            "why": one.why,
            "least_gap": one.detectable.gap / np.sqrt(repeats) if one.detectable else None,
        }
        for one in judged
    }


def _repeats(found: Found) -> float:
    counts = [
        test.count[test.count > 0] for one in found.base.readings.values() for test in one.tests
    ]
    return float(np.mean(np.concatenate(counts)))
