"""What a row's answer is worth: right, wrong, a set with the truth in it, and so on."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from tests.validation.discrepancy.row import Row

LEVELS = (0.1, 0.2, 0.5, 1.0)
REACHED = 0.05
"""Share by which a gap may miss its level and still belong to it."""

NULLS = ("null_white", "null_serial", "null_outliers", "null_dirty")
NEEDS_TRANSLATIONS = ("joint_centre_offset", "joint_centre_migration")


@dataclass(frozen=True)
class Judged:
    """One scored cohort.

    Attributes
    ----------
    truth : names of what was hidden. named, tied : of the answer.
    gap : true gap, SD of one reading; the strongest plausible effect may not reach the wanted one.
    shown : whether the design shows the truth at all, by algebra (`by_algebra`).
    testable : the same as spinepipe judges it; None where it was not asked.
    below_limit : whether the gap is below what the design could find, as spinepipe judges it.
    """

    kind: str
    label: str
    seed: int
    truth: tuple[str, ...]
    gap: float
    verdict: str
    named: tuple[str, ...]
    tied: tuple[str, ...]
    shown: bool
    testable: bool | None
    below_limit: bool | None
    row: Row

    @property
    def is_named(self) -> bool:
        """Whether the answer is sure of its names."""
        return self.verdict == "NAMED"

    @property
    def top1(self) -> bool:
        """Exactly the truth is named."""
        return self.is_named and set(self.named) == set(self.truth)

    @property
    def truth_in_set(self) -> bool:
        """All of the truth is among what was named or tied."""
        return bool(self.truth) and set(self.truth) <= {*self.named, *self.tied}

    @property
    def wrong_name(self) -> bool:
        """A name that is not true; a set names nothing."""
        return self.is_named and bool(set(self.named) - set(self.truth))

    @property
    def level(self) -> float:
        """The nearest of `LEVELS`, by ratio; 0 where there is no gap to speak of."""
        if self.gap < LEVELS[0] / 2.0:
            return 0.0
        return LEVELS[int(np.argmin(np.abs(np.log(np.array(LEVELS) / self.gap))))]

    def at_least(self, gap: float) -> bool:
        """Whether the true gap is at least so large, up to what scaling may miss."""
        return self.gap >= gap * (1.0 - REACHED)


def judged(row: Row) -> Judged:
    """A scored row; its status must be ``scored``."""
    target, truth = row["target"], row["truth"]
    told = row.get("testable") or {}
    those = [told.get(name, {}) for name in truth["names"]]
    known = bool(those) and all("testable" in one for one in those)
    return Judged(
        target["kind"],
        target["label"],
        target["seed"],
        tuple(truth["names"]),
        truth["gap"],
        row["verdict"],
        tuple(row["named"]),
        tuple(row["tied"]),
        all(by_algebra(name, row["recipe"]) for name in truth["names"]),
        all(one["testable"] for one in those) if known else None,
        any(_below(*pair) for pair in zip(those, truth["gaps"], strict=True)) if known else None,
        row,
    )


def _below(told: dict[str, Any], gap: float) -> bool:
    return told["least_gap"] is None or gap < told["least_gap"]


def by_algebra(name: str, recipe: dict[str, Any]) -> bool:
    """Whether a design can show an effect at all.

    Rotations under pure moments do not depend on joint centres; stiffness that grows with the
    compression needs two compressions.
    """
    if name in NEEDS_TRANSLATIONS:
        return bool(recipe["translations"] or recipe["preload_n"])
    if name == "preload_stiffening":
        return bool(recipe["preload_n"])
    return True
