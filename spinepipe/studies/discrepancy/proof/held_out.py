"""Held-out proof: whether what is named predicts readings that were left out of its fit.

One test after the other is left out in all specimens. Then one specimen after the other is, but for
every second load step, as its stiffness is its own; then the halves change places. Of a single
specimen these halves tell of load steps alone. Noise-whitened readings are independent, so that any
of them may be left out.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from spinepipe.studies.discrepancy.proof.linear_model import (
    LinearModel,
    Rows,
    Trained,
    nuisance_size,
)
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.gaps import Gap

TEST, SPECIMEN, STEPS = "test", "specimen", "steps"

SAME = 1e-6
"""Share of chi2 by which predictions that hang on nothing that was scored may differ."""

CLEARLY = 2.5
"""SDs of noise by which unseen readings must be predicted worse to count as worse: 1 in 160."""


@dataclass(frozen=True)
class FoldRow:
    """A fold: how large the discrepancy of its readings is, in noise SD.

    Attributes
    ----------
    kind : test, specimen or steps.
    left_out : readings, of which the training tells ``base.readings``.
    base, with_effects : None where it tells none; the same where no effect is named.
    moved : chi2 of the difference between what the two predict.
    """

    name: str
    kind: str
    left_out: int
    base: Gap | None
    with_effects: Gap | None
    moved: float = 0.0

    @property
    def readings(self) -> int:
        """How many are scored."""
        return self.base.readings if self.base else 0

    @property
    def message(self) -> str:
        """What of it is not scored; empty where all is."""
        if not self.readings:
            return "the rest does not determine what these readings would be"
        if self.readings < self.left_out:
            return f"the rest determines {self.readings} of {self.left_out} readings"
        return ""

    @property
    def worse(self) -> bool:
        """Whether the effects predict clearly worse than the base: by more than noise makes.

        With noise n and predictions that differ by d, chi2 differs by 2 n d and what is no noise.
        """
        if self.base is None or self.with_effects is None:
            return False
        return self.with_effects.chi2 - self.base.chi2 > 2.0 * CLEARLY * float(np.sqrt(self.moved))

    @property
    def closed(self) -> float | None:
        """As of all folds, of this one."""
        return HeldOut((self,)).closed


@dataclass(frozen=True)
class HeldOut:
    """All folds, and what they say together."""

    folds: tuple[FoldRow, ...]

    @property
    def base(self) -> Gap | None:
        """Of the base model, over all scored readings; None of none."""
        return _pooled([row.base for row in self.folds])

    @property
    def with_effects(self) -> Gap | None:
        """Of the model with effects, over all scored readings; None of none."""
        return _pooled([row.with_effects for row in self.folds])

    @property
    def over_base(self) -> float | None:
        """chi2 by which the model with effects is better; None where nothing was scored."""
        base, effects = self.base, self.with_effects
        return None if base is None or effects is None else base.chi2 - effects.chi2

    @property
    def closed(self) -> float | None:
        """Share of the excess misfit, chi2 of the base less what noise makes, that effects take
        away; at most 1, and None where noise may be all of it. It is no share of the gap, which is
        its root.
        """
        base, over = self.base, self.over_base
        if base is None or over is None or base.interval[0] <= 0.0:
            return None
        return min(over / base.excess, 1.0)

    def by_kind(self) -> Mapping[str, "HeldOut"]:
        """Scored folds of each kind together: their training knows other things."""
        scored = [row for row in self.folds if row.readings]
        kinds = dict.fromkeys(row.kind for row in scored)
        return {kind: HeldOut(tuple(r for r in scored if r.kind == kind)) for kind in kinds}

    def of_base(self) -> "HeldOut":
        """The base in the place of the model with effects."""
        return HeldOut(tuple(replace(row, with_effects=row.base, moved=0.0) for row in self.folds))

    @property
    def tells(self) -> bool:
        """Whether any scored reading is predicted otherwise with the effects than without."""
        base, over = self.base, self.over_base
        return base is not None and over is not None and abs(over) > SAME * base.chi2

    @property
    def beats_base(self) -> bool:
        """Whether the effects predict better than the base alone."""
        return self.over_base is not None and self.over_base > 0.0


def held_out(base: BaselineFit, final: BaselineFit) -> HeldOut:
    """Each fold's readings as predicted by both models from the others."""
    both = (base, final) if final.fit.hypothesis.supposed else (base,)
    size = nuisance_size(final)
    models = [LinearModel.near(at, size) for at in both]
    tests, steps = {}, {}
    for name, plain in base.plain.items():
        cases = base.readings[name].cases
        rows = [np.nonzero(used)[0] for used in plain.used]  # load step of each whitened reading
        names = [
            np.full(len(of), base.tests.index(c.test)) for of, c in zip(rows, cases, strict=True)
        ]
        tests[name], steps[name] = np.concatenate(names), np.concatenate(rows) % 2
    folds: list[FoldRow] = []
    if len(base.tests) > 1:
        for number, test in enumerate(base.tests):
            out = {name: of == number for name, of in tests.items()}
            folds.append(_fold(test, TEST, models, [out]))
    for one in steps:
        halves = [
            {name: (of == half) & (name == one) for name, of in steps.items()} for half in (0, 1)
        ]
        name, kind = (one, SPECIMEN) if len(steps) > 1 else ("every second load step", STEPS)
        folds.append(_fold(name, kind, models, halves))
    return HeldOut(tuple(folds))


def _fold(name: str, kind: str, models: Sequence[LinearModel], left_out: Sequence[Rows]) -> FoldRow:
    """A fold in one part or several; ``models`` : the base's and that with effects, if any are."""
    chi2, readings, moved, count = np.zeros(2), 0, 0.0, 0
    for out in left_out:
        trained = [Trained(one, {n: ~rows for n, rows in out.items()}) for one in models]
        for specimen, rows in out.items():
            if not rows.any():
                continue
            missed = [one.missed(specimen, rows) for one in trained]
            # by the model with effects, which has all unknowns of the base and more
            told, number = trained[-1].told(specimen, rows, missed[0], missed[-1])
            chi2 += [float(one @ one) for one in told]
            moved += float(np.sum((told[0] - told[1]) ** 2))
            readings, count = readings + number, count + len(missed[0])
    if not readings:
        return FoldRow(name, kind, count, None, None)
    base, effects = (Gap(float(one), float(readings), readings) for one in chi2)
    return FoldRow(name, kind, count, base, effects, moved)


def _pooled(gaps: Sequence[Gap | None]) -> Gap | None:
    there = [gap for gap in gaps if gap is not None]
    if not there:
        return None
    readings = sum(gap.readings for gap in there)
    return Gap(sum(gap.chi2 for gap in there), float(readings), readings)
