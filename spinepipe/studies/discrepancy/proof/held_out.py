"""Held-out confirmation: base, model with effects and surrogate on readings no fit has seen.

By default folds are fitted in the linear models around the full fits, which costs next to nothing.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from spinepipe.discrepancy.found import Found
from spinepipe.discrepancy.gaps import Gap
from spinepipe.discrepancy.proof.fold_models import FoldModels, Predictions
from spinepipe.discrepancy.proof.fold_refit import NoFold
from spinepipe.discrepancy.proof.fold_scores import pooled, scored_gap
from spinepipe.discrepancy.proof.folds import (
    STEPS,
    Fold,
    folds_by_specimen,
    folds_by_test,
    step_fold,
)
from spinepipe.discrepancy.proof.held_out_motion import HeldOutMotion, fill, nothing_held_out
from spinepipe.discrepancy.proof.held_out_rows import (
    NO_FIT,
    NOT_DETERMINED,
    SCORED,
    FoldRow,
    HeldOut,
    Margin,
)
from spinepipe.discrepancy.tasks import Run

FEWEST_FOLDS = 3
"""Folds from which a margin has a standard error."""


@dataclass(frozen=True)
class Asked:
    """What is held out. ``refit`` : fit each fold by the full simulator, not to first order."""

    tests: bool = True
    specimens: bool = True
    refit: bool = False


def held_out(found: Found, asked: Asked, run: Run) -> HeldOut:
    """Each fold's readings as predicted by fits without them."""
    readings, tests = found.base.readings, found.base.tests
    models = FoldModels(found.base, found.final, asked.refit, run)
    motion = nothing_held_out(readings)
    folds: list[Fold] = []
    if asked.tests:
        folds += folds_by_test(readings, tests)
    if asked.specimens:
        folds += folds_by_specimen(readings)
    rows = [_row(models, fold, number, motion) for number, fold in enumerate(folds)]
    if asked.tests and len(readings) == 1 and not together(rows, motion).tells:
        rows.append(_row(models, step_fold(readings), len(rows), motion))
    return together(rows, motion)


def _row(
    models: FoldModels, fold: Fold, number: int, motion: Mapping[str, HeldOutMotion]
) -> FoldRow:
    count = sum(
        int(test.sum())
        for part in fold.parts
        for tests in models.left_out(part).values()
        for test in tests
    )
    try:
        parts = [models.predictions(fold, part) for part in fold.parts]
    except NoFold as trouble:
        return FoldRow(fold.name, fold.kind, 0, count, None, None, None, 0.0, NO_FIT, str(trouble))
    for part in parts:
        fill(motion, number, part)
    return _scored_row(models, fold, parts, count)


def _scored_row(
    models: FoldModels, fold: Fold, parts: Sequence[Predictions], left_out: int
) -> FoldRow:
    chosen = models.chosen
    base = scored_gap(chosen, [(part.scored, part.base) for part in parts])
    if not base.readings:
        why = "the other tests do not determine what these readings would be"
        return FoldRow(
            fold.name, fold.kind, 0, left_out, None, None, None, 0.0, NOT_DETERMINED, why
        )
    final = scored_gap(chosen, [(part.scored, part.with_effects) for part in parts])
    by_surrogate = [(p.scored, p.surrogate) for p in parts if p.surrogate is not None]
    surrogate = scored_gap(chosen, by_surrogate) if by_surrogate else None
    said = [models.why_none] if models.why_none else []
    if base.readings < left_out:
        said.append(f"the other tests determine {base.readings} of {left_out} readings")
    if fold.kind == STEPS:
        said.append("one specimen and no test that others determine: halves of the load steps")
    return FoldRow(
        fold.name,
        fold.kind,
        base.readings,
        left_out,
        base,
        final,
        surrogate,
        base.readings + sum(part.left_open for part in parts),
        SCORED,
        "; ".join(said),
    )


def together(rows: Sequence[FoldRow], motion: Mapping[str, HeldOutMotion]) -> HeldOut:
    """All folds pooled."""
    base = [row.base for row in rows if row.base is not None]
    final = [row.with_effects for row in rows if row.with_effects is not None]
    surrogate = [row.surrogate for row in rows if row.surrogate is not None]
    return HeldOut(
        tuple(rows),
        motion,
        pooled(base),
        pooled(final),
        pooled(surrogate),
        sum(row.expected for row in rows),
        _margin(base, final),
        _margin(surrogate, final) if surrogate else None,
    )


def _margin(other: Sequence[Gap], ours: Sequence[Gap]) -> Margin | None:
    """Sum of the folds' differences; its SE by how folds differ."""
    drops = np.array([a.chi2 - b.chi2 for a, b in zip(other, ours, strict=True)])
    if not len(drops):
        return None
    enough = len(drops) >= FEWEST_FOLDS
    se = float(np.sqrt(len(drops)) * np.std(drops, ddof=1)) if enough else None
    return Margin(float(drops.sum()), se)


__all__ = ["Asked", "FoldRow", "HeldOut", "Margin", "held_out", "together"]
