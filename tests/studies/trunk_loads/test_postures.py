"""From rows of tasks to rotations: sums, signs, what the paper prescribes, and mirrored tasks."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from spinepipe import cohort as cohorts
from spinepipe.documents.yaml_text import YamlDocument
from spinepipe.muscles.task import Task
from spinepipe.studies.subjects import SUBJECTS
from spinepipe.studies.trunk_loads.checks import check_trunk
from spinepipe.studies.trunk_loads.forms import HANDS, PUSH_N, PUSH_NM, TASKS
from spinepipe.studies.trunk_loads.postures import (
    FULL_FLEXION_DEG,
    between,
    leaning_deg,
    read_tasks,
    rhythm,
    shares,
    task_of,
)
from spinepipe.studies.trunk_loads.settings import TrunkLoads
from spinepipe.units import ROTATIONS

FOLDER = Path(__file__).parents[3] / "config/cohorts/trunk_volunteers"
ROUNDING = 1e-9
"""Sums of eight numbers of order 100 in doubles."""


@pytest.fixture(scope="module")
def cohort() -> cohorts.Cohort:
    return cohorts.read(FOLDER, (SUBJECTS, TASKS))


@pytest.fixture(scope="module")
def tasks(cohort: cohorts.Cohort) -> dict[str, Task]:
    return read_tasks(cohort, "measured_at_thorax")


def made(**cells: object) -> Task:
    """The task of a row with these cells, the others empty."""
    row: dict[str, object] = dict.fromkeys(TASKS.names, float("nan"))
    return task_of(row | {"task": "made"} | cells, "rotation_of_t11")


def degrees(task: Task, axis: str = "extension") -> list[float]:
    """Rotation of each body, S1 to T11."""
    found: list[float] = np.rad2deg(task.turned[:, ROTATIONS.index(axis)]).tolist()
    return found


def test_volunteers_and_their_tasks_are_sound(cohort: cohorts.Cohort) -> None:
    study = TrunkLoads.model_validate({"study": "s", "kind": "trunk_loads", "cohort": "c"})
    assert list(check_trunk(YamlDocument("s.yaml", {}, {}), study, cohort)) == []


def test_all_twelve_tasks_of_table_1_are_there(tasks: dict[str, Task]) -> None:
    assert {task.number for task in tasks.values()} == {*range(1, 13), None}


SIDEWAYS = (8.3, 2.8, 9.4, 18.3, 22.8, 25.6, 12.8)


@pytest.mark.parametrize(
    ("axis", "printed", "total"),
    [
        ("extension", (6.0, 10.9, 14.1, 13.2, 16.9, 20.1, 18.7), 99.9),
        *(("right_bending", SIDEWAYS, 100.0), ("left_rotation", SIDEWAYS, 100.0)),
    ],
)
def test_shares_are_those_printed_made_to_sum_to_one(
    axis: str, printed: tuple[float, ...], total: float
) -> None:
    """Ghezelbash 2016, 2.6, T11T12 to L5S1; axial rotation has none of its own."""
    assert sum(printed) == pytest.approx(total)
    assert shares(axis)[::-1] * total == pytest.approx(printed, abs=ROUNDING)
    assert shares(axis).sum() == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("axis", ROTATIONS)
def test_levels_sum_to_trunk_less_pelvis(axis: str) -> None:
    turned = between(3.0, -40.0, axis)
    assert turned[[0, -1]] == pytest.approx([3.0, -40.0], abs=ROUNDING)
    assert np.diff(turned) == pytest.approx(-43.0 * shares(axis), abs=ROUNDING)


def test_a_pelvis_may_move_under_a_trunk_that_stays() -> None:
    moved = between(-16.0, -50.0, "extension") + between(4.0, 0.0, "extension")
    assert moved == pytest.approx(between(-12.0, -50.0, "extension"), abs=ROUNDING)


@pytest.mark.parametrize(
    ("thorax", "pelvis", "lumbar"),
    [(10, 2.6, 6.8), (50, 15.9, 30.9), (107.3, 43.3, 57.1), (121, 51.2, 62.0)],
)
def test_rhythm_is_that_of_the_means_of_tafazzol(
    thorax: float, pelvis: float, lumbar: float
) -> None:
    """By hand from the ratios 2.51 and 1.34 and the peaks 121, 53.0 and 60.2, to 0.1 deg."""
    of_pelvis, of_t11 = rhythm(-thorax, "measured_at_thorax")
    assert (of_pelvis, of_t11 - of_pelvis) == pytest.approx((-pelvis, -lumbar), abs=0.06)


def test_ratio_of_lumbar_to_pelvis_falls_as_measured() -> None:
    for thorax, ratio in ((-15.0, 2.51), (-105.0, 1.34)):
        pelvis, t11 = rhythm(thorax, "measured_at_thorax")
        assert (t11 - pelvis) / pelvis == pytest.approx(ratio, rel=1e-9)


def test_both_meanings_of_the_angle_are_one_posture() -> None:
    seen = rhythm(-50.0, "measured_at_thorax")
    assert seen[1] == pytest.approx(-50.0 * (53.0 + 60.2) / 121.0, abs=ROUNDING)
    assert rhythm(seen[1], "rotation_of_t11") == pytest.approx(seen, abs=ROUNDING)
    assert rhythm(-50.0, "rotation_of_t11")[1] == pytest.approx(-50.0, abs=ROUNDING)


def test_prescribed_rotations_of_task_3(tasks: dict[str, Task]) -> None:
    """Ghezelbash 2016, 2.6, S1 to T11, extension positive, on the undeformed posture."""
    task = tasks["load_away"]
    assert degrees(task) == pytest.approx([4.9, 4.9, 9.9, 14.5, 15.8, 10.9, 4.0, -2.0])
    assert not task.from_upright
    assert task.stress_pa == 1.0e6


@pytest.mark.parametrize(
    ("name", "t11", "s1", "external_nm", "at"),
    [
        ("exertion_extension", 9.0, 16.0, -242.0, "T8"),
        ("exertion_flexion", -13.0, 13.0, 151.0, "T6"),
    ],
)
def test_exertions_of_tasks_10_and_11(
    tasks: dict[str, Task], name: str, t11: float, s1: float, external_nm: float, at: str
) -> None:
    """Ghezelbash 2016, 2.6 and 2.9; what a person exerts is resisted by the opposite."""
    task = tasks[name]
    found = degrees(task)
    assert (found[0], found[-1]) == pytest.approx((s1, t11))
    flexed = np.diff(found) / (t11 - s1)
    assert flexed * 99.9 == pytest.approx([18.7, 20.1, 16.9, 13.2, 14.1, 10.9, 6.0], abs=1e-6)
    assert task.exertion.moment.tolist() == [0.0, 0.0, external_nm]
    assert (task.exertion.at, task.exertion.as_force, task.pressure_pa) == (at, True, 0.0)


def test_torsion_of_task_12_is_held_by_the_opposite(tasks: dict[str, Task]) -> None:
    """Exerted: 78.3 N m to the right, 21.1 to the right side, 16.7 forwards; about x, y and z."""
    exertion = tasks["exertion_torsion"].exertion
    assert exertion.moment.tolist() == [-21.1, 78.3, 16.7]
    assert (exertion.at, exertion.as_force) == ("T9", False)


def test_side_bending_turns_the_sacrum_a_tenth_as_far(tasks: dict[str, Task]) -> None:
    found = degrees(tasks["side_20"], "right_bending")
    assert (found[0], found[-1]) == pytest.approx((2.0, 20.0))
    assert degrees(tasks["side_20"]) == [0.0] * 8


def test_bending_forwards_is_negative_and_grows_upwards(tasks: dict[str, Task]) -> None:
    for angle in range(10, 101, 10):
        found = np.array(degrees(tasks[f"forward_{angle}"]))
        assert (found < 0.0).all()
        assert (np.diff(found) < 0.0).all()


def _mirrored(cells: Mapping[str, float | str]) -> dict[str, float | str]:
    """The same to the other side."""
    other = {"right": "left", "left": "right"}
    across = (HANDS[2], PUSH_N[2], PUSH_NM[1], PUSH_NM[2])
    found: dict[str, float | str] = {}
    for name, value in cells.items():
        if isinstance(value, str):
            found[name] = other.get(value, value)
        else:
            turns = name.endswith(("right_bending_deg", "left_rotation_deg"))
            found[name] = -value if turns or name in across else value
    return found


TO_THE_SIDE: dict[str, dict[str, float | str]] = {
    "8": {
        "trunk_extension_deg": -5.0,
        "hand_load_kg": 19.8,
        **dict(zip(HANDS, (0.0, -150.0, 340.0), strict=True)),
        "holding": "right",
    },
    "9": {"trunk_right_bending_deg": 20.0},
    "12": {
        "trunk_extension_deg": 0.0,
        **dict(zip(PUSH_NM, (16.7, -21.1, 78.3), strict=True)),
        "applied_at": "T9",
    },
}


@pytest.mark.parametrize("number", TO_THE_SIDE)
def test_a_mirrored_task_is_the_mirror_image(number: str) -> None:
    """Rotations and moments about x and y change sign, places and forces along z."""
    one, other = made(**TO_THE_SIDE[number]), made(**_mirrored(TO_THE_SIDE[number]))
    assert other.turned == pytest.approx(one.turned * [1.0, -1.0, -1.0], abs=ROUNDING)
    assert other.exertion.moment == pytest.approx(one.exertion.moment * [-1.0, -1.0, 1.0])
    if one.hands.at is not None:
        assert other.hands.at == pytest.approx(one.hands.at * [1.0, 1.0, -1.0])
        assert (one.hands.holding, other.hands.holding) == ("right", "left")


def test_load_of_task_8_lies_where_it_was_held(tasks: dict[str, Task]) -> None:
    hands = tasks["one_handed"].hands
    assert (hands.kg, hands.holding) == (19.8, "right")
    assert hands.at is not None
    assert hands.at[[0, 2]] == pytest.approx([0.0, 0.34])


def test_empty_cells_stand_for_what_is_usual() -> None:
    task = made(trunk_extension_deg=0.0)
    assert not task.turned.any()
    assert (task.number, task.from_upright, task.hands.at) == (None, True, None)
    assert (task.stress_pa, task.pressure_pa, task.tone, task.tone_share) == (0.6e6, 0.0, "none", 0)
    assert not task.exertion.force.any()
    assert not task.exertion.moment.any()


def test_units_are_si_inside() -> None:
    task = made(
        trunk_extension_deg=-90.0,
        pelvis_extension_deg=0.0,
        intra_abdominal_pressure_kpa=10.0,
        largest_stress_mpa=1.0,
        tone="stated",
        tone_percent=5.0,
    )
    assert task.turned[-1, 0] == pytest.approx(-np.pi / 2.0)
    assert (task.pressure_pa, task.stress_pa, task.tone_share) == pytest.approx((1e4, 1e6, 0.05))


def test_no_sample_bends_a_back_beyond_full_flexion() -> None:
    """Upright all that is drawn is added; at the end of flexion the pelvis goes no other way."""
    assert leaning_deg(8.0, -2.0, 0.0) == pytest.approx(between(8.0, -2.0, "extension"))
    assert leaning_deg(8.0, -2.0, FULL_FLEXION_DEG) == pytest.approx(np.full(8, -2.0))
    assert leaning_deg(8.0, -2.0, FULL_FLEXION_DEG - 4.0) == pytest.approx(
        between(2.0, -2.0, "extension")
    )
    # who bends less than full flexion may; one who was seen beyond it bends no farther
    assert leaning_deg(-8.0, 2.0, FULL_FLEXION_DEG)[0] == pytest.approx(-8.0)
    assert leaning_deg(1.0, 0.0, FULL_FLEXION_DEG + 5.0) == pytest.approx(np.zeros(8))
