"""Held-out proof: base, model with effects and surrogate on readings left out of their fits.

A fold is scored by what predictions miss of the readings left out, in noise SD; margins between
models are summed over folds. By default folds are fitted in the linear models around the full fits,
which costs next to nothing.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array
from spinepipe.studies.discrepancy.proof.fold_linear import (
    FoldPrediction,
)
from spinepipe.studies.discrepancy.proof.fold_models import (
    Both,
    FoldModels,
    NoFold,
    Predictions,
)
from spinepipe.studies.discrepancy.proof.folds import (
    STEPS,
    ChosenSteps,
    Flags,
    Fold,
    Masks,
    folds_by_specimen,
    folds_by_test,
    step_fold,
)
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.gaps import Gap
from spinepipe.studies.discrepancy.search.search_state import SearchResult
from spinepipe.studies.discrepancy.store import PieceRunner, at_once

SAME = 1e-6
"""Share of chi2 by which predictions that hang on nothing that was scored may differ."""

SCORED, NOT_DETERMINED, NO_FIT = "scored", "not determined", "no fit"

CLEARLY = 2.5
"""SDs of noise by which an unseen test or specimen must be worse to count as worse: 1 in 160."""


@dataclass(frozen=True)
class HeldOutMotion:
    """A specimen's motion, per test (T, J, 6) m and rad; NaN where nothing was held out.

    Attributes
    ----------
    fold : number of the fold, -1 for none. base, with_effects : of the models alone.
    """

    fold: tuple[NDArray[np.int64], ...]
    base: tuple[Array, ...]
    with_effects: tuple[Array, ...]


@dataclass(frozen=True)
class FoldRow:
    """A fold: how large the discrepancy of its readings is, in noise SD.

    Attributes
    ----------
    kind : test, specimen or steps. readings : scored. left_out : scored or not.
    base, with_effects : None where nothing was scored; the same where no effect is named.
    surrogate : None where there is none. status : scored, not determined or no fit.
    expected : chi2 of a model that is right: noise, and nuisances that the training left open.
    moved : chi2 of the difference between what base and model with effects predict.
    """

    name: str
    kind: str
    readings: int
    left_out: int
    base: Gap | None
    with_effects: Gap | None
    surrogate: Gap | None
    expected: float
    status: str
    message: str
    moved: float = 0.0

    @property
    def worse(self) -> bool:
        """Whether the effects predict clearly worse than the base: by more than noise makes.

        With noise n and predictions that differ by d, chi2 differs by 2 n d and what is no noise.
        """
        if self.base is None or self.with_effects is None:
            return False
        # n'd has variance d'd times that of a reading, which open nuisances make larger than one
        sd = 2.0 * float(np.sqrt(self.moved * max(self.expected / self.readings, 1.0)))
        return self.base.chi2 - self.with_effects.chi2 < -CLEARLY * sd

    @property
    def closed(self) -> float | None:
        """Share of the base's excess misfit (chi2) that the effects take away; None where noise
        hides the excess."""
        return closed_share(self.base, self.with_effects, self.expected)


@dataclass(frozen=True)
class HeldOut:
    """All folds, and what they say together.

    Attributes
    ----------
    motion : by specimen. base, with_effects : over all scored readings; None of none.
    expected : chi2 of a model that is right: noise, and nuisances that training left open.
    over_base : chi2 by which the model with effects is better; None where nothing was scored.
    """

    folds: tuple[FoldRow, ...]
    motion: Mapping[str, HeldOutMotion]
    base: Gap | None
    with_effects: Gap | None
    expected: float
    over_base: float | None

    @property
    def closed(self) -> float | None:
        """Share of the base's excess misfit (chi2) that the effects take away; None where noise
        hides the excess."""
        return closed_share(self.base, self.with_effects, self.expected)

    def by_kind(self) -> Mapping[str, "HeldOut"]:
        """Folds of each kind that were scored, together: their training knows other things."""
        scored = [row for row in self.folds if row.base is not None]
        kinds = dict.fromkeys(row.kind for row in scored)
        return {kind: pool_folds([row for row in scored if row.kind == kind], {}) for kind in kinds}

    def of_base(self) -> "HeldOut":
        """The base in the place of the model with effects."""
        folds = tuple(replace(row, with_effects=row.base) for row in self.folds)
        motion = {name: replace(one, with_effects=one.base) for name, one in self.motion.items()}
        return replace(self, folds=folds, motion=motion, with_effects=self.base)

    @property
    def tells(self) -> bool:
        """Whether any scored reading is predicted otherwise with the effects than without."""
        if self.over_base is None:
            return False
        return abs(self.over_base) > (SAME * self.base.chi2 if self.base else 0.0)

    @property
    def beats_base(self) -> bool:
        """Whether the effects predict better than the base alone."""
        return self.over_base is not None and self.over_base > 0.0


@dataclass(frozen=True)
class Asked:
    """What is held out. ``refit`` : fit each fold by the full simulator, not to first order."""

    tests: bool = True
    specimens: bool = True
    refit: bool = False


def held_out(found: SearchResult, asked: Asked, run: PieceRunner) -> HeldOut:
    """Each fold's readings as predicted by fits without them."""
    if asked.refit:  # each fit is kept
        return _proof(FoldModels(found.base, found.final, True, run), asked)
    return run(to_first_order, found.base, found.final, asked)


def to_first_order(base: BaselineFit, final: BaselineFit, asked: Asked) -> HeldOut:
    """The same by models that are straight about the fit to all readings."""
    return _proof(FoldModels(base, final, False, at_once), asked)


def proof_between(before: BaselineFit, after: BaselineFit) -> HeldOut:
    """Two fits on each test and specimen left out; the second one has more terms."""
    return _proof(FoldModels(before, after, False, at_once, with_surrogate=False), Asked())


def _proof(models: FoldModels, asked: Asked) -> HeldOut:
    """Each fold's readings as these models predict them."""
    readings, tests = models.grounds[0].readings, models.grounds[0].tests
    motion = {}
    for name, one in readings.items():
        shapes = [test.count.shape for test in one.tests]
        base, final = (tuple(np.full(shape, np.nan) for shape in shapes) for _ in range(2))
        motion[name] = HeldOutMotion(tuple(np.full(shape, -1) for shape in shapes), base, final)
    folds: list[Fold] = []
    if asked.tests:
        folds += folds_by_test(readings, tests)
    if asked.specimens:
        folds += folds_by_specimen(readings)
    rows = _rows(models, folds, 0, motion)
    if asked.tests and len(readings) == 1 and not pool_folds(rows, motion).tells:
        rows += _rows(models, [step_fold(readings)], len(rows), motion)
    return pool_folds(rows, motion)


def _rows(
    models: FoldModels, folds: Sequence[Fold], first: int, motion: Mapping[str, HeldOutMotion]
) -> list[FoldRow]:
    predicted = iter(models.predict([part for fold in folds for part in fold.parts]))
    return [
        _row(models, fold, number, list(islice(predicted, len(fold.parts))), motion)
        for number, fold in enumerate(folds, first)
    ]


def _row(
    models: FoldModels,
    fold: Fold,
    number: int,
    predicted: Sequence[Both],
    motion: Mapping[str, HeldOutMotion],
) -> FoldRow:
    count = sum(
        int(test.sum())
        for part in fold.parts
        for tests in models.left_out(part).values()
        for test in tests
    )
    try:
        pairs = zip(fold.parts, predicted, strict=True)
        parts = [models.predictions(fold, part, both) for part, both in pairs]
    except NoFold as trouble:
        return FoldRow(fold.name, fold.kind, 0, count, None, None, None, 0.0, NO_FIT, str(trouble))
    for part in parts:
        fill(motion, number, part)
    chosen = models.chosen
    base = scored_gap(chosen, [(part.scored, part.base) for part in parts])
    if not base.readings:
        why = "the other tests do not determine what these readings would be"
        return FoldRow(fold.name, fold.kind, 0, count, None, None, None, 0.0, NOT_DETERMINED, why)
    final = scored_gap(chosen, [(part.scored, part.with_effects) for part in parts])
    by_surrogate = [(p.scored, p.surrogate) for p in parts if p.surrogate is not None]
    surrogate = scored_gap(chosen, by_surrogate) if by_surrogate else None
    said = [models.why_none] if models.why_none else []
    if base.readings < count:
        said.append(f"the other tests determine {base.readings} of {count} readings")
    if fold.kind == STEPS:
        said.append("one specimen and no test that others determine: halves of the load steps")
    return FoldRow(
        fold.name,
        fold.kind,
        base.readings,
        count,
        base,
        final,
        surrogate,
        base.readings + sum(part.left_open for part in parts),
        SCORED,
        "; ".join(said),
        sum(_moved(chosen, part) for part in parts),
    )


def pool_folds(rows: Sequence[FoldRow], motion: Mapping[str, HeldOutMotion]) -> HeldOut:
    """All folds pooled."""
    base = [row.base for row in rows if row.base is not None]
    final = [row.with_effects for row in rows if row.with_effects is not None]
    drops = [a.chi2 - b.chi2 for a, b in zip(base, final, strict=True)]
    return HeldOut(
        tuple(rows),
        motion,
        pool_gaps(base),
        pool_gaps(final),
        sum(row.expected for row in rows),
        float(np.sum(drops)) if drops else None,
    )


def scored_gap(chosen: ChosenSteps, parts: Sequence[tuple[Masks, FoldPrediction]]) -> Gap:
    """The gap over the scored readings of all parts, noise whitened within each test."""
    white = [
        _missed(chosen, name, test, there, predicted)
        for scored, predicted in parts
        for name, tests in scored.items()
        for test, there in enumerate(tests)
        if there.any()
    ]
    residual = np.concatenate([np.zeros(0), *white])
    return Gap(float(residual @ residual), float(len(residual)), len(residual))


def _moved(chosen: ChosenSteps, part: Predictions) -> float:
    """chi2 of the difference between base and model with effects, over the scored readings."""
    total = 0.0
    for name, tests in part.scored.items():
        for test, there in enumerate(tests):
            if there.any():
                models = (part.base, part.with_effects)
                base, final = (_missed(chosen, name, test, there, one) for one in models)
                total += float(np.sum((base - final) ** 2))
    return total


def _missed(
    chosen: ChosenSteps, specimen: str, test: int, there: Flags, predicted: FoldPrediction
) -> Array:
    """(N,) residuals with SD one and independent where only noise is left."""
    reading = predicted.motion[specimen][test] + predicted.nuisances[specimen][test]
    errors = chosen.mean(specimen, test) - reading
    return chosen.whitening(specimen, test, there).noise_only([errors])


def pool_gaps(gaps: Sequence[Gap]) -> Gap | None:
    """All together; None of none."""
    if not gaps:
        return None
    return Gap(
        sum(gap.chi2 for gap in gaps),
        sum(gap.dof for gap in gaps),
        sum(gap.readings for gap in gaps),
    )


def fill(sheets: Mapping[str, HeldOutMotion], number: int, found: Predictions) -> None:
    """Enter a part's scored readings, where no earlier fold has."""
    for name, tests in found.scored.items():
        sheet = sheets[name]
        columns = (
            (sheet.base, found.base.motion[name]),
            (sheet.with_effects, found.with_effects.motion[name]),
        )
        for test, there in enumerate(tests):
            new = there & (sheet.fold[test] < 0)
            sheet.fold[test][new] = number
            for column, values in columns:
                column[test][new] = values[test][new]


def closed_share(base: Gap | None, new: Gap | None, expected: float) -> float | None:
    """Share of the excess misfit: (chi2 of base - chi2 of new) / (chi2 of base - expected), at most
    1. It is no share of the gap, which is its root.

    None where noise, or nuisances that the training left open, may be all that the base misses.
    """
    if base is None or new is None or base.interval[0] <= 0.0 or base.chi2 <= expected:
        return None
    return min((base.chi2 - new.chi2) / (base.chi2 - expected), 1.0)
