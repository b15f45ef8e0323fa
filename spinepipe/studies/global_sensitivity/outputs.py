"""Which outputs a page tells of, the rows of each, and what they and the factors are called."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.report.words import AXIS, level, plain, unit
from spinepipe.sensitivity_analysis.global_indices.design import DUMMY
from spinepipe.studies.global_sensitivity.largest_moment import largest_moment
from spinepipe.studies.global_sensitivity.tables import EVERY
from spinepipe.units import COORDINATES, TRANSLATIONS

DONE = "done"
KINDS = ("motion", "joint_load", "stiffness")
"""Kinds of outputs, in their order."""


@dataclass(frozen=True)
class Measures:
    """Indices of one kind of design.

    Attributes
    ----------
    main : the index that factors are put in order by. shown : those that are drawn, main first.
    alone : the index of what a factor does by itself; nothing where a design has none.
    of_variance : whether they are shares of the output's variance.
    in_units : whether they are in the output's unit.
    """

    main: str
    shown: tuple[str, ...]
    alone: str = ""
    of_variance: bool = False
    in_units: bool = False


_KNOWN = (
    Measures("ST", ("ST", "S1"), "S1", of_variance=True),
    Measures("mu_star", ("mu_star", "sigma"), in_units=True),
    Measures("PAWN", ("PAWN", "delta", "S1_RBD"), "S1_RBD"),
)

NAME = {
    "ST": "with others (ST)",
    "S1": "alone (S1)",
    "mu_star": "mean effect (μ*)",
    "sigma": "SD of effects (σ)",
    "PAWN": "PAWN",
    "delta": "δ",
    "S1_RBD": "alone (S1, RBD-FAST)",
}


def measures_of(indices: pd.DataFrame) -> Measures | None:
    """The measures of a study's indices; None where none of them is known."""
    names = set(indices["index"]) if len(indices) else set()
    return next((known for known in _KNOWN if known.main in names), None)


@dataclass(frozen=True, eq=False)
class Output:
    """A coordinate in a test, of one joint, or of all joints and specimens together.

    Attributes
    ----------
    kind : one of `KINDS`. joint : empty where several places are together.
    rows : those of the table ``indices`` or ``convergence`` that have a result.
    loaded : whether it is the coordinate that the test loads, and so needs no name.
    """

    kind: str
    test: str
    step: int
    coordinate: str
    joint: str
    rows: pd.DataFrame
    loaded: bool = False

    def of(self, rows: pd.DataFrame) -> "Output":
        """The same output in another table."""
        kept = _chosen(rows, self.kind, self.test, self.step, self.coordinate)
        return replace(self, rows=kept[kept["joint"] == self.joint] if self.joint else kept)

    def by_joint(self, joints: Sequence[str]) -> list["Output"]:
        """One for each joint, cranial first; of stiffness that all joints share itself.

        Parameters
        ----------
        joints : caudal to cranial.
        """
        there = [name for name in joints[::-1] if name in set(self.rows["joint"])]
        own = [
            replace(self, joint=name, rows=self.rows[self.rows["joint"] == name]) for name in there
        ]
        return own or [self]

    def ordered(self, index: str) -> list[dict[str, Any]]:
        """Factors but for the dummy by an index, the largest first: mean estimate and mean ends.

        Means are over joints and specimens. The mean of the ends is no narrower than the interval
        of the mean: SDs add up at most.
        """
        rows = self.rows[(self.rows["index"] == index) & (self.rows["factor"] != DUMMY)]
        means = rows.groupby("factor", sort=False).agg(
            estimate=("estimate", "mean"),
            low=("ci_low", "mean"),
            high=("ci_high", "mean"),
            n=("estimate", "size"),
        )
        ordered = means.sort_values("estimate", ascending=False, kind="stable").reset_index()
        return [{str(name): x for name, x in row.items()} for row in ordered.to_dict("records")]

    @property
    def words(self) -> str:
        """``motion in flexion``; with the direction where the test has several."""
        if self.kind == "stiffness":
            return f"calibrated {AXIS[self.coordinate].lower()} stiffness"
        direction = "" if self.loaded else f"{AXIS[self.coordinate].lower()} "
        return f"{direction}{quantity(self.kind, self.coordinate)} in {plain(self.test)}"

    @property
    def unit(self) -> str:
        """As printed."""
        along = self.coordinate in TRANSLATIONS
        if self.kind == "stiffness":
            return "N/m" if along else "N m/rad"
        if self.kind == "joint_load":
            return "N" if along else "N m"
        return unit(self.coordinate)


def outputs(cohort: Cohort, indices: pd.DataFrame, measures: Measures) -> list[Output]:
    """One for each kind of output and test: the coordinate that the test loads, at its peak.

    Of stiffness, and of a test of which no loaded coordinate was asked for, every coordinate.
    """
    rows = with_results(indices, measures)
    found = []
    for (kind, test), part in rows.groupby(["output", "test"], sort=False):
        known = largest_moment(cohort, str(test))
        steps = set(part["step"])
        step = known[1] if known and known[1] in steps else max(steps)
        there = set(part[part["step"] == step]["coordinate"])
        names = [name for name in COORDINATES if name in there]
        loaded = known is not None and known[0] in names and kind != "stiffness"
        if known and loaded:
            names = [known[0]]
        for name in names:
            chosen = _chosen(part, str(kind), str(test), step, name)
            found.append(Output(str(kind), str(test), step, name, "", chosen, loaded))
    return sorted(found, key=lambda one: KINDS.index(one.kind))


def with_results(rows: pd.DataFrame, measures: Measures) -> pd.DataFrame:
    """Rows of the shown indices that have a result; test, joint and step of all are empty and 0."""
    kept = rows[rows["estimate"].notna() & rows["index"].isin(measures.shown)]
    names = {name: kept[name].replace(EVERY, "") for name in ("test", "joint")}
    return kept.assign(**names, step=kept["step"].fillna(0).astype(int))


def _chosen(rows: pd.DataFrame, kind: str, test: str, step: int, coordinate: str) -> pd.DataFrame:
    return rows[
        (rows["output"] == kind)
        & (rows["test"] == test)
        & (rows["step"] == step)
        & (rows["coordinate"] == coordinate)
    ]


def quantity(kind: str, coordinate: str) -> str:
    """``motion``, ``force``, ``moment`` or ``stiffness``."""
    if kind == "joint_load":
        return "force" if coordinate in TRANSLATIONS else "moment"
    return kind


_AXES: Mapping[str, str] = {"x": "anterior", "y": "superior", "z": "right"}

_STIFFNESS: Mapping[str, str] = {
    "anterior": "A–P shear",
    "superior": "compression",
    "right": "lateral shear",
    "extension": "flexion",
    "right_bending": "bending",
    "left_rotation": "axial rotation",
}
"""Stiffness as the field calls it, short enough for the side of a figure."""


def factor_name(factor: str) -> str:
    """``load_point_x`` is load point (anterior)."""
    if factor == DUMMY:
        return "no effect (dummy)"
    for coordinate, words in _STIFFNESS.items():
        if factor.startswith("stiffness") and factor.endswith(f"_{coordinate}"):
            middle = plain(factor.removeprefix("stiffness").removesuffix(coordinate))
            return f"{words} stiffness {level(middle)}".strip()
    head, _, last = factor.rpartition("_")
    if not head or last not in _AXES:
        return plain(factor)
    turned = head.endswith("direction")
    return f"{plain(head)} ({f'about the {_AXES[last]} axis' if turned else _AXES[last]})"
