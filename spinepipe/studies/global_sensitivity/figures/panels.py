"""Which outputs the figures show, and the rows of each."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import chain, zip_longest

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.report.global_sensitivity.loaded import loaded
from spinepipe.report.global_sensitivity.measures import Measures
from spinepipe.report.global_sensitivity.words import OUTPUT
from spinepipe.units import COORDINATES

PLACE = ["specimen", "joint"]
EVERY = "*"
"""All tests, or all joints: of stiffness."""


@dataclass(frozen=True, eq=False)
class Panel:
    """One output: a coordinate in a test, of one joint, or of all joints and specimens together.

    Attributes
    ----------
    joint : the joint; empty where several places are together.
    rows : those of the table ``indices`` or ``convergence`` that have a result.
    """

    output: str
    test: str
    step: int
    coordinate: str
    joint: str
    rows: pd.DataFrame

    @property
    def places(self) -> int:
        """How many joints and specimens are together."""
        return len(self.rows[PLACE].drop_duplicates())

    def of(self, rows: pd.DataFrame) -> "Panel":
        """The same output in another table."""
        kept = _chosen(rows, self.output, self.test, self.step, self.coordinate)
        kept = kept[kept["joint"] == self.joint] if self.joint else kept
        return Panel(self.output, self.test, self.step, self.coordinate, self.joint, kept)


def outputs(cohort: Cohort, indices: pd.DataFrame, measures: Measures) -> list[Panel]:
    """One panel for each output and test: the coordinate that the test loads, at its peak.

    Of stiffness, and of a test of which no loaded coordinate was asked for, every coordinate.
    """
    rows = with_results(indices, measures)
    found = []
    for (output, test), part in rows.groupby(["output", "test"], sort=False):
        known = loaded(cohort, str(test))
        steps = set(part["step"])
        step = known[1] if known and known[1] in steps else max(steps)
        for name in _coordinates(part[part["step"] == step], known[0] if known else ""):
            chosen = _chosen(part, str(output), str(test), step, name)
            found.append(Panel(str(output), str(test), step, name, "", chosen))
    return sorted(found, key=lambda panel: list(OUTPUT).index(panel.output))


def with_results(rows: pd.DataFrame, measures: Measures) -> pd.DataFrame:
    """Rows of the shown indices that have a result; test, joint and step of all are empty and 0."""
    kept = rows[rows["estimate"].notna() & rows["index"].isin(measures.shown)]
    names = {name: kept[name].replace(EVERY, "") for name in ("test", "joint")}
    return kept.assign(**names, step=kept["step"].fillna(0).astype(int))


def shown(found: Sequence[Panel], joints: Sequence[str], most: int) -> list[Panel]:
    """At most so many panels; of a single specimen a joint each, where there is room."""
    apart = [one for panel in found for one in by_joint(panel, joints)]
    several = any(panel.rows["specimen"].nunique() > 1 for panel in found)
    return first_of(found, most) if several or len(apart) > most else apart


def first_of(found: Sequence[Panel], most: int) -> list[Panel]:
    """So many panels at most, the first ones of each output in turn, in their order."""
    by_output = [[panel for panel in found if panel.output == name] for name in OUTPUT]
    turns = chain.from_iterable(zip_longest(*by_output))
    kept = [panel for panel in turns if panel is not None][:most]
    return [panel for panel in found if any(panel is one for one in kept)]


def by_joint(panel: Panel, joints: Sequence[str]) -> list[Panel]:
    """A panel for each joint, cranial first; of stiffness that all joints share the panel itself.

    Parameters
    ----------
    joints : caudal to cranial.
    """
    there = [name for name in joints[::-1] if name in set(panel.rows["joint"])]
    return [
        replace(panel, joint=name, rows=panel.rows[panel.rows["joint"] == name]) for name in there
    ] or [panel]


def _coordinates(rows: pd.DataFrame, driven: str) -> list[str]:
    there = [name for name in COORDINATES if name in set(rows["coordinate"])]
    return [driven] if driven in there and rows["output"].iloc[0] != "stiffness" else there


def _chosen(rows: pd.DataFrame, output: str, test: str, step: int, coordinate: str) -> pd.DataFrame:
    return rows[
        (rows["output"] == output)
        & (rows["test"] == test)
        & (rows["step"] == step)
        & (rows["coordinate"] == coordinate)
    ]


def pooled(rows: pd.DataFrame, by: Sequence[str] = ("index", "factor")) -> pd.DataFrame:
    """Mean estimate and mean ends over joints and specimens, in the order of the rows.

    The mean of the ends is no narrower than the interval of the mean: SDs add up at most.
    ``lowest`` and ``highest`` are the ends of the estimates at single ``places``.
    """
    return (
        rows.groupby(list(by), sort=False)
        .agg(
            estimate=("estimate", "mean"),
            low=("ci_low", "mean"),
            high=("ci_high", "mean"),
            places=("estimate", "size"),
            lowest=("estimate", "min"),
            highest=("estimate", "max"),
        )
        .reset_index()
    )


def above_floor(rows: pd.DataFrame) -> set[str]:
    """Factors that are above the noise floor at any place."""
    return set(rows.loc[rows["above_floor"].eq(True), "factor"])


def leading(found: Sequence[Panel], measures: Measures) -> list[str]:
    """Factors from the largest mean of the main index over panels down; ties as in the study.

    Indices in the output's unit count as shares of each panel's largest.
    """
    every = []
    for panel in found:
        rows = pooled(panel.rows[panel.rows["index"] == measures.main])
        largest = rows["estimate"].abs().max() if measures.in_units and len(rows) else 1.0
        every.append(rows.set_index("factor")["estimate"] / (largest or 1.0))
    mean = pd.concat(every).groupby(level=0, sort=False).mean()
    return [str(name) for name in mean.sort_values(ascending=False, kind="stable").index]
