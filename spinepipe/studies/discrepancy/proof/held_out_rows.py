"""Held-out confirmation as data: folds, margins, and what they say together."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from spinepipe.discrepancy.gaps import Gap
from spinepipe.discrepancy.proof.held_out_motion import HeldOutMotion

SAME = 1e-6
"""Share of chi2 by which predictions that hang on nothing that was scored may differ."""

SCORED, NOT_DETERMINED, NO_FIT = "scored", "not determined", "no fit"


@dataclass(frozen=True)
class FoldRow:
    """A fold: how large the discrepancy of its readings is, in noise SD.

    Attributes
    ----------
    kind : test, specimen or steps. readings : scored. left_out : scored or not.
    base, with_effects : None where nothing was scored; the same where no effect is named.
    surrogate : None where there is none. status : scored, not determined or no fit.
    expected : chi2 of a model that is right: noise, and nuisances that the training left open.
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

    @property
    def closed(self) -> float | None:
        """Share of the base's excess that the effects close; None where noise hides the excess."""
        return closed(self.base, self.with_effects, self.expected)


@dataclass(frozen=True)
class Margin:
    """By how much chi2 a model is better than another, over all folds; SE from three folds on."""

    chi2: float
    se: float | None

    @property
    def beats(self) -> bool:
        """Whether the model is the better one."""
        return self.chi2 > 0.0


@dataclass(frozen=True)
class HeldOut:
    """All folds, and what they say together.

    Attributes
    ----------
    motion : by specimen. base, with_effects, surrogate : over all scored readings; None of none.
    expected : chi2 of a model that is right: noise, and nuisances that training left open.
    over_base, over_surrogate : margins of the model with effects; None where nothing compares.
    """

    folds: tuple[FoldRow, ...]
    motion: Mapping[str, HeldOutMotion]
    base: Gap | None
    with_effects: Gap | None
    surrogate: Gap | None
    expected: float
    over_base: Margin | None
    over_surrogate: Margin | None

    @property
    def closed(self) -> float | None:
        """Share of the base's excess that the effects close; None where noise hides the excess."""
        return closed(self.base, self.with_effects, self.expected)

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
        return abs(self.over_base.chi2) > (SAME * self.base.chi2 if self.base else 0.0)

    @property
    def beats_base(self) -> bool:
        """Whether the effects predict better than the base alone."""
        return self.over_base is not None and self.over_base.beats

    @property
    def beats_surrogate(self) -> bool:
        """Whether the effects predict better than a surrogate without physics."""
        return self.over_surrogate is not None and self.over_surrogate.beats


def closed(base: Gap | None, new: Gap | None, expected: float) -> float | None:
    """(chi2 of base - chi2 of new) / (chi2 of base - expected), at most 1.

    None where noise, or nuisances that the training left open, may be all that the base misses.
    """
    if base is None or new is None or base.interval[0] <= 0.0 or base.chi2 <= expected:
        return None
    return min((base.chi2 - new.chi2) / (base.chi2 - expected), 1.0)
