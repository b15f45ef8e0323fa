"""Arms, sizes, forces and rows of patients, worked by hand on two or three segments.

Would catch wrong arms, sizes, chains and units of rows, where no whole patient is solved.
"""

from dataclasses import replace
from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scoliosis_cases import STUDY, scaled
from sweeps import sweep

from spinepipe.calibration.profile import RegionEnds
from spinepipe.status import PrescribedStatus, Status
from spinepipe.studies.scoliosis import personal, personalise
from spinepipe.studies.scoliosis.curve_angles import SpinalCurve
from spinepipe.studies.scoliosis.films import Film
from spinepipe.studies.scoliosis.fixed_end_spine import BENDING, geometry, with_laws, with_springs
from spinepipe.studies.scoliosis.personal import (
    Fitting,
    Patient,
    PersonalModel,
    arms,
    geometric_mean,
    size_of,
)
from spinepipe.studies.scoliosis.settings import SagittalProfile, Scoliosis
from spinepipe.studies.scoliosis.tangent_laws import (
    EndRotations,
    LinearShape,
    Pairs,
    characterise,
    ends_of,
)

FILM = Film(np.array([0.0, 0.03, 0.04]), np.array([0.0, 0.04, 0.08]), np.deg2rad([0.0, 20.0, 6.0]))


def study(**asked: Any) -> Scoliosis:
    return Scoliosis.model_validate(STUDY.model_dump() | asked)


def test_arms_reach_from_joints_to_the_line_of_the_pull() -> None:
    """Joints half way at (15, 20) and (35, 60) mm, the top at (40, 80). Along ground the arm is how
    much higher the top is; across the chord, along which (0.4, 0.8) / 0.894 points, more."""
    np.testing.assert_allclose(arms(0.5, FILM, across_chord=False), [0.060, 0.020])
    chord = np.array([0.4, 0.8]) / np.hypot(0.4, 0.8)
    expected = [0.025 * chord[0] + 0.060 * chord[1], 0.005 * chord[0] + 0.020 * chord[1]]
    np.testing.assert_allclose(arms(0.5, FILM, across_chord=True), expected)


def test_chains_have_joints_at_the_back_of_endplates() -> None:
    profile = SagittalProfile(endplate_depth_mm=30.0, endplate_share=0.25)
    chain = geometry("p1", ("a", "b"), FILM, profile)
    places = np.array([frame.origin for frame in chain.frames])
    np.testing.assert_allclose(places, [[-0.015, 0.010, 0.0075], [-0.015, 0.050, 0.0325]])
    lines = np.array([frame.rotation[:, 1] for frame in chain.frames])
    tilts = np.deg2rad([10.0, 13.0])  # between both vertebrae
    np.testing.assert_allclose(lines, [[0.0, np.cos(t), np.sin(t)] for t in tilts], atol=1e-15)
    centres = [body.com for body in chain.bodies]
    np.testing.assert_allclose(centres, [[0.0, 0.04, 0.03], [0.0, 0.08, 0.04]])
    assert not chain.gravity.any()
    # a ball of 0.5 kg and 3 cm
    np.testing.assert_allclose(chain.bodies[0].inertia, np.eye(3) * 0.4 * 0.5 * 0.03**2)
    assert {body.mass for body in chain.bodies} == {0.5}


def test_a_tangent_takes_the_place_of_the_lateral_spring_but_for_a_millionth() -> None:
    chain = geometry("p1", ("a", "b"), FILM, SagittalProfile())
    springs = np.tile(np.arange(1.0, 7.0), (2, 1))
    laws = np.tile([50.0, -0.1, 0.2], (2, 1))
    model = with_laws(chain, springs, laws)
    others, tangent = model.effects
    expected = springs.copy()
    expected[:, BENDING] = 1e-4
    np.testing.assert_array_equal(others.values, expected)
    np.testing.assert_array_equal(tangent.values, laws)
    assert others.joints == tangent.joints == (0, 1)
    np.testing.assert_array_equal(with_springs(chain, springs).effects[0].values, springs)
    assert springs[0, BENDING] == BENDING + 1


PAIRS = Pairs(
    np.deg2rad([4.0, 6.0, 5.0]),
    np.deg2rad([-4.0, -6.0, -5.0]),
    np.array([0.3, 0.2, 0.1]),
    np.array([0.3, 0.2, 0.1]),
    1,
)
"""A spine that bends as far to both sides, under forces of one size."""


def test_stiffness_of_even_pairs_is_that_of_the_apical_moment() -> None:
    """10 N m at the second segment: 15, 10 and 5 N m; linear laws moment over rotation. Tangents
    have their ends at 1.2 times; at 1 / 1.2 of an end e the load is tan(75 deg) A, the slope at
    rest A pi / (2 e)."""
    linear = characterise(PAIRS, LinearShape(), 10.0)
    np.testing.assert_allclose(linear.stretch, [15, 10, 5] / PAIRS.right, rtol=1e-6)
    assert linear.ratio == pytest.approx(1.0, rel=1e-6)
    assert (linear.force_right_n, linear.force_left_n) == pytest.approx((50.0, 50.0), rel=1e-6)
    ends = ends_of(PAIRS, 1.2)
    tangent = characterise(PAIRS, ends, 10.0)
    tan_75 = 2.0 + np.sqrt(3.0)
    np.testing.assert_allclose(tangent.stretch, np.array([15, 10, 5]) / tan_75, rtol=1e-6)
    at_rest = tangent.stretch * np.pi / (2.0 * 1.2 * PAIRS.right)
    np.testing.assert_allclose(ends.at_rest(tangent.stretch), at_rest)
    np.testing.assert_allclose(ends.rotation(np.full(3, tan_75)), PAIRS.right)
    asked = study(scale={"of": "apical_moment", "apical_moment_nm": 10.0})
    assert size_of(PAIRS, asked) == pytest.approx(geometric_mean(at_rest), rel=1e-6)


def test_errors_of_laws_are_summed_over_segments_as_roots_of_two_films() -> None:
    """Eq 5: 3 and 4 are a root mean square of 3.54, 0 and 2 one of 1.41."""
    linear = characterise(PAIRS, LinearShape(), 10.0)
    made = type(linear)(
        **{**vars(linear), "errors": np.array([[3.0, -4.0], [0.0, 2.0], [0.0, 0.0]])}
    )
    assert made.rmse == pytest.approx(np.sqrt(12.5) + np.sqrt(2.0))


def test_no_end_is_nearer_than_the_step_of_reading() -> None:
    """0.1 deg, to either side; a segment that stands still has both ends there."""
    pairs = Pairs(
        np.deg2rad([0.05, 0.09, 0.0]), np.deg2rad([-0.09, -0.01, 0.0]), *[np.ones(3)] * 2, 0
    )
    ends = ends_of(pairs, 1.2)
    np.testing.assert_allclose(np.rad2deg(ends.upper), [0.1, 0.108, 0.1])
    np.testing.assert_allclose(np.rad2deg(ends.lower), [-0.108, -0.1, -0.1])
    assert pairs.opposite.tolist() == [False, False, True]


@sweep(
    "right, left, opposite",
    [(2e-9, -2e-9, False), (0.9e-9, -1.0, True), (1.0, -0.9e-9, True), (-1.0, -1.0, True)],
)
def test_what_turns_by_less_than_rounding_stands_still(
    right: float, left: float, opposite: bool
) -> None:
    one = Pairs(np.array([right]), np.array([left]), np.ones(1), np.ones(1), 0)
    assert one.opposite.tolist() == [opposite]


@sweep("times, held", [(0.04, 0.05), (0.06, 0.06), (19.0, 19.0), (21.0, 20.0)])
def test_stiffness_stays_between_a_twentieth_and_twenty_times_the_median(
    times: float, held: float
) -> None:
    """Springs of 100 N m/rad but for one."""
    springs = np.array([100.0, 100.0, 100.0 * times, 100.0, 100.0])
    arm = np.full(5, 0.2)
    right = 10.0 / springs
    found = characterise(Pairs(right, -right, arm, arm, 0), LinearShape(), 10.0)
    np.testing.assert_allclose(found.stretch, [100.0, 100.0, 100.0 * held, 100.0, 100.0], rtol=1e-6)
    assert found.constrained.tolist() == [False, False, held != times, False, False]


@sweep("ratio, found", [(29.0, 29.0), (1 / 29.0, 1 / 29.0), (40.0, 30.0)])
def test_forces_differ_by_thirty_times_at_most(ratio: float, found: float) -> None:
    arm, stiffness = np.array([0.3, 0.2, 0.1]), np.array([90.0, 60.0, 75.0])
    pairs = Pairs(10.0 * arm / stiffness, -ratio * 10.0 * arm / stiffness, arm, arm, 1)
    laws = characterise(pairs, LinearShape(), 63.0)
    assert laws.ratio == pytest.approx(found, rel=1e-4)
    larger = max(laws.force_right_n, laws.force_left_n) * 0.2
    assert larger == pytest.approx(63.0)


def test_regions_of_segments_change_at_the_ends_between_curves() -> None:
    every = (SpinalCurve(0, 2, 1, 1), SpinalCurve(2, 5, 3, -1), SpinalCurve(5, 7, 6, 1))
    patient: Any = SimpleNamespace(curves=every, chain=SimpleNamespace(n_joints=8))
    assert personal._regions(patient).tolist() == [0, 0, 1, 1, 1, 2, 2, 2]
    patient.curves = every[:1]
    assert personal._regions(patient).tolist() == [0] * 8


def test_multipliers_of_regions_keep_the_geometric_mean() -> None:
    """Of three regions two logarithms are free; the last one is one."""
    regions = np.array([0, 0, 1, 2, 2])
    made: Any = object.__new__(personal.RegionFit)
    own = np.eye(3)[regions]
    made.start = np.full(5, 80.0)
    made.by_logs = (own - own.mean(axis=0))[:, :-1]
    found = made.stiffness(np.log([2.0, 3.0]))
    assert geometric_mean(found) == pytest.approx(80.0)
    np.testing.assert_allclose(found / found[-1], [2.0, 2.0, 3.0, 1.0, 1.0])


class Fit:
    """A fit whose end is chosen."""

    arrived = True

    def __init__(self, patient: Patient, sd: Any) -> None:
        pass

    def fit(self, population: Any) -> Any:
        return SimpleNamespace(arrived=self.arrived)

    def personal(self, fitted: Any) -> PersonalModel:
        nothing: Any = None
        ended = Fitting(Status.CONVERGED if self.arrived else Status.NOT_CONVERGED, 1)
        made = PersonalModel(nothing, np.ones(2), None, np.zeros(2, dtype=bool), 0, 0.0)
        return replace(made, fitting=ended)


@sweep("regions", [True, False])
@sweep("arrived", [True, False])
def test_films_are_asked_of_ratios_where_the_study_wants_it(
    regions: bool, arrived: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    reach = (RegionEnds(0.5, 2.0, False, False),) * 2
    monkeypatch.setattr(personalise, "population_of", lambda rows: (None, None))
    monkeypatch.setattr(personalise, "FilmFit", Fit)
    monkeypatch.setattr(personalise, "regions", lambda *_: reach)
    monkeypatch.setattr(Fit, "arrived", arrived)
    patient: Any = SimpleNamespace(read=SimpleNamespace(traction={}))
    asked = study(film_regions=regions)
    found, told, absolute = personalise._personal(asked, patient, "tangent_fitted", TABLE)
    assert absolute == ""
    assert found.by_films == (reach if regions else None)
    assert told == ("" if arrived else "the fit to the films did not settle")


TABLE: Any = pd.DataFrame({"status": ["converged"]})
"""A population's table, of which nobody here looks at more."""


def person(by_films: tuple[RegionEnds, ...] | None, **more: Any) -> PersonalModel:
    nothing: Any = None
    return PersonalModel(
        nothing,
        np.array([50.0, 200.0]),
        more.get("ends"),
        np.array([False, True]),
        5,
        4.5,
        more.get("reach"),
        by_films,
    )


def test_rows_of_laws_tell_ratios_ends_and_what_films_leave_open() -> None:
    patient: Any = SimpleNamespace(
        chain=SimpleNamespace(joints=("a", "b")),
        pairs=SimpleNamespace(opposite=np.array([True, False])),
    )
    ends = EndRotations(np.deg2rad([-5.0, -6.0]), np.deg2rad([7.0, 8.0]))
    reach = np.array([[0.2, 0.3], [0.8, 3.0]])
    sides = (RegionEnds(0.4, None, False, True), RegionEnds(1.5, 2.5, False, False))
    one, other = personalise._laws(patient, person(sides, ends=ends, reach=reach))
    assert (one["joint"], one["at_rest_nm_per_rad"]) == ("a", 50.0)
    assert (one["ratio"], other["ratio"]) == pytest.approx((0.5, 2.0))
    assert (one["ratio_low"], one["ratio_high"]) == (0.2, 0.8)
    assert (one["lower_end_deg"], one["upper_end_deg"]) == pytest.approx((-5.0, 7.0))
    assert (one["films_low"], one["films_high"]) == (0.4, None)
    assert (one["open_below"], one["open_above"], one["identifiable"]) == (False, True, False)
    assert (one["opposite"], one["constrained"]) == (True, False)
    assert (other["ratio_low"], other["ratio_high"]) == (0.3, 3.0)
    assert (other["open_above"], other["identifiable"], other["constrained"]) == (False, True, True)
    bare, _ = personalise._laws(patient, person(None))
    empty = ("ratio_low", "ratio_high", "lower_end_deg", "upper_end_deg", "films_low")
    assert {bare[name] for name in (*empty, "open_below", "identifiable")} == {None}
    below, _ = personalise._laws(patient, person((RegionEnds(None, 2.0, True, False),) * 2))
    assert below["identifiable"] is False


@sweep("status", [PrescribedStatus.CONVERGED, PrescribedStatus.UNSTABLE])
def test_rows_of_a_pose_are_in_mm_and_degrees(status: PrescribedStatus) -> None:
    """Missed by 3 and 4 mm and -2 deg; the film's spine is twice as long as erect."""
    erect = Film(np.zeros(3), np.array([0.0, 0.04, 0.08]), np.zeros(3))
    films = {"erect": erect, "neutral": scaled(erect, 2.0)}
    read = personal.PatientFilms(films, {"neutral": 1.1}, np.full(3, np.nan), {})
    pairs = Pairs(np.deg2rad([5.0, 5.0]), np.deg2rad([-4.0, -4.0]), *[np.ones(2)] * 2, 0)
    patient: Any = SimpleNamespace(
        read=read,
        pairs=pairs,
        curves=(SpinalCurve(0, 2, 1, 1), SpinalCurve(0, 2, 1, -1)),
        chain=SimpleNamespace(joints=("a", "b")),
    )
    patient.errors = partial(Patient.errors, patient)
    shown = Film(np.array([0.0, 0.003, 0.0]), np.array([0.0, 0.084, 0.16]), np.deg2rad([1, 3, -3]))
    held = SimpleNamespace(
        status=status, missed=np.array([3e-3, 4e-3, np.deg2rad(-2.0)]), pushes=np.arange(4.0)
    )
    posed: Any = SimpleNamespace(result=held, film=shown, r=np.deg2rad([1.0, -6.0]))
    row = personalise._position(patient, "neutral", posed)
    assert (row["missed_mm"], row["missed_deg"]) == pytest.approx((5.0, 2.0))
    assert (row["chord_ratio"], row["film_scale"]) == (2.0, 1.1)
    there = status is PrescribedStatus.CONVERGED
    pushes = [row[name] for name in personalise.PUSHES]
    assert pushes == ([0.0, 1.0, 2.0, 3.0] if there else [None] * 4)
    films["neutral"] = Film(*(scaled(erect, 2.0).rows[:2]), np.deg2rad([0.0, 3.0, 1.0]))
    one, other = personalise._displacements(study(), patient, "neutral", posed)
    assert (one["measured_deg"], other["measured_deg"]) == pytest.approx((3.0, -2.0))
    assert one["share_of_range"] == pytest.approx(3.0 / (1.2 * 5.0))
    assert other["share_of_range"] == pytest.approx(2.0 / (1.2 * 4.0))
    cells = ("simulated_deg", "off_right_mm", "off_up_mm")
    expected = (1.0, 3.0, 4.0) if there else (None,) * 3
    assert tuple(one[name] for name in cells) == pytest.approx(expected)
    cohort: Any = SimpleNamespace(vertebrae=("L4", "L3", "L2"))
    right, left = personalise._curves(cohort, patient, "neutral", posed)
    assert (right["curve"], right["side"], left["curve"], left["side"]) == (0, "right", 1, "left")
    assert [right[f"{end}_vertebra"] for end in ("lower", "apex", "upper")] == ["L4", "L3", "L2"]
    assert (right["region"], right["cobb_measured_deg"]) == ("TL/L", pytest.approx(-1.0))
    assert right["cobb_simulated_deg"] == (pytest.approx(4.0) if there else None)
    bulge = np.rad2deg(np.arctan2(3, 84) + np.arctan2(3, 76))
    assert left["ferguson_simulated_deg"] == (pytest.approx(-bulge) if there else None)
