"""Upright posture (Table 2), equations, exertions: what a run makes of the paper's method."""

from collections.abc import Callable, Iterator

import numpy as np
import pandas as pd

from spinepipe.comparison.claim import Claim, NotComputed, Ours, Range, Run
from spinepipe.studies.trunk_loads.ghezelbash_2016.found import filled, numbered
from spinepipe.studies.trunk_loads.ghezelbash_2016.paper import (
    NO_EMG,
    NO_EQ_4_5,
    OTHER_MODEL,
    PAPER,
    PERSONS,
    VOLUNTEER,
    Value,
    missing,
    put_in,
    yes_no,
)

TABLE_2 = PAPER["table_2"]
BODIES = TABLE_2["bodies"]
BOUND_DEG = float(TABLE_2["bound_deg"])

SLACK_NM = 0.5
"""Largest moment that no muscle may hold in tasks 1 to 9, as this study's goal has it."""

_TRIFLE = 1e-6
"""Of forces and angles at a bound, relative: what a solver leaves."""

_ORDER_OF_SIZE = "order of size only: rotations are from another unloaded geometry"


def claims_of_postures_and_equations() -> Iterator[Claim]:
    """Table 2, the equations, the exertions, and what the paper shows in figures alone."""
    yield from _upright()
    yield from _forces()
    yield from _scaling()
    yield from _exertions()
    yield from _not_here()


def _upright() -> Iterator[Claim]:
    for key, person in PERSONS.items():
        for body, value in zip(BODIES, TABLE_2[key]["upright_deg"], strict=True):
            yield Claim(
                f"table_2.{key}.{body}",
                "Table 2",
                f"rotation of {body} of {person} when standing upright",
                "deg",
                float(value),
                _of_one_size(float(value)),
                _rotation(person, body),
                OTHER_MODEL,
                _ORDER_OF_SIZE,
            )
        yield yes_no(
            f"table_2.{key}.order",
            "Table 2",
            f"bodies of {person} are turned the more backwards the lower they lie",
            _ordered(person),
        )
    yield Claim(
        "table_2.spread",
        "Table 2",
        "rotation of a body upright: largest difference among four persons",
        "deg",
        _spread_in_paper(),
        Range(
            None, 1.0, "less than one degree, chosen here: the paper's persons stand alike to half"
        ),
        _spread,
        OTHER_MODEL,
        _ORDER_OF_SIZE,
    )
    yield Claim(
        "results.omega_bound",
        "2.6",
        "largest rotation of a body from the start of Eq 2",
        "deg",
        BOUND_DEG,
        Range(None, BOUND_DEG * (1.0 + _TRIFLE), "no more than the paper's bound"),
        _farthest_from_start,
        "bodies were turned farther than Eq 2 allows",
    )
    yield Claim(
        "equations.upright_posture",
        "Eq 2",
        "sum of moments upright over that at the start, the worst of all persons",
        "ratio",
        None,
        Range(None, 1.0 + _TRIFLE, "no larger than at the start"),
        _moments,
        "moments are larger upright than where Eq 2 started",
    )


def _of_one_size(value: float) -> Range:
    """A rotation as far off as Eq 2 may turn a body: what the paper prints has no spread."""
    what = f"{BOUND_DEG:g} deg either way, chosen here: as far as Eq 2 may turn a body"
    return Range(value - BOUND_DEG, value + BOUND_DEG, what, chosen=True)


def _upright_of(run: Run, person: str) -> "pd.Series[float]":
    rows = run.rows("upright", specimen=person)
    found = pd.to_numeric(rows["upright_deg"]).astype(float).set_axis(rows["body"])
    lacking = [body for body in BODIES if body not in found.index or pd.isna(found[body])]
    if lacking:
        raise NotComputed(f"this run's table upright has no rotation of {lacking[0]} of {person}")
    return found[list(BODIES)]


def _rotation(person: str, body: str) -> Value:
    return lambda run: Ours(float(_upright_of(run, person)[body]))


def _ordered(person: str) -> Callable[[Run], bool]:
    return lambda run: bool((np.diff(_upright_of(run, person)) > 0.0).all())


def _spread_in_paper() -> float:
    printed = np.array([TABLE_2[key]["upright_deg"] for key in PERSONS])
    return float(np.ptp(printed, axis=0).max())


def _spread(run: Run) -> Ours:
    turned = np.array([_upright_of(run, person) for person in PERSONS.values()])
    apart = np.ptp(turned, axis=0)
    return Ours(float(apart.max()), note=f"ours: at {BODIES[int(apart.argmax())]}")


def _farthest_from_start(run: Run) -> Ours:
    rows = run.rows("upright")
    return Ours(float((rows["upright_deg"] - rows["start_deg"]).abs().max()))


def _moments(run: Run) -> Ours:
    rows = run.rows("upright").dropna(subset=["moment_before_nm", "moment_after_nm"])
    columns = ["moment_before_nm", "moment_after_nm"]
    sums = rows[columns].abs().groupby(rows["specimen"]).sum()
    if sums.empty or (sums["moment_before_nm"] == 0.0).any():
        raise NotComputed("no moments stand at the start of Eq 2")
    return Ours(float((sums["moment_after_nm"] / sums["moment_before_nm"]).max()))


def _forces() -> Iterator[Claim]:
    yield Claim(
        "equations.moment_equilibrium",
        "Eq 1",
        "largest moment that no muscle holds in tasks 1 to 9",
        "N m",
        0.0,
        Range(None, SLACK_NM, f"to {SLACK_NM:g} N m, this study's goal; Eq 1 has none"),
        _slack,
        "muscles of these persons cannot hold a task at the stated largest stress",
    )
    yield Claim(
        "equations.muscle_bounds",
        "2.4",
        "fascicles that pull less than passively, or actively beyond the largest stress",
        "count",
        0.0,
        Range(0.0, 0.0, "none: the bounds are the paper's"),
        _out_of_bounds,
        "forces leave their bounds",
    )
    yield missing(
        "equations.muscle_cost",
        "2.4",
        "sum of squared stress",
        "",
        None,
        "a formula without a number; it is what the solver makes least (tests)",
    )
    yield missing(
        "equations.rectus_sheath",
        "2.3",
        "internal less external oblique along the sheath, least",
        "N",
        None,
        "no table holds forces along the sheath; the solver keeps them from pushing (tests)",
    )
    for key in ("shear_T11", "shear_T12", "coactivation"):
        yield missing(
            f"equations.{key}",
            "Eq 5" if key == "coactivation" else "Eq 4",
            key.replace("_", " of "),
            "",
            None,
            NO_EQ_4_5,
        )


def _slack(run: Run) -> Ours:
    rows = run.rows("tasks")
    number = pd.to_numeric(rows["number"], errors="coerce").astype(float)
    rows = rows[number.between(1.0, 9.0)]
    if rows.empty:
        raise NotComputed("this run's table tasks has none of tasks 1 to 9")
    slack = filled(rows, "largest_slack_nm")
    worst = rows.iloc[int(slack.to_numpy().argmax())]
    return Ours(float(slack.max()), note=f"ours: task {worst['task']} of {worst['specimen']}")


def _out_of_bounds(run: Run) -> Ours:
    stress = run.rows("tasks").set_index(["specimen", "task"])["largest_stress_mpa"]
    rows = run.rows("muscles").dropna(subset=["force_n", "passive_n"])
    if rows.empty:
        raise NotComputed("no fascicle of this run has a force")
    allowed = stress.reindex(pd.MultiIndex.from_frame(rows[["specimen", "task"]])).to_numpy(float)
    largest = allowed * rows["pcsa_mm2"].to_numpy(float)  # MPa mm2 are N
    active = (rows["force_n"] - rows["passive_n"]).to_numpy(float)
    beyond = (active < -_TRIFLE * largest) | (active > (1.0 + _TRIFLE) * largest)
    return Ours(float(beyond.sum()), note=f"ours: of {len(rows)} forces")


def _scaling() -> Iterator[Claim]:
    """Exact ratios of section 2.7, for the volunteer."""
    tall = PAPER["persons"][VOLUNTEER]["height_cm"] / PAPER["reference"]["height_cm"]
    for key, what in (
        ("scale_coordinates", "coordinates of the spine"),
        ("scale_disc_height", "disc heights"),
    ):
        yield put_in(
            f"equations.{key}",
            "2.7",
            f"{what} of {VOLUNTEER} over those of the reference person",
            "ratio",
            tall,
            _ratio("lengths and disc heights"),
        )
    for key, stiffness, power in (
        ("beam_stiffness", "axial", 1),
        ("scale_area_moments", "angular", 2),
    ):
        yield put_in(
            f"equations.{key}",
            "2.7",
            f"{stiffness} stiffness of {VOLUNTEER}'s discs times height over area"
            + (" squared" if power == 2 else "")
            + ", all as ratios to the reference person",
            "ratio",
            1.0,
            _beam(f"{stiffness}_stiffness", power),
        )
    for key, what, why in (
        ("scale_muscles", "distances and cross-sections of muscles", "Anderson 2012"),
        ("scale_disc_area", "disc areas", "Shi 2014"),
    ):
        yield missing(
            f"equations.{key}",
            "2.7",
            f"{what} of a person over those of the reference person",
            "ratio",
            None,
            f"the regressions of {why} were not to be had: the ratios are those of table scaling",
        )


def _number_of(run: Run, quantity: str) -> float:
    return run.number("scaling", "ratio", specimen=VOLUNTEER, quantity=quantity, of="all")


def _ratio(quantity: str) -> Value:
    return lambda run: Ours(_number_of(run, quantity))


def _beam(stiffness: str, power: int) -> Value:
    def ours(run: Run) -> Ours:
        height, area = (_number_of(run, one) for one in ("lengths and disc heights", "disc_area"))
        return Ours(_number_of(run, stiffness) * height / area**power)

    return ours


def _exertions() -> Iterator[Claim]:
    """Largest exertions: whether muscles hold what the volunteers held."""
    for number, what in ((10, "extension"), (11, "flexion"), (12, "torsion")):
        yield Claim(
            f"table_1.task_{number}.held",
            "Table 1, 3.3",
            f"share of the strength that the exertion in {what} takes",
            "ratio",
            None,
            Range(None, 1.0, "no more than all: the paper's muscles hold it at 1.0 MPa"),
            _strength(number),
            f"the task is beyond the muscles' strength; {OTHER_MODEL}",
            "pressure in the abdomen and antagonists, which the paper adds, are left out",
        )


def _strength(number: int) -> Value:
    person = PERSONS["A" if number == 12 else "B"]

    def ours(run: Run) -> Ours:
        row = numbered(run, number, specimen=person).iloc[[0]]
        return Ours(float(filled(row, "strength_used").iloc[0]), note=f"ours: of {person}")

    return ours


def _not_here() -> Iterator[Claim]:
    for number, row in ((10, PAPER["table_3"]["10"]), (11, PAPER["table_3"]["11"])):
        for case, r in zip(PAPER["table_3"]["cases"], row["correlation"], strict=True):
            yield missing(
                f"table_3.task_{number}.{case}.correlation",
                "Table 3",
                f"correlation of activities with EMG, task {number}, case {case}",
                "r",
                float(r),
                NO_EMG,
            )
    for figure in ("fig_7", "fig_8"):
        where = figure.replace("_", " ").capitalize()
        yield missing(f"{figure}.emg", where, "activities beside EMG", "", None, NO_EMG)
    yield missing(
        "results.mve_subjects",
        "3.3",
        "volunteers whose exertions were measured",
        "count",
        float(PAPER["men_of_exertions"]["count"]),
        "their mean alone is a person of this cohort",
    )
    yield missing(
        "results.passive_curves",
        "Fig 2",
        "curves of joints",
        "",
        None,
        "no number of them is printed: this study has others, whose source the settings name",
    )
