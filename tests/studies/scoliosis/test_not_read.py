"""Films on which vertebrae lack: used as far as they go, and told.

Would catch a patient refused for a gap, a place that nobody read held against a model, a spine
whose films end at different vertebrae, and numbers of a shorter spine given to other segments.
"""

from dataclasses import replace

import numpy as np
import pandas as pd
from scoliosis_cases import STUDY, shipped
from sweeps import sweep

from spinepipe.cohort import Cohort
from spinepipe.progress import Progress
from spinepipe.studies.scoliosis.clinical import clinical_rows
from spinepipe.studies.scoliosis.film_fit import FilmFit, FilmInformation
from spinepipe.studies.scoliosis.films import LEFT, RIGHT, filled, film_sd, read_films
from spinepipe.studies.scoliosis.fit_population import fit_population
from spinepipe.studies.scoliosis.not_read import not_read_rows
from spinepipe.studies.scoliosis.personal import patient_of
from spinepipe.studies.scoliosis.personalise import rows_of
from spinepipe.studies.scoliosis.population import population_rows, usual_population
from spinepipe.studies.scoliosis.tables import DISPLACEMENTS, POPULATION, POSITIONS
from spinepipe.tables import from_rows

SD = film_sd(0.5, 0.5, 1.0, 0.5)
WHOLE = shipped(2)
BOTTOM, MIDDLE, TOP = (WHOLE.vertebrae[at] for at in (0, 7, -1))


def lacking(*gone: tuple[str, str], patient: str = "p01") -> Cohort:
    """The cohort without vertebrae of films of a patient."""
    films = WHOLE.further["films"]
    at = pd.MultiIndex.from_frame(films[["position", "vertebra"]])
    rows = (films["specimen"] != patient) | ~at.isin(gone)
    return replace(WHOLE, further={**WHOLE.further, "films": films[rows]})


def told(cohort: Cohort) -> list[tuple[str, ...]]:
    names = ("specimen", "position", "vertebra", "was_read", "made_of_it")
    return [tuple(row[name] for name in names) for row in not_read_rows(cohort)]


def test_where_all_is_read_nothing_is_told() -> None:
    assert told(WHOLE) == []
    read = read_films(WHOLE, "p01")
    assert read.vertebrae == WHOLE.vertebrae
    assert all(read.compared(position).all() for position in read.films)


def test_a_gap_is_filled_by_a_smooth_curve_or_as_the_base_moves() -> None:
    """A cubic is found again; over a bent base what it moved by is."""
    at, seen = np.arange(8.0), np.arange(8) != 4
    cubic = np.stack([at**3, at**2 - at, 1.0 + at])
    np.testing.assert_allclose(filled(cubic[:, seen], seen, np.zeros((3, 8))), cubic, atol=1e-9)
    base = np.stack([np.sin(9.0 * at)] * 3)
    moved = base + cubic
    np.testing.assert_allclose(filled(moved[:, seen], seen, base), moved, atol=1e-9)


@sweep("position", ["erect", RIGHT, "traction"])
def test_a_vertebra_between_is_put_near_and_not_compared(position: str) -> None:
    cohort = lacking((position, MIDDLE))
    assert told(cohort) == [("p01", position, MIDDLE, False, "interpolated")]
    read, before = read_films(cohort, "p01"), read_films(WHOLE, "p01")
    there = np.arange(len(before.vertebrae)) != 7
    np.testing.assert_array_equal(
        read.films[position].rows[:, there], before.films[position].rows[:, there]
    )
    off = (read.films[position].rows - before.films[position].rows)[:, 7]
    assert 1e3 * np.hypot(*off[:2]) < 1.0
    assert np.rad2deg(abs(off[2])) < 2.0
    for name in read.films:
        expected = there if position in ("erect", name) else there | True
        np.testing.assert_array_equal(read.compared(name), expected)
    found = rows_of(STUDY, cohort, "p01", "tangent")
    empty = {
        (row["position"], row["joint"])
        for row in found[DISPLACEMENTS.name]
        if row["measured_deg"] is None
    }
    joints = [cohort.joint_names[at] for at in (6, 7)]
    films = [name for name in read.films if name != "erect"]
    where = films if position == "erect" else [position]
    assert empty == {(name, joint) for name in where for joint in joints}
    assert all(row["rotation_rmse_deg"] < 2.0 for row in found[POSITIONS.name])
    # two errors of place and tilt less of each film that the fit compares
    films = [FilmFit(patient_of(STUDY, one, "p01"), SD) for one in (WHOLE, cohort)]
    unknowns = np.append(usual_population(len(WHOLE.joint_names)).mean, np.zeros(12))
    whole, gap = (len(fit.missed(unknowns)[0]) for fit in films)
    assert whole - gap == {"erect": 6, RIGHT: 3, "traction": 0}[position]


@sweep("vertebra, end", [(BOTTOM, 0), (TOP, -1)])
@sweep("position", ["erect", LEFT])
def test_a_spine_ends_where_the_erect_and_both_bending_films_do(
    vertebra: str, end: int, position: str
) -> None:
    cohort = lacking((position, vertebra))
    of_film = [row[1:] for row in told(cohort)]
    assert sorted(of_film) == sorted(
        (name, vertebra, name != position, "spine_shortened")
        for name in ("erect", RIGHT, LEFT, "neutral", "traction")
    )
    left = tuple(name for name in WHOLE.vertebrae if name != vertebra)
    read = read_films(cohort, "p01")
    assert read.vertebrae == left
    assert read.lowest == (1 if end == 0 else 0)
    for film in read.films.values():
        np.testing.assert_allclose(film.rows[:, 0], 0.0, atol=1e-12)
        assert len(film.up) == len(left)
    # rotations of the segments that are left are those of the whole spine
    kept = slice(1, None) if end == 0 else slice(None, -1)
    whole = read_films(WHOLE, "p01").turned(RIGHT)
    np.testing.assert_allclose(read.turned(RIGHT), whole[kept], atol=1e-12)
    assert patient_of(STUDY, cohort, "p01").chain.joints == WHOLE.joint_names[kept]


@sweep("gone", [[TOP], [BOTTOM], list(WHOLE.vertebrae[1:-1]), list(WHOLE.vertebrae)])
def test_a_held_out_film_without_the_ends_is_left_out(gone: list[str]) -> None:
    cohort = lacking(*(("traction", name) for name in gone))
    assert set(read_films(cohort, "p01").films) == set(read_films(WHOLE, "p01").films) - {
        "traction"
    }
    rows = told(cohort)
    assert len(rows) == (len(WHOLE.vertebrae) if len(gone) < len(WHOLE.vertebrae) else 0)
    assert {row[-1] for row in rows} <= {"film_left_out"}


def test_clinics_angles_of_gaps_are_empty() -> None:
    row = next(iter(clinical_rows(WHOLE)))
    cohort = lacking(("neutral", row["apex_vertebra"]))
    rows = [one for one in clinical_rows(cohort) if one["specimen"] == "p01" and one["curve"] == 0]
    empty = {one["position"] for one in rows if one["apical_translation_mm"] is None}
    assert empty == {"neutral"}
    assert all(one["cobb_deg"] is not None for one in rows)


def test_films_of_a_shorter_spine_say_nothing_of_other_segments() -> None:
    """Two segments of four, the first left out: numbers 1, 2 of each quantity."""
    information = FilmInformation(np.arange(36.0).reshape(6, 6) + 1.0, np.arange(6.0) + 1.0)
    found = information.of_all(1, 4)
    at = [1, 2, 5, 6, 9, 10]
    np.testing.assert_array_equal(found.matrix[np.ix_(at, at)], information.matrix)
    np.testing.assert_array_equal(found.vector[at], information.vector)
    assert np.count_nonzero(found.matrix) == 36
    part = replace(usual_population(4), mean=np.arange(12.0)).of_part(1, 2)
    np.testing.assert_array_equal(part.mean, at)
    assert part.segments == 2


def test_a_population_is_learned_from_spines_of_different_length() -> None:
    """One without its top: means of all levels, near those of whole films."""
    cohort = lacking((LEFT, TOP), patient="p02")
    quiet = Progress(lambda line: None)
    found, whole = (fit_population(STUDY, one, SD, quiet) for one in (cohort, WHOLE))
    assert found.patients == 2
    means = found.population.mean, whole.population.mean
    assert len(means[0]) == 3 * len(cohort.joint_names)
    np.testing.assert_allclose(*means, atol=0.1)
    table = from_rows(POPULATION, list(population_rows(found, cohort.joint_names, SD))).to_pandas()
    study = STUDY.model_copy(update={"film_regions": False})
    laws = rows_of(study, cohort, "p02", "tangent_fitted", table)["laws"]
    assert tuple(row["joint"] for row in laws) == cohort.joint_names[:-1]


def test_readings_of_one_film_may_be_of_corners_and_of_centres() -> None:
    """A second reading by corners, of all but one vertebra, moves the mean and makes the gap."""
    films = WHOLE.further["films"]
    again = films[(films["position"] == "neutral") & (films["vertebra"] != MIDDLE)].copy()
    again["repeat"] = 2
    turn = np.deg2rad(again["orientation_deg"].astype(float))
    across, up = np.array([np.cos(turn), -np.sin(turn)]), np.array([np.sin(turn), np.cos(turn)])
    centre = again[["y_mm", "z_mm"]].to_numpy(float).T + np.array([[0.0], [4.0]])
    for end, side in ((e, s) for e in ("upper", "lower") for s in ("left", "right")):
        at = centre + across * (20.0 if side == "left" else -20.0)
        at = at + up * (12.0 if end == "upper" else -12.0)
        again[[f"{end}_{side}_y_mm", f"{end}_{side}_z_mm"]] = at.T
    again[["y_mm", "z_mm", "orientation_deg"]] = np.nan
    cohort = replace(WHOLE, further={**WHOLE.further, "films": pd.concat([films, again])})
    read, whole = read_films(cohort, "p01"), read_films(WHOLE, "p01")
    assert read.readings["neutral"] == 2
    assert not read.compared("neutral")[7]
    assert read.compared("neutral").sum() == len(WHOLE.vertebrae) - 1
    off = read.films["neutral"].rows - whole.films["neutral"].rows
    np.testing.assert_allclose(np.delete(off, 7, axis=1), 0.0, atol=1e-9)
