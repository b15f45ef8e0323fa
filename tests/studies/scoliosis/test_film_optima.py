"""Optima of fits to films: poses from neutral, several starts, bounds and failures that are told.

Would catch a fit whose errors are those of a pose that its model does not take from the erect one,
one that stays at the first optimum, a multiplier at its bound that nobody sees, and a population
that still moves when its rounds are over.
"""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scoliosis_cases import SHIPPED, STUDY, shipped

from spinepipe import cohort as cohorts
from spinepipe.calibration.descent import DescentTolerances
from spinepipe.cohort import Cohort
from spinepipe.effects.contract import Array
from spinepipe.progress import Progress
from spinepipe.statics.prescribed import PrescribedResult, _Problem, alone, hold_at
from spinepipe.status import PrescribedStatus, Status
from spinepipe.studies.scoliosis import fit_population as learning
from spinepipe.studies.scoliosis.film_fit import READINGS, FilmFit, fit_alike, laws_of
from spinepipe.studies.scoliosis.films import FILMS, PATIENTS, RIGHT, film_sd
from spinepipe.studies.scoliosis.optima import FilmOptimum, best, optimum
from spinepipe.studies.scoliosis.personal import linear_regions, patient_of, region_optimum
from spinepipe.studies.scoliosis.personalise import UNSETTLED, rows_of
from spinepipe.studies.scoliosis.population import Population, population_rows, usual_population
from spinepipe.studies.scoliosis.tables import LAWS, POPULATION, POSITIONS
from spinepipe.tables import from_rows

SD = film_sd(0.03, 0.03, STUDY.model_sd_mm, STUDY.model_sd_deg)
SEGMENTS = 14
RATIOS = [-51, -12, -15, -13, -37, -28, 18, 41, 23, 6, -5, 22, 31, 19]
LOWER = [-213, -221, -244, -238, -236, -235, -260, -263, -255, -243, -242, -246, -251, -253]
UPPER = [-223, -254, -265, -269, -254, -242, -249, -240, -247, -256, -250, -245, -242, -244]
LEARNED = Population(0.01 * np.array([*RATIOS, *LOWER, *UPPER]), 0.31, 0.23)
"""About what the cohort that comes along teaches."""


@pytest.fixture(scope="module")
def cohort() -> Cohort:
    return cohorts.read(SHIPPED / "ais18_phantom", (FILMS, PATIENTS))


def fit_of(cohort: Cohort, name: str) -> FilmFit:
    return FilmFit(patient_of(STUDY, cohort, name), SD)


def cost_from_neutral(fit: FilmFit, population: Population, unknowns: Array) -> float:
    fit.near = {}
    found = fit.point(population)(unknowns)
    assert found is not None
    return float(found[0] @ found[0])


def held_off_the_path(fit: FilmFit, numbers: Array) -> tuple[PrescribedResult, PrescribedResult]:
    """Poses in right bending: Newton's with all at once from neutral, and that of the path."""
    laws = laws_of(numbers, fit.size)
    spine = fit.spine.with_values(fit.spine.chain.values[0], laws)
    wanted = np.append(fit.patient.read.films[RIGHT].top, 0.0)
    rest = PrescribedResult(
        np.zeros(6 * SEGMENTS), np.zeros(4), wanted, PrescribedStatus.CONVERGED, "", 0
    )
    at_once = _Problem(spine.chain, alone).newton(rest, wanted, 0.0)
    assert at_once is not None
    return at_once, hold_at(spine.chain, wanted)


def test_the_pose_is_the_end_of_the_way_and_not_where_one_long_step_lands(cohort: Cohort) -> None:
    """p14 with wide ends: all at once from neutral another stable pose is met, 2.5 deg off."""
    fit = fit_of(cohort, "p14")
    numbers = list(fit._guesses(usual_population(SEGMENTS)))[2][:-READINGS]
    at_once, found = held_off_the_path(fit, numbers)
    assert at_once.status is found.status is PrescribedStatus.CONVERGED
    assert np.abs(at_once.q - found.q).max() > np.deg2rad(2.0)
    chain = fit.spine.with_values(fit.spine.chain.values[0], laws_of(numbers, fit.size)).chain
    wanted, first = np.append(fit.patient.read.films[RIGHT].top, 0.0), chain.reached(0.0 * found.q)
    last = None
    for share in np.linspace(0.0, 1.0, 201)[1:]:  # small steps, each from the pose before
        step = hold_at(chain, first + share * (wanted - first), last)
        assert last is None or np.abs(step.q - last.q).max() < np.deg2rad(0.5)
        last = step
    assert last is not None
    np.testing.assert_allclose(found.q, last.q, rtol=0, atol=1e-7)


def test_a_fit_from_poses_off_the_path_ends_on_it(cohort: Cohort) -> None:
    """Trial poses begin on another path; what is told are errors of the poses from neutral."""
    fit, population = fit_of(cohort, "p14"), usual_population(SEGMENTS)
    unknowns = list(fit._guesses(population))[2]
    off, _ = held_off_the_path(fit, unknowns[:-READINGS])
    usual = fit.fit(population)
    before = replace(usual, unknowns=unknowns, poses={**usual.poses, RIGHT: off})
    for start in (None, before):
        found = fit.fit(population, start)
        assert found.status.usable
        from_neutral = cost_from_neutral(fit, population, found.unknowns)
        assert found.cost == pytest.approx(from_neutral, rel=1e-9)
        for position, held in found.poses.items():
            np.testing.assert_allclose(held.q, fit.near[position].q, rtol=0, atol=1e-9)


def test_the_least_of_several_optima_is_taken_and_they_are_counted(cohort: Cohort) -> None:
    """p17: from one start in three the cost ends a quarter higher."""
    fit = fit_of(cohort, "p17")
    found = fit.fit(LEARNED)
    assert (found.status, found.n_optima) == (Status.CONVERGED, 2)
    ends = []
    for start in fit.starts(LEARNED):
        one = fit_of(cohort, "p17")
        one.starts = lambda *_, start=start: [start]  # type: ignore[method-assign]
        ends.append(one.fit(LEARNED))
    costs = [one.cost for one in ends]
    assert found.cost <= min(costs) * (1.0 + 1e-3)
    assert max(costs) > 1.2 * min(costs)
    assert {one.n_optima for one in ends} == {1}


def test_starts_of_one_patient_are_those_of_its_mirror_image(cohort: Cohort) -> None:
    """Ends exchanged, the population's ends as wide on either side."""
    fit, s = fit_of(cohort, "p01"), SEGMENTS
    level = replace(LEARNED, mean=np.concatenate([LEARNED.mean[: 2 * s], LEARNED.mean[s : 2 * s]]))
    fit._beyond_films = lambda numbers, beyond: numbers  # type: ignore[method-assign]
    starts = [one[0][:-READINGS] for one in fit.starts(level)[1:]]
    turned = [np.concatenate([one[:s], one[2 * s :], one[s : 2 * s]]) for one in starts]
    half = len(starts) // 2
    np.testing.assert_array_equal(starts, turned[half:] + turned[:half])


def test_fits_side_by_side_are_those_of_each_alone(cohort: Cohort) -> None:
    fits = [fit_of(cohort, name) for name in ("p02", "p18")]
    for fit, found in zip(fits, fit_alike(fits, LEARNED, [None, None]), strict=True):
        own = fit.fit(LEARNED)
        assert found is not None
        assert found.n_optima == own.n_optima
        np.testing.assert_allclose(found.unknowns, own.unknowns, rtol=0, atol=1e-6)


def test_a_multiplier_at_its_bound_is_told(cohort: Cohort) -> None:
    """p06 is held at the factor of 10, 0.468 to 4.680; the region between them is not."""
    personal = linear_regions(patient_of(STUDY, cohort, "p06"), STUDY)
    assert personal.fitting == (Status.CONVERGED_AT_BOUND, 1)
    held, free = personal.ratio[personal.constrained], personal.ratio[~personal.constrained]
    np.testing.assert_allclose(np.unique(held.round(6)), [0.467993, 4.679927], rtol=0, atol=5e-4)
    assert np.unique(free.round(6)).size == 1
    rows = rows_of(STUDY, cohort, "p06", "linear_regions")
    laws = from_rows(LAWS, rows["laws"]).to_pandas()
    assert set(laws["fit_status"]) == {"converged_at_bound"}
    assert laws["constrained"].tolist() == personal.constrained.tolist()
    positions = from_rows(POSITIONS, rows["positions"]).to_pandas()
    assert positions["message"].str.contains("bound").all()


def test_regions_of_which_one_start_would_not_tell(cohort: Cohort) -> None:
    """p11 has a second optimum at the other end; p13's least cost is at a pose not from neutral."""
    fit, found, n_optima = region_optimum(patient_of(STUDY, cohort, "p11"))
    assert (n_optima, found is not None) == (2, True)
    fit, found, _ = region_optimum(patient_of(STUDY, cohort, "p13"))
    assert found is not None
    fit.near = {}
    missed = fit.missed(found.x)
    assert missed is not None
    assert found.cost == pytest.approx(float(missed[0] @ missed[0]), rel=1e-9)


def test_a_fit_of_regions_without_poses_is_not_converged(
    cohort: Cohort, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("spinepipe.studies.scoliosis.personal.RegionFit.missed", lambda *_: None)
    personal = linear_regions(patient_of(STUDY, cohort, "p06"), STUDY)
    assert personal.fitting == (Status.NOT_CONVERGED, 0)
    assert np.ptp(personal.ratio) == 0.0


def test_a_population_that_still_moves_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    few = shipped(2)
    silent = Progress(lambda line: None)
    for rounds, settled in ((1, False), (20, True)):
        monkeypatch.setattr(learning, "MOST_ROUNDS", rounds)
        found = learning.fit_population(STUDY, few, SD, silent)
        assert found.settled is settled
        table = from_rows(POPULATION, list(population_rows(found, few.joint_names, SD)))
        rows: pd.DataFrame = table.to_pandas()
        status = "converged" if settled else "not_converged"
        assert set(rows["status"]) == {status}
        assert rows["message"].str.contains("still changed").all() == (not settled)
        if not settled:
            quick = STUDY.model_copy(update={"film_regions": False})
            made = rows_of(quick, few, "p02", "tangent_fitted", rows)
            assert all(UNSETTLED in row["message"] for row in made["positions"])


CLOSE = DescentTolerances(cost=1e-15, step=1e-9, slope=1e-15, evaluations=200)


class Line:
    """A spine without films: where its one number is beyond 1 it stands on another path."""

    def __init__(self) -> None:
        self.near: dict[str, PrescribedResult] = {}

    def point(self, x: Array) -> tuple[Array, Array] | None:
        side = 1.0 if x[0] > 1.0 and not self.near else -1.0  # from near, the pose of before stays
        self.near = {
            "film": PrescribedResult(
                side * np.ones(6), np.zeros(1), x, PrescribedStatus.CONVERGED, "", 0
            )
        }
        residual = np.array([x[0] - 2.0 if side < 0.0 else x[0] - 1.0 + 3.0])
        return residual, np.ones((1, 1))


def test_a_fit_that_ends_where_poses_leave_for_another_path_has_not_converged() -> None:
    """Cost falls up to 1, beyond which the poses from neutral are others and worse."""

    limits = (np.array([-5.0]), np.array([5.0]), np.ones(1))
    line = Line()
    found = optimum(line, line.point, [np.zeros(1)], {}, limits, CLOSE)
    assert found is not None
    assert found.x[0] == pytest.approx(1.0, abs=1e-6)
    assert found.status is Status.NOT_CONVERGED


def test_ends_that_tie_or_are_near_count_once_and_the_first_is_taken() -> None:
    def end(x: float, cost: float, status: Status = Status.CONVERGED) -> FilmOptimum:
        root, at = np.array([np.sqrt(cost)]), np.array([x])
        return FilmOptimum(at, root, np.ones((1, 1)), {}, status, np.zeros(1, dtype=bool))

    lost = end(9.0, 0.5, Status.NOT_CONVERGED)
    ends = [end(0.0, 1.0005), None, end(0.05, 1.0), end(3.0, 2.0), lost]
    assert best(ends, np.ones(1)) == (ends[0], 2)
    assert best([None, lost], np.ones(1)) == (lost, 0)
    assert best([None], np.ones(1)) == (None, 0)
