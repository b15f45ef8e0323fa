"""Which outputs the figures and findings show, the rows of each, and what they are called."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain, zip_longest

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from spinepipe.cohort import Cohort
from spinepipe.report.panels import lettered, sections
from spinepipe.report.style import BLUE, GREEN, VERMILLION, saying
from spinepipe.report.words import AXIS, capital, case, count, plain, short, unit
from spinepipe.sensitivity_analysis.global_indices.design import DUMMY
from spinepipe.studies.global_sensitivity.largest_moment import largest_moment
from spinepipe.studies.global_sensitivity.tables import EVERY
from spinepipe.units import COORDINATES, TRANSLATIONS


@dataclass(frozen=True)
class Measures:
    """Indices of one kind of design.

    Attributes
    ----------
    main : the index that factors are put in order by. shown : those that are drawn, main first.
    of_variance : whether they are shares of the output's variance.
    in_units : whether they are in the output's unit.
    """

    main: str
    shown: tuple[str, ...]
    of_variance: bool = False
    in_units: bool = False


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


NAME = {
    "ST": "total index ST",
    "S1": "first-order index S1",
    "mu_star": "mean size of effects μ*",
    "sigma": "SD of effects σ",
    "PAWN": "PAWN",
    "delta": "δ",
    "S1_RBD": "S1 (RBD-FAST)",
}

_KNOWN = (
    Measures("ST", ("ST", "S1"), of_variance=True),
    Measures("mu_star", ("mu_star", "sigma"), in_units=True),
    Measures("PAWN", ("PAWN", "delta", "S1_RBD")),
)

COLORS = (BLUE, GREEN, VERMILLION)
"""Of the shown indices, the main one first."""

DONE = "done"
PLACE = ["specimen", "joint"]

OUTPUT = {"motion": "motion", "joint_load": "joint load", "stiffness": "calibrated stiffness"}
"""Outputs in their order."""

_LONGEST = 34

SEEN = 0.002
"""Part of a panel's largest index from which on a noise floor can be seen."""

FAILED = "\u2020"
"""Mark of panels whose indices lack runs that failed."""


def measures_of(indices: pd.DataFrame) -> Measures | None:
    """The measures of a study's indices; None where none of them is known."""
    names = set(indices["index"])
    return next((known for known in _KNOWN if known.main in names), None)


def shown_outputs(cohort: Cohort, indices: pd.DataFrame) -> tuple[list[Panel], Measures | None]:
    """The outputs of a study, and the measures of its indices; none where no index is known."""
    measures = measures_of(indices) if len(indices) else None
    return (outputs(cohort, indices, measures) if measures else []), measures


def outputs(cohort: Cohort, indices: pd.DataFrame, measures: Measures) -> list[Panel]:
    """One panel for each output and test: the coordinate that the test loads, at its peak.

    Of stiffness, and of a test of which no loaded coordinate was asked for, every coordinate.
    """
    rows = with_results(indices, measures)
    found = []
    for (output, test), part in rows.groupby(["output", "test"], sort=False):
        known = largest_moment(cohort, str(test))
        steps = set(part["step"])
        step = known[1] if known and known[1] in steps else max(steps)
        there = set(part[part["step"] == step]["coordinate"])
        names = [name for name in COORDINATES if name in there]
        if known and known[0] in names and output != "stiffness":
            names = [known[0]]
        for name in names:
            chosen = _chosen(part, str(output), str(test), step, name)
            found.append(Panel(str(output), str(test), step, name, "", chosen))
    return sorted(found, key=lambda panel: list(OUTPUT).index(panel.output))


def with_results(rows: pd.DataFrame, measures: Measures) -> pd.DataFrame:
    """Rows of the shown indices that have a result; test, joint and step of all are empty and 0."""
    kept = rows[rows["estimate"].notna() & rows["index"].isin(measures.shown)]
    names = {name: kept[name].replace(EVERY, "") for name in ("test", "joint")}
    return kept.assign(**names, step=kept["step"].fillna(0).astype(int))


def _chosen(rows: pd.DataFrame, output: str, test: str, step: int, coordinate: str) -> pd.DataFrame:
    return rows[
        (rows["output"] == output)
        & (rows["test"] == test)
        & (rows["step"] == step)
        & (rows["coordinate"] == coordinate)
    ]


def choose_panels(found: Sequence[Panel], joints: Sequence[str], most: int) -> list[Panel]:
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


def pool(rows: pd.DataFrame, by: Sequence[str] = ("index", "factor")) -> pd.DataFrame:
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


def floor_seen(rows: pd.DataFrame) -> bool:
    """Whether the noise floor is large enough to be drawn beside the indices."""
    return bool(rows["noise_floor"].max() > SEEN * rows["estimate"].abs().max())


def screened(rows: pd.DataFrame) -> bool:
    """Whether factors were asked whether they are negligible."""
    return bool(rows["negligible"].notna().any())


def failures(rows: pd.DataFrame) -> bool:
    """Whether runs failed, so that these indices speak of the others only."""
    return bool(rows["failed"].max() > 0)


def leading(found: Sequence[Panel], measures: Measures) -> list[str]:
    """Factors from the largest mean of the main index over panels down; ties as in the study.

    Indices in the output's unit count as shares of each panel's largest.
    """
    every = []
    for panel in found:
        rows = pool(panel.rows[panel.rows["index"] == measures.main])
        # effects in mm and N m cannot be averaged: as shares of the panel's largest they can
        largest = rows["estimate"].abs().max() if measures.in_units and len(rows) else 1.0
        every.append(rows.set_index("factor")["estimate"] / (largest or 1.0))
    mean = pd.concat(every).groupby(level=0, sort=False).mean()
    return [str(name) for name in mean.sort_values(ascending=False, kind="stable").index]


def title(index: int, panel: Panel) -> str:
    """Letter, test and joint, and below them the output."""
    first = where(panel.test, panel.joint) + f" {FAILED}" * failures(panel.rows)
    second = f"{capital(kind(panel.output, panel.coordinate))}, {AXIS[panel.coordinate].lower()}"
    return lettered(index, "\n".join(part for part in (first, second) if part))


def factor_name(factor: str, longest: int = _LONGEST) -> str:
    """``stiffness_L1L2_extension`` as ``stiffness L1L2 extension``."""
    return f"{DUMMY} (no effect)" if factor == DUMMY else short(plain(factor), longest)


def what(output: str, coordinate: str) -> str:
    """``motion in flexion–extension``; a load along a rotation is a moment."""
    return f"{kind(output, coordinate)} in {AXIS[coordinate].lower()}"


def kind(output: str, coordinate: str) -> str:
    """``motion``, ``force``, ``moment`` or ``stiffness``."""
    if output == "joint_load":
        return "force" if coordinate in TRANSLATIONS else "moment"
    return output


def where(test: str, joint: str) -> str:
    """``flexion, L1L2``: what there is of them."""
    return ", ".join(part for part in (case(test), joint) if part)


def unit_of(output: str, coordinate: str) -> str:
    """Unit of an output as printed."""
    along = coordinate in TRANSLATIONS
    if output == "stiffness":
        return "N/m" if along else "N m/rad"
    if output == "joint_load":
        return "N" if along else "N m"
    return unit(coordinate)


def whole(n: int) -> str:
    """``20 480``."""
    return f"{n:,}".replace(",", "\u2009")


def sections_of(
    kept: Sequence[Panel], heights_mm: Mapping[str, float], key_mm: float
) -> tuple[list[Axes], Figure]:
    """Axes of the panels, each output in lines of its own and of its own height."""
    counts = {name: sum(panel.output == name for panel in kept) for name in OUTPUT}
    lines = [(n, heights_mm[name]) for name, n in counts.items() if n]
    parts, figure = sections(lines, key_mm)
    return [axis for part in parts for axis in part], figure


def no_index(rows: pd.DataFrame) -> Figure:
    """A figure that says why there is nothing to show."""
    why = rows.loc[rows["status"] != DONE, ["status", "message"]].drop_duplicates()
    said = [str(row.message or row.status).replace("_", " ") for row in why.itertuples()]
    reason = "; ".join(dict.fromkeys(said[:2])) or "there is no output"
    return saying(f"No index can be shown: {reason}.")


def footnote(kept: Sequence[Panel], found: Sequence[Panel], not_drawn: str) -> str:
    """Below the panels: runs, what is together, the dummy, and what is only in the table."""
    rows = pd.concat([panel.rows for panel in kept])
    dummy = "no dummy, so no noise floor"
    if DUMMY in set(rows["factor"]):
        quiet = "" if floor_seen(rows) else "the noise floor is too low to be seen; "
        where = "negligible in every panel"
        if not screened(rows):
            where = "above the noise floor in no panel"
        dummy = f"{quiet}grey names: {where}"
    there, more = {(panel.output, panel.test, panel.coordinate) for panel in kept}, ""
    if len(there) != len(found):
        more = f"{len(there)} of {len(found)} outputs, the others are in the table"
    parts = [_runs(rows), _together(kept), dummy, more, not_drawn]
    return "; ".join(part for part in parts if part) + "."


def _runs(rows: pd.DataFrame) -> str:
    least, most = int(rows["runs"].min()), int(rows["runs"].max())
    runs = count(most, "run") if least == most else f"{whole(least)} to {count(most, 'run')}"
    failed = int(rows["failed"].max())
    lost = ", none failed"
    if failed:
        lost = f", at most {whole(failed)} failed; {FAILED}: indices of inputs at which runs stand"
    several = rows["specimen"].nunique() > 1
    return f"{runs}{' of each specimen' if several else ''}{lost}"


def _together(kept: Sequence[Panel]) -> str:
    if all(panel.places < 2 for panel in kept):
        return ""
    rows = pd.concat([panel.rows for panel in kept])
    specimens = rows["specimen"].nunique()
    what_of = "joints" if specimens == 1 else f"joints of {specimens} specimens"
    if set(rows["output"]) == {"stiffness"}:
        what_of = f"{specimens} specimens"
    return f"bars and lines: means over the {what_of}"
