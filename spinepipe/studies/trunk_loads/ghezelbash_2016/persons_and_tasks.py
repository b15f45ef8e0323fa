"""What the paper asked for, beside what this cohort asks for: persons and tasks.

Circular where it agrees. Angles are read from results, so that what a study makes of an angle
(measured at the thorax, or that of T11) shows.
"""

from collections.abc import Iterator

import pandas as pd

from spinepipe.comparison.claim import Claim, NotComputed, Ours, Run, exactly
from spinepipe.studies.trunk_loads.ghezelbash_2016.found import (
    ASKED,
    SUBJECTS,
    asked_for,
    bent_sideways,
    filled,
    numbered,
    of_task,
)
from spinepipe.studies.trunk_loads.ghezelbash_2016.paper import (
    NO_EQ_4_5,
    PAPER,
    PERSONS,
    VOLUNTEER,
    YES_NO,
    Value,
    missing,
    near,
    put_in,
    rounded,
)

TABLE_1, MODEL = PAPER["table_1"], PAPER["model"]

_LEANING = "this study takes the angle for one measured at the thorax, and T11 turns less"
_AS_PERSON = "what the person exerts; on the trunk it acts the other way"
_DEG = 0.05
"""Half the last digit of printed angles."""


def claims_of_persons_and_tasks() -> Iterator[Claim]:
    """Persons, tasks of Table 1 and what exertions and cases of Table 3 ask for."""
    yield from _persons()
    yield from _tasks()
    yield from _exertions()


def _persons() -> Iterator[Claim]:
    for person, facts in PAPER["persons"].items():
        for column, unit in (("age_years", "years"), ("mass_kg", "kg"), ("height_cm", "cm")):
            value = float(facts[column])
            name = f"{facts['prefix']}_{column.split('_')[0]}"
            yield put_in(
                f"results.{name}",
                facts["where"],
                f"{column.split('_')[0]} of {person}",
                unit,
                value,
                _of_person(column, person),
            )
    for key, person in PERSONS.items():
        facts = PAPER["table_2"][key]
        for name, column, factor, unit, digit in (
            ("age_years", "age_years", 1.0, "years", 1.0),
            ("height_m", "height_cm", 0.01, "m", 0.01),
            ("mass_kg", "mass_kg", 1.0, "kg", 1.0),
        ):
            yield put_in(
                f"table_2.{key}.{name}",
                "Table 2",
                f"{name.split('_')[0]} of {person}",
                unit,
                float(facts[name]),
                _of_person(column, person, factor),
                rounded(float(facts[name]), digit),
            )
        yield put_in(
            f"table_2.{key}.sex",
            "Table 2",
            f"{person} is male",
            YES_NO,
            1.0,
            _is_male(person),
            exactly(1.0),
        )


def _is_male(person: str) -> Value:
    return lambda run: Ours(float(run.row(SUBJECTS, specimen=person)["sex"] == "male"))


def _of_person(column: str, person: str, factor: float = 1.0) -> Value:
    return lambda run: Ours(factor * run.number(SUBJECTS, column, specimen=person))


def _tasks() -> Iterator[Claim]:
    for number, kg in TABLE_1["loaded"].items():
        yield put_in(
            f"table_1.task_{number}.hand_load_kg",
            "Table 1",
            f"load in the hands, task {number}",
            "kg",
            float(kg),
            of_task("hand_load_kg", int(number)),
        )
    for number, degrees in TABLE_1["flexion_deg"].items():
        yield put_in(
            f"table_1.task_{number}.trunk_flexion_deg",
            "Table 1",
            f"flexion of T11 from upright, task {number}",
            "deg",
            float(degrees),
            of_task("trunk_extension_deg", int(number), -1.0),
            near(float(degrees), _DEG, "one decimal"),
            _LEANING,
        )
    for degrees in TABLE_1["lateral_deg"]["9"]:
        yield put_in(
            f"table_1.task_9.trunk_lateral_deg.{degrees}",
            "Table 1",
            "lateral bending of T11 from upright, task 9",
            "deg",
            float(degrees),
            _bent(float(degrees)),
            near(float(degrees), _DEG, "one decimal"),
        )
    yield put_in(
        "table_1.task_7.steps",
        "Table 1",
        "steps of forward flexion, task 7",
        "count",
        float(TABLE_1["flexion_steps"]),
        lambda run: Ours(float(numbered(run, 7)["task"].nunique())),
    )
    yield put_in(
        "table_1.task_7.step_deg",
        "Table 1",
        "angle between steps, task 7, largest",
        "deg",
        float(TABLE_1["flexion_step_deg"]),
        _largest_step,
        near(float(TABLE_1["flexion_step_deg"]), _DEG, "one decimal"),
        _LEANING,
    )
    value = float(PAPER["validation"]["largest_flexion_deg"])
    yield put_in(
        "results.peak_trunk_flexion",
        "3.3",
        "largest flexion of T11 of all tasks",
        "deg",
        value,
        lambda run: Ours(float(-filled(run.rows("tasks"), "trunk_extension_deg").min())),
        rounded(value, 1.0),
        _LEANING,
    )


def _bent(degrees: float) -> Value:
    return lambda run: Ours(abs(float(bent_sideways(run, degrees)["trunk_right_bending_deg"])))


def _largest_step(run: Run) -> Ours:
    flexion = -filled(numbered(run, 7, specimen=VOLUNTEER), "trunk_extension_deg")
    if len(flexion) < 2:
        raise NotComputed("task 7 has one step alone")
    return Ours(float(flexion.sort_values().diff().max()))


def _exertions() -> Iterator[Claim]:
    for key, number, axis, sign, value in (
        ("task_10", 10, "extension", -1.0, TABLE_1["extension_moment_nm"]),
        ("task_11", 11, "extension", 1.0, TABLE_1["flexion_moment_nm"]),
        ("task_12.left_rotation", 12, "left_rotation", 1.0, TABLE_1["torsion_nm"]["left_rotation"]),
        (
            "task_12.right_bending",
            12,
            "right_bending",
            -1.0,
            TABLE_1["torsion_nm"]["right_bending"],
        ),
        ("task_12.extension", 12, "extension", 1.0, TABLE_1["torsion_nm"]["extension"]),
    ):
        yield put_in(
            f"table_1.{key}.moment_nm",
            "Table 1",
            f"moment about the axis of {axis.replace('_', ' ')}, task {number}",
            "N m",
            float(value),
            asked_for(f"push_{axis}_nm", number, sign),
            note=_AS_PERSON,
        )
    for number, vertebra in MODEL["pushed_at"].items():
        yield put_in(
            {
                "10": "results.mve_force_level_extension",
                "11": "results.mve_force_level_flexion",
                "12": "results.mve_torque_level",
            }[number],
            "2.9",
            f"task {number} pushes at {vertebra}",
            YES_NO,
            1.0,
            _pushed_at(int(number), vertebra),
            exactly(1.0),
        )
    for name, column in (("lateral", "hands_right_mm"), ("anterior", "hands_anterior_mm")):
        value = float(MODEL[f"load_{name}_cm"])
        key = {"lateral": "lateral", "anterior": "ap"}[name]
        yield put_in(
            f"results.asymmetric_load_{key}",
            "2.9",
            f"load from L5S1, {name}, task 8",
            "cm",
            value,
            _far(column),
        )
    yield from _cases()


def _pushed_at(number: int, vertebra: str) -> Value:
    return lambda run: Ours(float(numbered(run, number, ASKED).iloc[0]["applied_at"] == vertebra))


def _far(column: str) -> Value:
    return lambda run: Ours(abs(asked_for(column, 8, 0.1)(run).value))


def _cases() -> Iterator[Claim]:
    """Table 3: pressures and co-activation that were put in; shear and EMG have no counterpart."""
    for number, row in ((10, PAPER["table_3"]["10"]), (11, PAPER["table_3"]["11"])):
        for at, case in enumerate(PAPER["table_3"]["cases"]):
            key, of = f"table_3.task_{number}.{case}", f"task {number}, case {case}"
            kpa, nm = float(row["iap_kpa"][at]), float(row["coactivation_nm"][at])
            yield put_in(
                f"{key}.iap_kpa",
                "Table 3",
                f"pressure in the abdomen, {of}",
                "kPa",
                kpa,
                _pressure_asked(number, kpa),
            )
            what = f"moment of antagonists, {of}"
            if nm:
                yield missing(f"{key}.coactivation_nm", "Table 3", what, "N m", nm, NO_EQ_4_5)
            else:
                yield put_in(f"{key}.coactivation_nm", "Table 3", what, "N m", nm, _no_tone(number))
            for name in ("t11", "t12"):
                values = row[f"shear_{name}_n"]
                if at < len(values):
                    yield missing(
                        f"{key}.shear_{name.upper()}_n",
                        "Table 3",
                        f"shear of {name.upper()} that is asked for, {of}",
                        "N",
                        float(values[at]),
                        NO_EQ_4_5,
                    )
    for number, name in ((10, "extension"), (11, "flexion")):
        value = float(PAPER["table_3"][str(number)]["iap_kpa"][-1])
        yield put_in(
            f"results.iap_{name}",
            "2.8, Table 3",
            f"pressure in the abdomen, exertion in {name}",
            "kPa",
            value,
            _pressure_asked(number, value),
        )


def _pressure_asked(number: int, kpa: float) -> Value:
    """Whichever pressure is nearest, of the tasks that push as the one of a number does.

    Only case I of Table 3 has the number itself: what the others ask of antagonists, no task can.
    """

    def ours(run: Run) -> Ours:
        push = asked_for("push_extension_nm", number)(run).value
        rows = run.rows(ASKED, push_extension_nm=push)
        asked = pd.to_numeric(rows["intra_abdominal_pressure_kpa"], errors="coerce").fillna(0.0)
        at = int((asked - kpa).abs().to_numpy().argmin())
        return Ours(float(asked.iloc[at]), note=f"ours: task {rows.iloc[at]['task']}")

    return ours


def _no_tone(number: int) -> Value:
    """Nought where no muscle is told to pull, which is all that a task can say."""

    def ours(run: Run) -> Ours:
        asked = numbered(run, number, ASKED).iloc[0]["tone"]
        if not (pd.isna(asked) or asked == "none"):
            raise NotComputed(f"task {number} has tone {asked}, whose moment no table holds")
        return Ours(0.0)

    return ours
