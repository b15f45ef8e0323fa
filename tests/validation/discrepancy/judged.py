"""What a row's answer is worth: right, wrong, a set with the truth in it, and so on."""

from dataclasses import dataclass
from typing import Any

from tests.generators.hidden import CATALOGUE, KNOWN, is_other, recipe_from
from tests.generators.hidden.anatomy import joints_of_recipe
from tests.validation.discrepancy.designs import OF_NEIGHBOURS, design_of
from tests.validation.discrepancy.row import Row

LARGE, SMALL = 0.5, 0.2
"""Gaps from which an effect counts as large, and as small."""
REACHED = 0.05
"""Share by which a gap may miss its level and still belong to it."""

NULLS = ("null", "dirty")
NEEDS_TRANSLATIONS = ("joint_centre_offset", "joint_centre_migration")
NAMING = ("NAMED", "PART")
"""Verdicts that are sure of names."""


@dataclass(frozen=True)
class Judged:
    """One scored cohort.

    Attributes
    ----------
    truth : names of what was hidden, those outside the library too. named, tied : of the answer.
    gap : true gap, SD of one reading; the strongest plausible effect may not reach the wanted one.
    formula : same, other or mixed: whether the library has the formulas that were hidden.
    shown : whether the design shows the truth at all, by algebra (`by_algebra`).
    testable : the same as spinepipe judges it; None where it was not asked.
    below_limit : whether the gap is below what the design could find, as spinepipe judges it.
    """

    kind: str
    label: str
    seed: int
    truth: tuple[str, ...]
    gap: float
    formula: str
    design: str
    verdict: str
    named: tuple[str, ...]
    tied: tuple[str, ...]
    shown: bool
    testable: bool | None
    below_limit: bool | None
    row: Row

    @property
    def known(self) -> tuple[str, ...]:
        """What is true and has a name."""
        return tuple(name for name in self.truth if name in KNOWN)

    @property
    def is_named(self) -> bool:
        """Whether the answer is sure of names: NAMED or PART."""
        return self.verdict in NAMING

    @property
    def top1(self) -> bool:
        """Exactly what is true and has a name is named; beside an alien, as a part."""
        exact = self.is_named and set(self.named) == set(self.known)
        return exact and (self.verdict == "PART" or self.known == self.truth)

    @property
    def truth_in_set(self) -> bool:
        """All of the truth that has a name is among what was named or tied."""
        return bool(self.known) and set(self.known) <= {*self.named, *self.tied}

    @property
    def wrong_name(self) -> bool:
        """A name that is said for sure and is not true, also beside a set."""
        return bool(set(self.named) - set(self.truth))

    @property
    def answer(self) -> str:
        """Yes, set (the truth is among the names), no, or WRONG: a name that is not true."""
        if self.wrong_name:
            return "WRONG"
        right = self.top1 or (not self.truth and self.verdict == "NULL")
        if self.kind in ("alien", "mistake"):
            right = self.verdict in ("UNKNOWN", "REFUSED")
        return "yes" if right else "set" if self.truth_in_set else "no"

    @property
    def above(self) -> bool:
        """Testable and above the effect's own detection limit, as spinepipe judges both."""
        return self.shown and self.testable is True and self.below_limit is False

    @property
    def band(self) -> str:
        """Of the gap: large, small, tiny, or none."""
        if self.gap >= LARGE * (1.0 - REACHED):
            return ">= 0.5"
        if self.gap >= SMALL * (1.0 - REACHED):
            return "0.2-0.5"
        return "< 0.2" if self.gap > 0.0 else "none"

    @property
    def place_right(self) -> bool:
        """Coordinate, and joint if it is one, of what is left are those of the alien."""
        hidden = [one for one in self.row["recipe"]["hidden"] if one["name"] not in KNOWN]
        return any(_at(self.row, one) for one in hidden)


def judged(row: Row) -> Judged:
    """A scored row; its status must be ``scored`` or ``refused``."""
    target, truth = row["target"], row.get("truth", {"names": [], "gap": 0.0, "gaps": []})
    told = row.get("testable") or {}
    names = [name for name in truth["names"] if name in KNOWN]
    gaps = dict(zip(truth["names"], truth["gaps"], strict=True))
    those = [told.get(name, {}) for name in names]
    asked = bool(those) and all("testable" in one for one in those)
    pairs = list(zip(those, (gaps[name] for name in names), strict=True))
    return Judged(
        target["kind"],
        target["label"],
        target["seed"],
        tuple(truth["names"]),
        truth["gap"],
        formula_of(row),
        design_of(row["recipe"]),
        row.get("verdict", "REFUSED"),
        tuple(row.get("named", ())),
        tuple(row.get("tied", ())),
        all(by_algebra(name, row["recipe"]) for name in truth["names"]),
        all(one["testable"] for one in those) if asked else None,
        any(_below(*pair) for pair in pairs) if asked else None,
        row,
    )


def formula_of(row: Row) -> str:
    """Whether the library has the formulas of a row's known effects."""
    hidden = recipe_from(row["recipe"]).hidden
    others = {is_other(one) for one in hidden if one.name in CATALOGUE and one.name in KNOWN}
    return "mixed" if len(others) > 1 else "other" if others == {True} else "same"


def _below(told: dict[str, Any], gap: float) -> bool:
    return told["least_gap"] is None or gap < told["least_gap"]


def _at(row: Row, hidden: dict[str, Any]) -> bool:
    """Whether the place that is told is where an alien is."""
    coordinate = hidden["coordinate"] or DRIVEN.get(hidden["name"])
    said = (row.get("shape") or {}).get("coordinate")
    if said != coordinate:
        return False
    worst = (row.get("places") or {}).get("worst", [])
    if hidden["joint"] is None or not worst:
        return True
    joint = joints_of_recipe(recipe_from(row["recipe"]))[hidden["joint"]]
    return any(place["joint"] == joint for place in worst)


DRIVEN = {"quadratic_cross_coupling": "right_bending"}
"""Coordinate that an alien without one drives."""


def by_algebra(name: str, recipe: dict[str, Any]) -> bool:
    """Whether a design can show an effect at all.

    Rotations under pure moments do not depend on joint centres; stiffness that grows with the
    compression needs two compressions; stiffness shared by the levels needs several of them.
    """
    if name in NEEDS_TRANSLATIONS:
        return bool(recipe["translations"] or recipe["preload_n"])
    if name == "preload_stiffening":
        return bool(recipe["preload_n"])
    if name in OF_NEIGHBOURS:
        return bool(recipe["joints"] > 1)
    return True
