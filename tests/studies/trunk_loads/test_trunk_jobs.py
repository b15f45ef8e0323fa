"""Rows of the jobs: they agree with one another, and what cannot be done is a row of its own."""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pandas as pd
import pytest
from installed import need_male
from scipy.stats import norm
from trunk_person import SETTINGS, person_of, tasks, volunteers

from spinepipe.cohort import Cohort
from spinepipe.muscles.folder import SpecimenTables, source_of_folder
from spinepipe.muscles.muscle_equilibrium import solve_task
from spinepipe.progress import Progress
from spinepipe.status import Balanced
from spinepipe.studies.subjects import subject_of
from spinepipe.studies.trunk_loads import hold, respond, simplify, spread, tune
from spinepipe.studies.trunk_loads.persons import solver_options, source_of
from spinepipe.studies.trunk_loads.sampling import design_of
from spinepipe.studies.trunk_loads.settings import Uncertain, VolunteerSettings
from spinepipe.studies.trunk_loads.tables import QUANTITIES, SIMPLIFICATIONS

FEW = ("standing", "flexion_50", "flexion_70_with_load")
ASKED = SETTINGS.model_copy(
    update={
        "simplified_tasks": ("flexion_50",),
        "uncertain": Uncertain(tasks=("standing", "flexion_70_with_load"), samples=64),
        "volunteer": VolunteerSettings(specimen="volunteer"),
    }
)


@cache
def few() -> Cohort:
    """The cohort that comes along, with three tasks."""
    whole = volunteers()
    tasks = whole.further["tasks"]
    kept = tasks[tasks["task"].isin(FEW)].reset_index(drop=True)
    return replace(whole, further={**whole.further, "tasks": kept})


@cache
def held_rows(specimen: str) -> Mapping[str, list[dict[str, Any]]]:
    return hold.rows_of(ASKED, few(), specimen, Progress())


def task_of(specimen: str, task: str) -> dict[str, Any]:
    (row,) = [row for row in held_rows(specimen)["tasks"] if row["task"] == task]
    return row


def test_every_task_has_its_rows_and_every_kilogram_its_place() -> None:
    rows = held_rows("volunteer")
    assert [row["task"] for row in rows["tasks"]] == list(FEW)
    for table, each in (("levels", 7), ("muscles", 234)):
        assert len(rows[table]) == each * len(FEW)
    assert sum(row["mass_kg"] for row in rows["masses"]) == pytest.approx(72.0, rel=1e-9)
    assert rows["remarks"]
    assert {row["task"] for row in rows["paths"]} == {FEW[0]}


def test_what_is_out_of_reach_is_a_row_with_a_reason() -> None:
    row = task_of("woman", "flexion_70_with_load")
    assert row["status"] not in ("", Balanced.CONVERGED)
    assert row["message"]
    numbers = [value for value in row.values() if isinstance(value, float)]
    assert np.isfinite(numbers).all()


def test_the_whole_model_beside_the_simplified_ones_is_the_model() -> None:
    rows = {row["simplification"]: row for row in simplify.rows_of(ASKED, few(), "volunteer")}
    assert set(rows) == set(SIMPLIFICATIONS)
    own = task_of("volunteer", "flexion_50")
    assert rows["none"]["imbalance_nm"] < ASKED.solving.slack_nm
    for column in ("l4l5_pressure_mpa", "l5s1_compression_n"):
        assert rows["none"][column] == pytest.approx(own[column], rel=0.02)
    wrong = [row for name, row in rows.items() if name != "none"]
    assert all(row["imbalance_nm"] > 3.0 * rows["none"]["imbalance_nm"] for row in wrong)


def test_a_sample_that_changes_nothing_is_the_person() -> None:
    samples: Mapping[int, Mapping[str, float]] = {0: {}, 1: {"hand_anterior_mm": 900.0}}
    rows = list(respond.rows_of(ASKED, few(), "volunteer", samples, Progress()))
    assert [(row["sample"], row["task"]) for row in rows] == [
        (sample, task) for sample in samples for task in ASKED.uncertain.tasks
    ]
    for row in rows[:2]:
        own = task_of("volunteer", row["task"])
        assert row["l4l5_pressure_mpa"] == pytest.approx(own["l4l5_pressure_mpa"], rel=0.02)
    too_far = rows[3]
    assert too_far["status"] != Balanced.CONVERGED
    assert too_far["message"]


def test_numbers_that_made_the_pressures_are_found_again() -> None:
    who = tune.volunteer_of(ASKED, few(), source_of(ASKED, few()).trunk)
    hidden = {"passive_rotation": 1.2, "disc_area": 1.15}
    made = who.computed(hidden)
    beside = tuple(replace(one, mpa=made[one.task][0], counted=True) for one in who.beside)
    blind = replace(who, beside=beside)
    found, bound = tune.fit_from_corners(blind, tuple(hidden), beside)
    assert not bound.any()
    np.testing.assert_allclose(found, list(hidden.values()), atol=0.02)


class Straight:
    """A volunteer whose errors (6,) MPa grow evenly with two numbers."""

    def __init__(self, slopes: np.ndarray, at_zero: np.ndarray) -> None:
        self.slopes, self.at_zero = slopes, at_zero

    def errors(self, values: Mapping[str, float], wanted: object) -> np.ndarray:
        return self.slopes @ np.array(list(values.values())) + self.at_zero


def test_a_fitted_number_goes_as_far_as_the_errors_of_a_straight_line_allow() -> None:
    """Least squares' own t intervals; a number that moves no pressure is open on both sides."""
    rng, names = np.random.default_rng(1), ("passive_rotation", "disc_area")
    slopes = np.column_stack([np.linspace(-1.0, 1.0, 6), np.linspace(0.2, 1.0, 6) ** 2])
    at_zero = -slopes @ [1.0, 1.1] + 0.02 * rng.normal(size=6)
    best = np.linalg.lstsq(slopes, -at_zero, rcond=None)[0]
    line: Any = Straight(slopes, at_zero)
    six: Any = [None] * 6
    found = tune.regions(line, names, six, best)
    assert found is not None
    assert found.closed.all()
    left = slopes @ best + at_zero
    sds = np.sqrt(left @ left / 4.0 * np.diag(np.linalg.inv(slopes.T @ slopes)))
    reach = 2.776445 * sds  # Student's t of 4 degrees of freedom, 97.5 %
    np.testing.assert_allclose(found.high - best, reach, rtol=0.03)
    np.testing.assert_allclose(best - found.low, reach, rtol=0.03)
    slopes[:, 1] = 0.0
    best = np.array([np.linalg.lstsq(slopes[:, :1], -at_zero, rcond=None)[0][0], 1.0])
    blind: Any = Straight(slopes, at_zero)
    found = tune.regions(blind, names, six, best)
    assert found is not None
    assert (found.open_below[1], found.open_above[1]) == (True, True)
    assert tune.regions(line, names, six[:2], best) is None


def additive(weights: Mapping[str, float]) -> pd.DataFrame:
    """Answers that add up their inputs, standardised: shares of variance are weights squared."""
    design = design_of(ASKED)
    z = norm.ppf(np.clip(design.unit, 1e-6, 1 - 1e-6))
    total = sum(weights.get(name, 0.0) * z[:, k] for k, name in enumerate(design.factors))
    rows = []
    for sample, value in enumerate(np.asarray(total).tolist()):
        rows += [
            {
                "specimen": "volunteer",
                "task": task,
                "sample": sample,
                **dict.fromkeys(QUANTITIES, 10.0 + value),
                "status": Balanced.CONVERGED.value,
            }
            for task in ASKED.uncertain.tasks
        ]
    return pd.DataFrame(rows)


def test_shares_of_what_drives_an_answer() -> None:
    weights = {"bmi": 2.0, "disc_area": 1.0}
    rows = additive(weights)
    one = rows[rows["task"] == "standing"]
    found = pd.DataFrame(list(spread._drivers(ASKED, "volunteer", "standing", one)))
    total = found[found["quantity"] == QUANTITIES[0]].set_index("factor")["total"]
    assert total["bmi"] == pytest.approx(0.8, abs=0.1)
    assert total["disc_area"] == pytest.approx(0.2, abs=0.05)
    assert total.drop(list(weights)).abs().max() < 1e-9


def test_intervals_count_what_failed_and_need_enough_samples() -> None:
    rows = additive({"bmi": 1.0})
    rows.loc[rows.index[:40], "status"] = Balanced.BEYOND_STRENGTH.value
    many = rows.copy()
    many.loc[many.index[: len(many) // 2], "status"] = Balanced.BEYOND_STRENGTH.value
    nominal = pd.DataFrame([task_of("volunteer", "standing")])
    one = rows[rows["task"] == "standing"]
    (first, *_) = list(spread._intervals("volunteer", "standing", one, nominal))
    assert first["n_failed"] == 20
    assert first["n_samples"] == len(one) - 20
    assert first["low"] == pytest.approx(10.0 - 1.96, abs=0.3)
    assert first["high"] == pytest.approx(10.0 + 1.96, abs=0.3)
    half = many[many["task"] == "standing"]
    (lost, *_) = list(spread._intervals("volunteer", "standing", half, nominal))
    assert lost["n_samples"] > spread.LEAST_SAMPLES
    assert lost["low"] is None
    (few_left, *_) = list(spread._intervals("volunteer", "standing", one.head(30), nominal))
    assert few_left["n_samples"] < spread.LEAST_SAMPLES
    assert few_left["low"] is None


def test_the_generic_male_holds_tasks_1_to_9() -> None:
    """Slack at most 0.5 N m at every level at the stated stress; but bent as far as can be, where
    stretched muscles pull him back by 2 N m more at T12L1 than those in front can hold."""
    place = need_male()
    names = ("muscles", "muscle_parameters", "joints", "body_frames")
    tables = SpecimenTables(*(pd.read_csv(place / f"{name}.csv") for name in names))
    trunk = source_of_folder("thoracolumbar_male", tables, 1.0e6).trunk
    person = person_of(trunk, subject_of(volunteers(), "volunteer"))
    asked = {name: task for name, task in tasks().items() if task.number in range(1, 10)}
    assert {task.number for task in asked.values()} == set(range(1, 10))
    for name, task in asked.items():
        slack = np.abs(solve_task(person, task, solver_options(SETTINGS)).found.slack)
        assert slack.max() <= (2.5 if name == "full_flexion" else 0.5), name
