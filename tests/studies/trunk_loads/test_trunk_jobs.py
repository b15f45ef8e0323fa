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
from spinepipe.muscles.strength import hold_task
from spinepipe.progress import Progress
from spinepipe.status import HELD, Balanced
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


def test_rows_tell_the_stress_that_a_task_takes_and_why_it_is_not_held() -> None:
    whole = volunteers()
    asked = whole.further["tasks"]
    chosen = asked[asked["task"].isin(["standing", "load_close", "exertion_extension"])]
    weaker = chosen.assign(largest_stress_mpa=[0.6, 0.3, 1.0], tone=pd.NA)
    cohort = replace(whole, further={**whole.further, "tasks": weaker.reset_index(drop=True)})
    rows = {
        row["task"]: row for row in hold.rows_of(ASKED, cohort, "volunteer", Progress())["tasks"]
    }
    standing, above, beyond = (rows[name] for name in chosen["task"])
    assert standing["status"] == Balanced.CONVERGED
    assert 0.0 < standing["least_stress_mpa"] < 0.6
    assert above["status"] == Balanced.CONVERGED_ABOVE
    assert 0.3 == above["largest_stress_mpa"] < above["least_stress_mpa"] <= 1.3
    assert above["highest_stress_mpa"] == pytest.approx(above["least_stress_mpa"], rel=0.03)
    assert above["strength_used"] > 1.0, "of the strength at the stress asked for"
    assert (beyond["status"], beyond["short_of"]) == (Balanced.BEYOND_STRENGTH, "strength")
    assert beyond["least_stress_mpa"] > 1.3
    assert beyond["short_at"] in beyond["message"]


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


def test_samples_that_no_forces_hold_count_beyond_the_upper_end() -> None:
    rows = additive({"bmi": 1.0})
    one = rows[rows["task"] == "standing"].sort_values(QUANTITIES[0])
    known = np.sort(one[QUANTITIES[0]].to_numpy(float))
    nominal = pd.DataFrame([task_of("volunteer", "standing")])

    def interval(lost: int, above: int = 0, sign: float = 1.0) -> dict[str, Any]:
        """The highest so many do not hold, and so many below them take more stress."""
        own = one.assign(**{QUANTITIES[0]: sign * one[QUANTITIES[0]]})
        n = len(own)
        status = own["status"].to_numpy(object).copy()
        status[n - lost - above : n - lost] = Balanced.CONVERGED_ABOVE.value
        status[n - lost :] = Balanced.BEYOND_STRENGTH.value
        own = own.assign(status=status)
        return next(iter(spread._intervals("volunteer", "standing", own, nominal)))

    n, ends = len(known), np.quantile(known, [0.025, 0.5, 0.975]).tolist()
    for lost, above in ((0, 0), (0, 40), (n // 50, 10)):
        found = interval(lost, above)
        assert [found[end] for end in ("low", "median", "high")] == pytest.approx(ends)
        assert (found["n_samples"], found["n_failed"]) == (n - lost, lost)
        assert found["n_above"] == above
    tenth = interval(n // 10)
    assert [tenth["low"], tenth["median"]] == pytest.approx(ends[:2]), "as if they were known"
    assert tenth["high"] is None
    backwards = interval(n // 10, sign=-1.0)
    assert [backwards["median"], backwards["high"]] == pytest.approx([-ends[1], -ends[0]])
    assert backwards["low"] is None, "a shear backwards fails at its lower end"
    most = interval(n - 30)
    assert (most["median"], most["high"]) == (None, None)
    assert interval(n - 10)["low"] is None, "too few are left to tell"


def test_the_generic_male_holds_tasks_1_to_9() -> None:
    """At no more stress than trunks of people have, 1.0 MPa."""
    place = need_male()
    names = ("muscles", "muscle_parameters", "joints", "body_frames")
    tables = SpecimenTables(*(pd.read_csv(place / f"{name}.csv") for name in names))
    trunk = source_of_folder("thoracolumbar_male", tables, 1.0e6).trunk
    person = person_of(trunk, subject_of(volunteers(), "volunteer"))
    asked = {name: task for name, task in tasks().items() if task.number in range(1, 10)}
    assert {task.number for task in asked.values()} == set(range(1, 10))
    for name, task in asked.items():
        held = hold_task(person, task, solver_options(SETTINGS))
        assert held.solved.status in HELD, name
        assert held.least_pa is not None
        assert held.least_pa <= 1.0e6, name
