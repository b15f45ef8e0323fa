"""Persons are what their files say: joints, bodies, markers and trials, in SI and body frames."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cohort_cases import Change, both, cell, line, swap, text, without
from tracked_cohort import (
    BODIES,
    KG,
    MARKERS,
    RATE,
    STEP_MM,
    bodies_at,
    marker_places,
    motions,
    write,
)

from spinepipe import cohort as cohorts
from spinepipe.cohort import Cohort
from spinepipe.motion.joint_tables import ratio_sets
from spinepipe.motion.passive import passive_elements
from spinepipe.motion.points import marker_places as model_places
from spinepipe.motion.skeleton import JOINTS, body_poses
from spinepipe.muscles.subject import Subject
from spinepipe.studies.recordings import motion_files, static_trial
from spinepipe.studies.subjects import SUBJECTS
from spinepipe.studies.tracking.persons import (
    TrackedPerson,
    person_of,
    ratios_of,
    skeleton_in_trial,
)
from spinepipe.studies.tracking.trials import FORMS

REST = np.zeros((1, 18, 6))
DE_LEVA_MEN = {"head": 6.94, "upper_arm": 2.71, "forearm": 1.62, "hand": 0.61}
"""Share of body mass, per cent (de Leva 1996 Table 4)."""

BODYLESS = both(without("bodies.csv"), swap("cohort.yaml", "gravity: true", "gravity: false"))


def read(folder: Path, *changes: Change) -> tuple[Cohort, TrackedPerson]:
    path = write(folder, *changes)
    cohort = cohorts.read(path, (SUBJECTS, *FORMS))
    return cohort, person_of(cohort, "a", path)


def test_a_person_stands_where_the_files_place_joints_and_markers(tmp_path: Path) -> None:
    """Files give a ten-thousandth of a mm."""
    _, person = read(tmp_path)
    assert person.subject == Subject("male", 40.0, 1.75, 76.0)
    turned, placed = bodies_at((0.0, 0.0, 0.0))
    turns, places = body_poses(person.skeleton, REST[0])
    np.testing.assert_allclose(turns, turned.as_matrix(), atol=1e-8)
    np.testing.assert_allclose(1e3 * (places - places[0]), placed, atol=1e-3)
    assert person.markers.names == tuple(MARKERS)
    found = model_places(person.skeleton, person.markers, REST)[0] - places[0]
    np.testing.assert_allclose(1e3 * found, marker_places((0.0, 0.0, 0.0)), atol=1e-3)
    assert set(person.markers.weight) == {1.0}
    assert person.markers.cluster[:3] == ("T1", "T1", "T1")
    assert person.markers.cluster[-1] == ""


def test_trials_are_in_ground_axes_and_in_the_order_of_the_set(tmp_path: Path) -> None:
    def turned_round(files: dict[str, str | bytes]) -> None:
        header, *rows = str(files["marker_set.csv"]).splitlines()
        files["marker_set.csv"] = "\n".join([header, *reversed(rows)]) + "\n"

    _, person = read(tmp_path, turned_round, cell("trials.csv", 3, "arms", "behind_head"))
    assert [trial.name for trial in person.trials] == list(motions())
    for trial, motion in zip(person.trials, motions().values(), strict=True):
        np.testing.assert_allclose(1e3 * trial.places, motion.places[:, ::-1], atol=1e-4)
        np.testing.assert_allclose(trial.time_s, np.arange(len(motion.places)) / RATE)
        assert trial.seen.all()
    assert [trial.arms for trial in person.trials] == ["hanging", "behind_head", "hanging"]


def test_a_marker_that_a_file_lacks_is_never_seen(tmp_path: Path) -> None:
    _, person = read(tmp_path, swap("stance.trc", "T5\t", "T5x\t"))
    k = person.markers.names.index("T5")
    assert not person.trials[0].seen[:, k].any()
    assert not person.trials[0].places[:, k].any()
    assert person.trials[1].seen.all()


def test_bodies_are_seen_from_their_joints(tmp_path: Path) -> None:
    _, person = read(tmp_path)
    turned, placed = bodies_at((0.0, 0.0, 0.0))
    masses = person.skeleton.masses
    np.testing.assert_allclose(masses.kg, [KG[name == "S1"] for name in BODIES])
    for k in range(18):
        in_ground = placed[k] + turned[k].apply(1e3 * masses.com[k])
        np.testing.assert_allclose(in_ground, [30.0, STEP_MM * (k - 0.5), 0.0], atol=1e-3)
        turn = turned[k].as_matrix()
        about = turn @ masses.about_com[k] @ turn.T
        np.testing.assert_allclose(about, np.diag([0.01, 0.012, 0.006]), atol=1e-9)


def test_masses_that_nobody_tells_are_those_of_sources(tmp_path: Path) -> None:
    """Slices from 1.1 % at T1 to 2.6 % at L5 (Pearsall 1996), the pelvis 11.17 % (de Leva)."""
    _, person = read(tmp_path, BODYLESS)
    kg = person.skeleton.masses.kg
    assert kg[0] == pytest.approx(0.1117 * 76.0)
    assert kg[[1, 17]] == pytest.approx([0.026 * 76.0, 0.011 * 76.0])
    assert kg[1:].sum() == pytest.approx(0.3145 * 76.0, rel=1e-12)
    sizes = np.linalg.eigvalsh(person.skeleton.masses.about_com)
    assert (sizes > 0.0).all()
    assert (sizes[:, 0] + sizes[:, 1] > sizes[:, 2]).all()


def test_an_inertia_that_is_not_told_is_no_placeholder(tmp_path: Path) -> None:
    """L3 alone has none: water of 1.4 kg, 26 mm high, its ellipse 0.65 times as deep as wide.

    The joints' slope of a few degrees makes it 0.2 % longer.
    """
    six = ("xx", "yy", "zz", "xy", "xz", "yz")
    _, person = read(tmp_path, *(cell("bodies.csv", 5, f"i{axes}_kg_m2", "") for axes in six))
    about = person.skeleton.masses.about_com[BODIES.index("L3")]
    wide = np.sqrt(1.4 / 1000.0 / 0.026 / np.pi / 0.65)
    trace = 2.0 * 1.4 * (wide**2 / 4.0 + (0.65 * wide) ** 2 / 4.0 + 0.026**2 / 12.0)
    assert np.trace(about) == pytest.approx(trace, rel=4e-3)
    others = [k for k in range(18) if BODIES[k] != "L3"]
    np.testing.assert_allclose(
        np.trace(person.skeleton.masses.about_com[others], axis1=1, axis2=2), 0.028
    )


def test_head_and_arms_are_hung_on_t1(tmp_path: Path) -> None:
    _, person = read(tmp_path)
    share = DE_LEVA_MEN["head"] + 2.0 * sum(
        DE_LEVA_MEN[name] for name in ("upper_arm", "forearm", "hand")
    )
    held = skeleton_in_trial(person, person.trials[0])
    more = held.masses.kg - person.skeleton.masses.kg
    np.testing.assert_allclose(more[:-1], 0.0)
    assert more[-1] == pytest.approx(share / 100.0 * 76.0)
    up = skeleton_in_trial(person, replace(person.trials[0], arms="behind_head"))
    assert up.masses.com[-1, 1] > held.masses.com[-1, 1]


def test_centres_are_half_way_to_the_joint_above_or_as_told(tmp_path: Path) -> None:
    _, person = read(tmp_path)
    turned, placed = bodies_at((0.0, 0.0, 0.0))
    for k in range(1, 17):
        centre = placed[k] + turned[k].apply(1e3 * person.centres[k])
        np.testing.assert_allclose(centre, (placed[k] + placed[k + 1]) / 2.0, atol=1e-3)
    (tmp_path / "told").mkdir()
    rows = "specimen,vertebra,x_mm,y_mm,z_mm\na,L3,1,2,3\n"
    _, told = read(tmp_path / "told", text("centres.csv", rows))
    np.testing.assert_allclose(told.centres[3], [1e-3, 2e-3, 3e-3])
    np.testing.assert_allclose(np.delete(told.centres, 3, 0), np.delete(person.centres, 3, 0))


def test_rows_of_the_cohort_replace_those_that_come_along(tmp_path: Path) -> None:
    """A of 2 N m and B of 0.3 per degree; a range of -7 to 9 deg; two joints share extension."""
    law = "".join(f"L4L5,extension,{side},2,0.3,0.5,2,mine\n" for side in ("positive", "negative"))
    changes = (
        text("passive.csv", f"joint,coordinate,side,a,b,lower,upper,source\n{law}"),
        text("bounds.csv", "joint,coordinate,low,high,source\nL4L5,extension,-7,9,mine\n"),
        text(
            "ratios.csv",
            "set,joint,coordinate,ratio,source\nown,L4L5,extension,0.4,m\n"
            "own,L5S1,extension,0.6,m\n",
        ),
    )
    cohort, person = read(tmp_path, *changes)
    joint, extension = JOINTS.index("L4L5"), 3
    np.testing.assert_allclose(person.passive.a[joint, extension], 2.0)
    np.testing.assert_allclose(person.passive.b[joint, extension], 0.3 * 180.0 / np.pi)
    np.testing.assert_allclose(np.rad2deg(person.limits[joint, extension]), [-7.0, 9.0])
    others = np.arange(17) != joint
    shipped = passive_elements()
    np.testing.assert_array_equal(person.passive.a[others], shipped.a[others])
    sets = ratios_of(cohort)
    assert set(sets) == {"own", *ratio_sets()}
    np.testing.assert_allclose(sets["own"][:2, 0], [0.6, 0.4])


def test_the_static_trial_is_the_marked_one_else_the_stance(tmp_path: Path) -> None:
    cohort, _ = read(tmp_path)
    assert static_trial(cohort, "a") == "stance"
    assert [path.name for path in motion_files(cohort, "a")] == [f"{n}.trc" for n in motions()]
    (tmp_path / "marked").mkdir()
    cohort, _ = read(tmp_path / "marked", cell("trials.csv", 4, "static", "yes"))
    assert static_trial(cohort, "a") == "lateral_bending"
    (tmp_path / "none").mkdir()
    cohort, _ = read(tmp_path / "none", line("trials.csv", 2, None))
    assert static_trial(cohort, "a") is None
