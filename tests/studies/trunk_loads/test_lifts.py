"""Frames of the lifts that come along: what the motion loads is what muscles hold."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from trunk_person import CLOSELY, made_up

from spinepipe.cohort import Cohort, read
from spinepipe.documents.yaml_text import YamlDocument
from spinepipe.motion.recorded_motion import RecordedMotion, net_moments
from spinepipe.muscles.muscle_equilibrium import SolverOptions
from spinepipe.muscles.strength import hold_task
from spinepipe.muscles.trunk import LEVELS
from spinepipe.progress import Progress
from spinepipe.status import HELD
from spinepipe.studies.recordings import RECORDED
from spinepipe.studies.subjects import SUBJECTS
from spinepipe.studies.trunk_loads.checks import check_lifts, check_trunk
from spinepipe.studies.trunk_loads.kind import PER_LIFT, TrunkFiles
from spinepipe.studies.trunk_loads.lifts import (
    LIFTED,
    band_rows,
    held_in_turn,
    lift_of,
    of_mass,
    rows_of,
    tasks_of,
)
from spinepipe.studies.trunk_loads.persons import UprightPerson
from spinepipe.studies.trunk_loads.settings import Motions, TrunkLoads
from spinepipe.studies.trunk_loads.tables import LIFT_BANDS, LIFT_FRAMES, LIFT_LOADS, LIFT_PATHS

FOLDER = Path(__file__).resolve().parents[3] / "config" / "cohorts" / "stoop_lift"
STUDY = TrunkLoads(
    study="lifts",
    kind="trunk_loads",
    cohort="stoop_lift",
    motions=Motions(trials=("lift1",), every=30, samples=4, samples_every=4),
)


@cache
def cohort() -> Cohort:
    return read(FOLDER, (SUBJECTS, *RECORDED))


@cache
def stands() -> UprightPerson:
    return UprightPerson.of_cohort(STUDY, cohort(), "s01")


@cache
def lift() -> RecordedMotion:
    return lift_of(cohort(), "s01", "lift1", stands().person)


@cache
def rows() -> dict[str, pd.DataFrame]:
    found = rows_of(STUDY, stands(), lift(), Progress())
    return {name: pd.DataFrame(of_table) for name, of_table in found.items()}


def mirrored(motion: RecordedMotion) -> RecordedMotion:
    """Right and left exchanged: z of places and forces, the other two of moments."""
    flip, turn = np.array([1.0, 1.0, -1.0]), np.diag([1.0, 1.0, -1.0])
    loads = motion.loads
    return replace(
        motion,
        l5s1=motion.l5s1 * flip,
        rotations=turn @ motion.rotations @ turn,
        loads=replace(
            loads, at=loads.at * flip, forces=loads.forces * flip, moments=-loads.moments * flip
        ),
    )


@pytest.mark.parametrize("frame", [20, 90, 115])
def test_muscles_and_discs_hold_the_net_moment_of_the_inverse_dynamics(frame: int) -> None:
    """At every joint that both have; the spine is the same one until forces move it."""
    person, motion = stands().person, lift()
    (task,) = tasks_of(motion, np.array([frame]), 5e6)
    found = hold_task(person, task, replace(CLOSELY, translates=False, most=100)).solved
    _, net = net_moments(motion.joints, motion.loads)
    joints = np.einsum("kij,kj->ki", found.poses.discs, found.joint_moments)
    made = (found.demand.arms @ found.found.forces + found.found.slack).reshape(-1, 3)
    np.testing.assert_allclose((made + joints)[0], net[frame, 0], rtol=0.0, atol=1e-6)
    # above L5S1 both have their own way to share a bend: centres are some millimetres apart
    apart = np.linalg.norm((made + joints) - net[frame, : len(LEVELS)], axis=1)
    assert apart.max() < 5.0


def test_a_mirrored_lift_mirrors() -> None:
    person, frames = made_up(), np.array([60, 120])
    one, other = (
        [solved.solved for solved in held_in_turn(person, tasks_of(each, frames, 5e6), CLOSELY)]
        for each in (lift(), mirrored(lift()))
    )
    for here, there in zip(one, other, strict=True):
        np.testing.assert_allclose(there.compression, here.compression, rtol=1e-4)
        np.testing.assert_allclose(there.pushes[:, 2], -here.pushes[:, 2], rtol=1e-3, atol=0.1)


def test_the_frame_before_changes_no_load() -> None:
    person, frames = stands().person, np.arange(80, 130, 5)
    tasks = tasks_of(lift(), frames, 0.6e6)
    for task, warm in zip(tasks, held_in_turn(person, tasks, SolverOptions()), strict=True):
        alone = hold_task(person, task, SolverOptions()).solved
        if warm.solved.status in HELD and alone.status in HELD:
            np.testing.assert_allclose(
                warm.solved.compression, alone.compression, rtol=0.02, atol=10.0
            )


def test_a_frame_so_near_its_least_stress_that_rounds_swing_is_held_at_a_little_more() -> None:
    motion = lift_of(cohort(), "s01", "lift3", stands().person)
    tasks = tasks_of(motion, np.arange(72, 78), 0.6e6)
    ended = [one.solved.status for one in held_in_turn(stands().person, tasks, SolverOptions())]
    assert set(ended) <= set(HELD)


def test_rows_tell_every_level_of_every_frame_and_what_hands_bear() -> None:
    found, frames = rows(), range(0, len(lift().time_s), 30)
    loads, hands = found["lift_loads"], found["lift_frames"]
    for table in (LIFT_LOADS, LIFT_FRAMES, LIFT_BANDS, LIFT_PATHS):
        assert {c.name for c in table.columns} - set(found[table.name]) <= {"specimen", "trial"}
    assert len(loads) == len(LEVELS) * len(frames)
    assert loads["time_s"].unique().tolist() == lift().time_s[::30].tolist()
    assert loads["pressure_mpa"].notna().sum() == len(frames)
    # the box stands on the floor first, and 15 kg hang on the hands later
    borne = hands.set_index("time_s")["load_n"]
    assert borne.iloc[0] == pytest.approx(0.0, abs=1.0)
    assert borne.iloc[-1] == pytest.approx(15.0 * 9.80665, rel=0.1)
    peak = loads[loads["level"] == "L4L5"].set_index("time_s")["compression_n"]
    assert peak.idxmax() in set(found["lift_paths"]["time_s"])
    assert found["lift_bands"]["low"].isna().all()  # of four persons none is told
    assert (found["lift_bands"]["n_samples"] + found["lift_bands"]["n_failed"] == 4).all()


def test_a_heavier_person_lifts_the_same_box() -> None:
    heavier, names = of_mass(lift(), 1.1), np.array(lift().loads.names)
    share = heavier.loads.forces[100, :, 1] / lift().loads.forces[100, :, 1]
    np.testing.assert_allclose(share[names != LIFTED], 1.1)
    assert share[names == LIFTED].tolist() == [1.0]


def test_uncertain_lean_turns_bodies_and_no_load() -> None:
    frames = np.array([100])
    (plain,) = tasks_of(lift(), frames, 1e6)
    (leant,) = tasks_of(lift(), frames, 1e6, {"trunk_extension_deg": 2.0, "pressure_kpa": 3.0})
    assert plain.instant is not None
    assert leant.instant is not None
    turned = leant.instant.turned[-1] @ plain.instant.turned[-1].T
    assert np.rad2deg(np.arctan2(turned[1, 0], turned[0, 0])) == pytest.approx(2.0)
    np.testing.assert_array_equal(leant.instant.turned[0], plain.instant.turned[0])
    np.testing.assert_array_equal(leant.instant.at, plain.instant.at)
    assert leant.pressure_pa == 3e3


def test_persons_that_do_not_hold_a_frame_count_beyond_its_upper_end() -> None:
    compression = np.zeros((100, 2, len(LEVELS)))
    compression[:, :, 1] = np.arange(100.0)[:, None]
    stress = np.full((100, 2), 0.6e6)
    stress[90:98, 0] = 1.4e6  # more than trunks have
    stress[98:, 0] = np.inf
    stress[5:, 1] = np.inf  # too few to tell
    found = pd.DataFrame(band_rows(np.array([0.0, 0.1]), compression, stress))
    own = found[found["level"] == "L4L5"].set_index("time_s")
    first, second = own.loc[0.0], own.loc[0.1]
    assert (first["n_samples"], first["n_failed"], first["n_above"]) == (98, 2, 8)
    assert first["low"] == np.quantile(np.arange(100.0), 0.025)
    assert first["high"] == pytest.approx(np.quantile(np.arange(100.0), 0.975))
    assert second[["low", "median", "high"]].isna().all()


def test_a_study_has_the_lifts_that_a_person_has() -> None:
    asked = STUDY.model_copy(update={"motions": Motions(trials=("lift1", "lift3"))})
    files = TrunkFiles.of(asked, cohort())
    assert files.lifts == {"s01": ("lift1", "lift3")}
    assert set(PER_LIFT) <= set(files.tables)
    assert not {"tasks", "levels", "simplified"} & set(files.tables)
    assert files.job_files("lift_loads", "s01", "000")[1].endswith("trial-lift3.parquet")


def problems(
    changed: dict[str, pd.DataFrame | None], trials: tuple[str, ...] = ("lift1",)
) -> list[str]:
    """What checks of a study of lifts find in a changed cohort."""
    tables = {**cohort().further, **changed}
    further = {name: rows for name, rows in tables.items() if rows is not None}
    study = STUDY.model_copy(update={"motions": Motions(trials=trials)})
    document = YamlDocument("lifts.yaml", {"motions": {"trials": list(trials)}}, {})
    other = replace(cohort(), further=further)
    return [str(one) for one in check_trunk(document, study, other)]


def test_a_cohort_of_lifts_needs_no_tasks_and_what_it_lacks_is_named() -> None:
    assert problems({}) == []
    trials = cohort().further["trials"]
    moving = trials[trials["kind"] != "stance"]
    (without,) = problems({"trials": moving})
    assert "no static trial of 's01'" in without
    assert "mark one static" in without
    others = trials.iloc[1:]
    for column, text, told in (
        ("axes", "x y", "name each axis once"),
        ("file", "../other.c3d", "leads out of the folder"),
    ):
        (wrong,) = problems(
            {"trials": pd.concat([trials.iloc[:1].assign(**{column: text}), others])}
        )
        assert told in wrong
    (unknown,) = problems({}, ("lift9",))
    assert "lift9" in unknown
    (none,) = problems({"trials": None})
    assert "a cohort without trials.csv" in none


def test_recordings_are_looked_at_before_anything_runs() -> None:
    document = YamlDocument("lifts.yaml", {}, {})
    assert not list(check_lifts(document, STUDY, cohort(), FOLDER))
    box = cohort().further["box"]
    metres = box.assign(**{name: box[name] / 1000.0 for name in ("x_mm", "y_mm")})
    other = replace(cohort(), further={**cohort().further, "box": metres})
    found = [str(one) for one in check_lifts(document, STUDY, other, FOLDER)]
    assert any("not in mm" in one for one in found)
