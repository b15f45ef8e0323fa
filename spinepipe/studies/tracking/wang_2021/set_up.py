"""Persons, markers and settings: what a cohort and a study were made to have, as the paper's."""

from collections.abc import Iterator

import pandas as pd

from spinepipe.comparison.claim import Claim, NotComputed, Ours, Range, Run, exactly
from spinepipe.motion.skeleton import BODIES, PELVIS
from spinepipe.studies.tracking.wang_2021.found import FE, LB, STANCE, first_of, numbers
from spinepipe.studies.tracking.wang_2021.paper import (
    YES_NO,
    Value,
    missing,
    put_in,
    spread,
)

CLUSTERS = ("T1", "T3", "T7", "T11", "L2", "L4")
SINGLES = ("T5", "T9", "T12", "L3")
PELVIS_MARKERS = ("left_ASIS", "right_ASIS", "left_PSIS", "right_PSIS", "sacrum")
PER_CLUSTER = 3

PERSONS = {
    "age": ("age_years", "years", 67.85, 6.95),
    "height": ("height_cm", "cm", 164.14, 7.34),
    "weight": ("mass_kg", "kg", 60.37, 15.45),
}
"""Column, unit, mean and SD of its ten persons; the paper has height in mm."""

FREE = {
    "optk": (6, ("optk_generic", "optk_from_both", "optk_calibrated", "optk_zero")),
    "ik": (3, ("ik",)),
}
"""Coordinates of a joint that move, and approaches that have them."""

_SCALED = "here each cohort brings its persons' skeletons; there is no one generic man"


def claims_of_set_up() -> Iterator[Claim]:
    """Persons, markers, settings, and what is nothing here."""
    yield from _persons()
    yield from _markers()
    yield from _joints()
    yield from _settings()
    yield from _not_here()


def _persons() -> Iterator[Claim]:
    yield put_in(
        "results.n_subjects",
        "Measurements",
        "persons",
        "count",
        10.0,
        lambda run: Ours(float(run.rows("subjects")["specimen"].nunique())),
    )
    for name, (column, unit, mean, sd) in PERSONS.items():
        yield put_in(
            f"results.{name}",
            "Measurements",
            f"mean {name} of the persons",
            unit,
            mean,
            _mean_of_persons(column),
            spread(mean, sd),
        )
    yield put_in(
        "results.motions",
        "Measurements",
        "each person stands, bends forwards and back, and bends sideways",
        YES_NO,
        1.0,
        _all_motions,
    )


def _mean_of_persons(column: str) -> Value:
    return lambda run: Ours(float(numbers(run.rows("subjects"), column).mean()))


def _all_motions(run: Run) -> Ours:
    kinds = run.rows("trials").groupby("specimen")["kind"].agg(set)
    return Ours(float(all({STANCE, FE, LB} <= own for own in kinds)))


def _on(run: Run, vertebra: str) -> pd.DataFrame:
    """Markers of the first person on a vertebra; none is no fault."""
    rows = run.rows("marker_set")
    first = rows[rows["specimen"] == rows["specimen"].iloc[0]]
    return first[first["vertebra"] == vertebra]


def _markers() -> Iterator[Claim]:
    counts = {**dict.fromkeys(CLUSTERS, PER_CLUSTER), **dict.fromkeys(SINGLES, 1)}
    for vertebra, count in counts.items():
        yield put_in(
            f"markers.{vertebra}",
            "Measurements",
            f"markers on {vertebra}",
            "count",
            float(count),
            _count_on(vertebra),
        )
    at_least = len(PELVIS_MARKERS)
    for name in PELVIS_MARKERS:
        yield put_in(
            f"markers.{name}",
            "Measurements",
            f"markers on the pelvis, {name.replace('_', ' ')} among them",
            "count",
            float(at_least),
            _count_on(BODIES[PELVIS]),
        )
    yield put_in(
        "results.vertebrae_with_markers",
        "Measurements",
        "vertebrae with markers",
        "count",
        10.0,
        lambda run: Ours(float(sum(len(_on(run, name)) > 0 for name in BODIES[1:]))),
    )


def _count_on(vertebra: str) -> Value:
    return lambda run: Ours(float(len(_on(run, vertebra))))


def _joints() -> Iterator[Claim]:
    for name, (count, approaches) in FREE.items():
        yield put_in(
            f"results.dof_per_joint_{name}",
            "Data Processing",
            f"coordinates of a joint that move, {name}",
            "count",
            float(count),
            _moving(approaches),
        )
    for name, measure, count, words in (
        ("cog", "centre_mm", 17, "vertebrae whose centre is compared, T1 to L5"),
        ("angle", "angle_deg", 10, "joints whose angle is compared, T7T8 to L4L5"),
    ):
        yield put_in(
            f"results.alignment_levels_{name}",
            "Evaluation",
            words,
            "count",
            float(count),
            _levels(measure),
        )


def _moving(approaches: tuple[str, ...]) -> Value:
    def ours(run: Run) -> Ours:
        rows = run.rows("ranges", approach=first_of(run, "ranges", approaches))
        return Ours(float(rows[rows["range"] > 0.0]["coordinate"].nunique()))

    return ours


def _levels(measure: str) -> Value:
    return lambda run: Ours(float(run.rows("errors", measure=measure)["level"].nunique()))


def _asked(name: str) -> Value:
    def ours(run: Run) -> Ours:
        if run.asked.get(name) is None:
            raise NotComputed(f"this study does not say {name}")
        return Ours(float(run.asked[name]))

    return ours


def _settings() -> Iterator[Claim]:
    for key, where, quantity, unit, paper in (
        ("rom_bound_increase", "Data Processing", "by how much ranges are increased", "%", 150.0),
        ("max_marker_deviation", "Data Processing", "largest deviation of a marker", "mm", 40.0),
        ("intervals", "Results", "intervals of a motion", "count", 100.0),
    ):
        yield put_in(f"results.{key}", where, quantity, unit, paper, _asked(key))
    yield put_in(
        "closed_form.W5",
        "Data Processing",
        "range of a joint over the reported one",
        "ratio",
        None,
        _asked("times_the_range"),
        Range(1.5, 2.5, "what 150 % can mean: of the range, or added to it"),
        "W5: the paper does not say which; this study does",
    )
    yield put_in(
        "results.neutral_zone_moment",
        "Evaluation",
        "passive moment at which the low stiffness is read",
        "N m",
        0.1,
        _low_moment,
        Range(0.1 - 1e-6, 0.1 + 1e-6, "the paper's value, but for rounding"),
        "ours from stiffness and both parameters of the passive elements, k / B - A",
    )
    yield put_in(
        "results.msr_window",
        "Evaluation",
        "parts of the cycle in which sharing is looked at",
        "count",
        4.0,
        lambda run: Ours(float(run.rows("sharing")["window"].nunique())),
        exactly(4.0),
        "20-80 %, and 20-40, 40-60 and 60-80 %",
    )


def _low_moment(run: Run) -> Ours:
    rows = run.rows("stiffness").dropna(subset=["at_low_moment"])
    rows = rows[rows["b"] > 0.0]
    if rows.empty:
        raise NotComputed("this run has no stiffness at a low moment")
    found = rows["at_low_moment"] / rows["b"] - rows["a"]
    return Ours(float(found.median()), float(found.min()), float(found.max()))


def _not_here() -> Iterator[Claim]:
    for key, where, quantity, unit, paper, why in (
        ("cluster_mass", "Measurements", "mass of a cluster", "g", None, "plates have no mass"),
        ("generic_model_age", "Data Processing", "age of the generic man", "years", 25.0, _SCALED),
        ("generic_model_height", "Data Processing", "his height", "mm", 1750.0, _SCALED),
        ("generic_model_mass", "Data Processing", "his mass", "kg", 78.0, _SCALED),
        ("w1", "Eq 1", "weight of markers", "", 1000.0, "units of Eq 1 are not told"),
        ("w2", "Eq 1", "weight of active loads", "", 10.0, "units of Eq 1 are not told"),
        (
            "solver",
            "Results",
            "direct collocation with CasADi and IPOPT",
            "",
            None,
            "here splines whose coefficients are found by Gauss-Newton steps on a banded matrix",
        ),
        (
            "supplement_only",
            "Results",
            "ratios, high moments and errors by level",
            "",
            None,
            "they are in a supplement that is not at hand",
        ),
        ("code_availability", "Discussion", "code of the paper", "", None, "none was found"),
    ):
        yield missing(f"results.{key}", where, quantity, unit, paper, why)
