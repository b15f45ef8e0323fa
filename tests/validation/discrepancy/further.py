"""What is asked besides the verdict: held-out motion by kind, what the design could tell, the rest.

A question that fails is a row with a message; it does not take the verdict with it.
"""

from collections.abc import Callable, Sequence
from functools import wraps
from typing import Any

import numpy as np

from spinepipe.studies.discrepancy.design.signatures import cohort_signatures
from spinepipe.studies.discrepancy.design.testable import LEAD, judgements
from spinepipe.studies.discrepancy.proof.held_out import SPECIMEN, TEST, FoldRow, HeldOut
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.gaps import places, residual_frame, worst
from spinepipe.studies.discrepancy.search.investigation import Investigation
from spinepipe.studies.discrepancy.search.residual_model import model_residual
from spinepipe.studies.discrepancy.search.search_state import Rules, SearchResult
from spinepipe.studies.discrepancy.store import at_once
from spinepipe.studies.discrepancy.verdict import VerdictKind
from spinepipe.studies.discrepancy.verdict_unnamed import Reason

Told = dict[str, Any]

CLEAR = 2.0
"""SDs of chi2 by which the base must miss held-out readings for a share of it to mean anything."""

PLACES_KEPT = 3


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
def held_out_told(proof: HeldOut) -> Told:
    """Of tests and specimens left out: share of the excess misfit (chi2) taken away, and rms."""
    return {
        "tests": _of_folds([row for row in proof.folds if row.kind == TEST]),
        "specimens": _of_folds([row for row in proof.folds if row.kind == SPECIMEN]),
        "all_closed": proof.closed,
        "beats_base": proof.beats_base,
    }


def _of_folds(rows: Sequence[FoldRow]) -> Told:
    """Sums over folds; as many readings are the chi2 of a model that is right."""
    pairs = [(row.base, row.with_effects, row) for row in rows]
    scored = [(base, new, row) for base, new, row in pairs if base is not None and new is not None]
    base = sum(one.chi2 for one, _, _ in scored)
    new = sum(one.chi2 for _, one, _ in scored)
    expected = sum(row.readings for *_, row in scored)
    clear = base - expected > CLEAR * np.sqrt(2.0 * expected) if expected else False
    return {
        "folds": len(scored),
        "closed": min((base - new) / (base - expected), 1.0) if clear else None,
        "base_rms": np.sqrt(base / expected) if expected else None,
        "rms": np.sqrt(new / expected) if expected else None,
        "readings": expected,
        "worse": [row.name for *_, row in scored if row.worse],
    }


@_told
def testable_told(found: SearchResult, rules: Rules, names: Sequence[str]) -> Told:
    """Of each true effect: whether the tests could show it, and the smallest gap that would.

    That gap is in SD of one reading, as the truth's is: repeats are averaged in a search.
    """
    mine = [one for one in rules.trials if one.effect in names]
    if not mine:
        return {}
    grounds = found.base
    judged = judgements(cohort_signatures(grounds, mine), rules.needed + LEAD)
    repeats = repeats_of(grounds)
    return {
        one.effect: {
            "testable": one.testable,
            "why": one.why,
            "least_gap": one.detectable.gap / np.sqrt(repeats) if one.detectable else None,
        }
        for one in judged
    }


def repeats_of(grounds: BaselineFit) -> float:
    """Cycles that a mean reading is of: its SD is smaller by the root of that."""
    counts = [test.count[test.count > 0] for one in grounds.readings.values() for test in one.tests]
    return float(np.mean(np.concatenate(counts)))


@_told
def places_told(ended: Investigation, joints: Sequence[str]) -> Told:
    """Where most is left by the model that the verdict stands for, as the verdict file says it."""
    if ended.ended.verdict not in (VerdictKind.UNKNOWN, VerdictKind.PART):
        return {}
    told = ended.for_verdict().found.final
    left = worst(places(residual_frame(told, told.fit, joints)), PLACES_KEPT)
    return {"worst": [dict(place.at) | {"gap": place.gap.gap} for place in left]}


@_told
def table_told(ended: Investigation) -> Told:
    """Of UNKNOWN and PART: what a tabulated law closes of held-out readings."""
    said = ended.ended
    if (
        said.verdict not in (VerdictKind.UNKNOWN, VerdictKind.PART)
        or said.reason is Reason.DATA_ERRORS
    ):
        return {}
    table = model_residual(ended.found, at_once).table
    return {
        "place": table.place if table else None,
        "gap": table.gap if table else None,
        "held_out_closed": table.held_out_closed if table else None,
    }
