"""Rotations, shares and settings of the paper, beside those of this run: circular where they agree.

Shares are read from how far joints turned, so that what a study makes of a task shows.
"""

from collections.abc import Iterator

import pandas as pd

from spinepipe.comparison.claim import Claim, NotComputed, Ours, Run, exactly
from spinepipe.studies.trunk_loads.ghezelbash_2016.found import (
    asked_for,
    bent_sideways,
    filled,
    forward,
    task_named,
)
from spinepipe.studies.trunk_loads.ghezelbash_2016.paper import (
    OTHER_MODEL,
    PAPER,
    VOLUNTEER,
    YES_NO,
    Value,
    near,
    put_in,
)

MODEL, PRESCRIBED = PAPER["model"], PAPER["prescribed"]

_SIDEWAYS = 0.5
_WHY_SIDEWAYS = "sideways turns of bodies that lean forwards or backwards do not add exactly"


def claims_of_rotations_and_settings() -> Iterator[Claim]:
    """Rotations of section 2.6, how they are shared, and numbers of the method."""
    yield from _rotations()
    yield from _partition()
    yield from _settings()


def _rotations() -> Iterator[Claim]:
    for body, value in zip(PRESCRIBED["bodies"], PRESCRIBED["task_3_deg"], strict=True):
        yield _prescribed(3, body, float(value), f"{body}_extension_deg")
    yield _prescribed(8, "trunk", float(PRESCRIBED["task_8_deg"]), "trunk_extension_deg")
    for number in (10, 11):
        for body, column in (("T11", "trunk_extension_deg"), ("S1", "pelvis_extension_deg")):
            yield _prescribed(number, body, float(PRESCRIBED[f"task_{number}_deg"][body]), column)
    value = float(PAPER["partition"]["sacral_lateral_deg"])
    for key in ("prescribed.task_9.S1", "results.sacral_lateral_rotation_max"):
        yield put_in(
            key,
            "2.6",
            "lateral bending of the pelvis as the trunk bends by 20 deg",
            "deg",
            value,
            _pelvis_sideways,
            near(value, _SIDEWAYS, _WHY_SIDEWAYS),
        )


def _prescribed(number: int, body: str, value: float, column: str) -> Claim:
    return put_in(
        f"prescribed.task_{number}.{body}",
        "2.6",
        f"extension of {body}, task {number}",
        "deg",
        value,
        asked_for(column, number),
    )


def _turned(run: Run, task: str, column: str) -> "pd.Series[float]":
    """By how much more each joint is turned in a task of the volunteer than upright, deg."""
    found = []
    for name in (task, task_named(run, 1)):
        rows = run.rows("levels", specimen=VOLUNTEER, task=name)
        found.append(filled(rows, column).set_axis(rows["level"]))
    return found[0] - found[1]


def _pelvis_sideways(run: Run) -> Ours:
    row = bent_sideways(run, 20.0)
    joints = _turned(run, str(row["task"]), "right_bending_deg").sum()
    return Ours(abs(float(row["trunk_right_bending_deg"]) - float(joints)))


def _partition() -> Iterator[Claim]:
    """Shares as the joints turned; those of flexion sum to 99.9 % and are made to sum to 100."""
    partition = PAPER["partition"]
    for name, of, allowed, why in (
        ("flexion", "forward flexion", 0.1, "one decimal, and 99.9 % made 100"),
        ("lateral", "lateral bending", _SIDEWAYS, _WHY_SIDEWAYS),
    ):
        printed = partition[f"{name}_percent"]
        for joint, value in zip(partition["joints"], printed, strict=True):
            yield put_in(
                f"partition.{joint}.{name}_percent",
                "2.6",
                f"share of {joint} in {of}",
                "%",
                float(value),
                _share(joint, name),
                near(float(value), allowed, why),
            )


def _share(joint: str, name: str) -> Value:
    def ours(run: Run) -> Ours:
        if name == "flexion":
            far, column = str(forward(run, VOLUNTEER).iloc[-1]["task"]), "extension_deg"
        else:
            far, column = str(bent_sideways(run, 20.0)["task"]), "right_bending_deg"
        turned = _turned(run, far, column)
        if joint not in turned.index or turned.sum() == 0.0:
            raise NotComputed(f"this run's table levels has no turn of {joint} in {far}")
        return Ours(float(100.0 * turned[joint] / turned.sum()))

    return ours


def _settings() -> Iterator[Claim]:
    for key, where, quantity, unit, paper, name in (
        (
            "bending_increase_T11T12",
            "2.1",
            "bending stiffness of T11T12 more than by disc area and height",
            "%",
            MODEL["bending_increase_percent"],
            "t11t12_bending_percent",
        ),
        (
            "beam_posterior_shift",
            "2.1",
            "joints behind the discs' centres",
            "mm",
            MODEL["joints_behind_mm"],
            "joints_behind_mm",
        ),
        (
            "convergence",
            "2.4",
            "change of muscle forces below which they have settled",
            "%",
            MODEL["convergence_percent"],
            "change_percent",
        ),
        (
            "iap_lever_arm",
            "2.8",
            "push on the diaphragm, ahead of T11",
            "cm",
            MODEL["pressure_ahead_cm"],
            "pressure_ahead_cm",
        ),
        (
            "reference_age",
            "3.2",
            "age of the reference person",
            "years",
            PAPER["reference"]["age_years"],
            "reference_age_years",
        ),
        (
            "reference_height",
            "3.2",
            "height of the reference person",
            "cm",
            PAPER["reference"]["height_cm"],
            "reference_height_cm",
        ),
        (
            "reference_mass",
            "3.2",
            "mass of the reference person",
            "kg",
            PAPER["reference"]["mass_kg"],
            "reference_mass_kg",
        ),
        (
            "reference_sex",
            "3.2",
            "the reference person is male",
            YES_NO,
            1.0,
            "reference_male",
        ),
    ):
        yield put_in(f"results.{key}", where, quantity, unit, float(paper), _setting(name))
    yield put_in(
        "results.deformable_segments",
        "2.1",
        "joints that turn, T11T12 to L5S1",
        "count",
        float(MODEL["deformable_segments"]),
        lambda run: Ours(float(run.rows("levels")["level"].nunique())),
    )
    yield from _stresses()
    yield Claim(
        "results.n_muscles",
        "2.2",
        "fascicles of a person",
        "count",
        float(MODEL["muscles"]),
        exactly(float(MODEL["muscles"])),
        lambda run: Ours(float(run.rows("muscles", specimen=VOLUNTEER)["muscle"].nunique())),
        OTHER_MODEL,
    )


def _setting(name: str) -> Value:
    def ours(run: Run) -> Ours:
        if run.asked.get(name) is None:
            raise NotComputed(f"this study states no {name.replace('_', ' ')}")
        return Ours(float(run.asked[name]))

    return ours


def _stresses() -> Iterator[Claim]:
    for key, value, of, of_demanding in (
        ("sigma_max", MODEL["stress_mpa"], "other tasks of Table 1", False),
        ("sigma_max_demanding", MODEL["stress_demanding_mpa"], "tasks 3, 8, 10-12", True),
    ):
        yield put_in(
            f"results.{key}",
            "2.4",
            f"largest active stress, {of}, the one farthest from the paper's",
            "MPa",
            float(value),
            _stress(float(value), of_demanding),
        )


def _stress(paper: float, of_demanding: bool) -> Value:
    def ours(run: Run) -> Ours:
        rows = run.rows("tasks")
        number = pd.to_numeric(rows["number"], errors="coerce").astype(float)
        demanding = number.isin([float(one) for one in MODEL["demanding_tasks"]])
        chosen = rows[number.notna() & (demanding == of_demanding)]
        if chosen.empty:
            raise NotComputed("this run's table tasks has none of these tasks")
        stress = filled(chosen, "largest_stress_mpa")
        return Ours(float(stress.iloc[(stress - paper).abs().argmax()]))

    return ours
