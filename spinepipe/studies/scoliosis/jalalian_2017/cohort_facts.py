"""What the paper's patients and films are, beside those that were made after them.

Tables that are no results: `patients` and `films` of the cohort's folder, and `erect`, the Cobb
angle of each patient's main curve as it is on the erect film.
"""

from collections.abc import Callable, Iterator

import numpy as np
import pandas as pd

from spinepipe.comparison.claim import Claim, NotComputed, Ours, Run, exactly
from spinepipe.studies.scoliosis.films import ERECT
from spinepipe.studies.scoliosis.jalalian_2017.paper import (
    PATIENTS,
    SEGMENTS,
    TABLE_1,
    YES_NO,
    correlation,
    nearly,
    put_in,
    rounded,
)

READINGS = 5 * SEGMENTS * PATIENTS
"""Tilts of all films, the lowest vertebra's left out, whose are 0."""

INTER_OBSERVER = 0.90
INTRA_OBSERVER = {1: (0.95, 0.03), 2: (0.92, 0.02)}
"""Pearson r of an observer's repeats, mean and SD."""

WHERE = "section 2.1"


def claims_of_cohort() -> Iterator[Claim]:
    """Patients, then films, then how well these are read."""
    yield from _table_1()
    yield from _patients()
    yield from _films()
    yield from _readings()
    yield from _reliability()


def _table_1() -> Iterator[Claim]:
    for number, (sex, age, lenke, cobb) in enumerate(TABLE_1, start=1):
        name = f"p{number:02d}"
        for column, text in (("sex", sex), ("lenke_class", lenke)):
            yield put_in(
                f"table_1.{name}.{column}",
                "Table 1",
                f"patient {number} is {text}",
                YES_NO,
                1.0,
                _has(name, column, text),
            )
        for column, what, unit, value in (
            ("age_years", "age", "years", age),
            ("cobb_deg", "Cobb angle of the main curve", "deg", cobb),
        ):
            yield put_in(
                f"table_1.{name}.{column}",
                "Table 1",
                f"{what} of patient {number}",
                unit,
                float(value),
                _number(name, column),
            )


def _has(name: str, column: str, text: str) -> Callable[[Run], Ours]:
    return lambda run: Ours(float(str(run.row("patients", specimen=name)[column]) == text))


def _number(name: str, column: str) -> Callable[[Run], Ours]:
    return lambda run: Ours(run.number("patients", column, specimen=name))


def _patients() -> Iterator[Claim]:
    yield _count("n_patients", "patients", PATIENTS, _distinct("patients", "specimen"))
    for sex, count in (("female", 12), ("male", 6)):
        yield _count(f"n_patients.{sex}", f"{sex} patients", count, _of_sex(sex))
    ages = (("age", "mean", 15.0), ("age.low", "min", 12.0), ("age.high", "max", 19.0))
    for key, statistic, paper in ages:
        yield put_in(
            f"results.{key}",
            WHERE,
            f"{statistic} age",
            "years",
            paper,
            _statistic("patients", "age_years", statistic),
            rounded(paper, 1.0),
        )
    for key, statistic, paper in (
        ("cobb_mean", "mean", 56.0),
        ("cobb_mean.low", "min", 46.0),
        ("cobb_mean.high", "max", 86.0),
        ("cobb_median", "median", 53.0),
    ):
        yield put_in(
            f"results.{key}",
            WHERE,
            f"{statistic} Cobb angle of the main curves, as the erect films have it",
            "deg",
            paper,
            _statistic("erect", "cobb_deg", statistic),
            rounded(paper, 1.0),
            "films are read with an error, and the largest of several curves is taken",
        )


def _of_sex(sex: str) -> Callable[[Run], Ours]:
    return lambda run: Ours(float((run.rows("patients")["sex"] == sex).sum()))


def _distinct(table: str, column: str) -> Callable[[Run], Ours]:
    return lambda run: Ours(float(run.rows(table)[column].nunique()))


def _statistic(table: str, column: str, statistic: str) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        values = run.rows(table)[column].dropna().astype(float)
        if values.empty:
            raise NotComputed(f"{column} is empty in {table}")
        return Ours(float(values.agg(statistic)))

    return ours


def _count(key: str, quantity: str, paper: int, ours: Callable[[Run], Ours]) -> Claim:
    return put_in(f"results.{key}", WHERE, quantity, "count", float(paper), ours)


def _films() -> Iterator[Claim]:
    yield _count("xrays_per_patient", "films of a patient", 5, _films_of_a_patient)
    vertebrae = _distinct("films", "vertebra")
    yield _count("levels_measured.vertebrae", "vertebrae, L4 to T2", SEGMENTS + 1, vertebrae)
    segments = _distinct("displacements", "joint")
    yield _count("levels_measured.segments", "motion segments, L4 to T2", SEGMENTS, segments)
    yield _count("n_motion_segments", "motion segments, L3L4 to T2T3", SEGMENTS, segments)


def _films_of_a_patient(run: Run) -> Ours:
    counts = run.rows("films").groupby("specimen")["position"].nunique()
    return Ours(float(counts.median()), float(counts.min()), float(counts.max()))


def _readings() -> Iterator[Claim]:
    for key, quantity, unit, columns in (
        ("pixel_size", "step in which places are read", "mm", ("y_mm", "z_mm")),
        ("theta_step", "step in which tilts are read", "deg", ("orientation_deg",)),
    ):
        ours = _step(columns)
        yield put_in(f"results.{key}", WHERE, quantity, unit, 0.1, ours, nearly(0.1, 1e-6))
    for key, quantity, paper, column in (
        ("observers", "observers of a film", 2, "observer"),
        ("observers.repeats", "readings of a film by each observer", 3, "repeat"),
    ):
        yield _count(key, quantity, paper, _each(column))
    yield put_in(
        "results.origin_frame",
        WHERE,
        "largest number read at L4, whose frame it is (mm or deg)",
        "see quantity",
        0.0,
        _at_the_lowest,
        nearly(0.0),
    )


def _step(columns: tuple[str, ...]) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        read = run.rows("films")[list(columns)].to_numpy(float).ravel()
        apart = np.diff(np.unique(np.round(read[np.isfinite(read)], 6)))
        if not len(apart):
            raise NotComputed(f"the films have no numbers in {', '.join(columns)}")
        return Ours(float(apart.min()))

    return ours


def _each(column: str) -> Callable[[Run], Ours]:
    """How many observers, or readings of each; a film that does not say was read once."""

    def ours(run: Run) -> Ours:
        films = run.rows("films")
        film = ["specimen", "position", *(["observer"] if column == "repeat" else [])]
        counts = films.fillna({"observer": ""}).groupby(film)[column].nunique().clip(lower=1)
        return Ours(float(counts.median()), float(counts.min()), float(counts.max()))

    return ours


def _at_the_lowest(run: Run) -> Ours:
    films = run.rows("films", vertebra="L4")
    read = films[["y_mm", "z_mm", "orientation_deg"]].to_numpy(float)
    if not np.isfinite(read).any():
        raise NotComputed("the films have no centres and tilts at L4")
    return Ours(float(np.nanmax(np.abs(read))))


def _reliability() -> Iterator[Claim]:
    for observer, (mean, sd) in INTRA_OBSERVER.items():
        for suffix, what, value in (("", "mean", mean), (".spread", "SD", sd)):
            yield Claim(
                f"results.intra_observer_reliability_{observer}{suffix}",
                WHERE,
                f"Pearson r of the repeats of observer {observer}, {what}",
                "r",
                value,
                exactly(value),
                _nobody_repeats,
                "",
            )
    yield Claim(
        "results.inter_observer_reliability",
        WHERE,
        "Pearson r of tilts that two observers read",
        "r",
        INTER_OBSERVER,
        correlation(INTER_OBSERVER, READINGS),
        _between_observers,
        "the phantom's observers err as the generator says, and a correlation hangs on how far the "
        "tilts themselves differ",
        "what the paper correlates, tilts, places or rotations, is not said",
    )


def _nobody_repeats(run: Run) -> Ours:
    raise NotComputed("the phantom's observers read each film once")


def _between_observers(run: Run) -> Ours:
    films = run.rows("films")
    observers = films["observer"].dropna().unique()
    if len(observers) < 2:
        raise NotComputed("this cohort's films were read by one observer")
    tilts = [_tilts(films[films["observer"] == one]) for one in observers[:2]]
    rotations = [_rotations(one) for one in tilts]
    r_tilt, r_rotation = (_pearson(*pair) for pair in (tilts, rotations))
    return Ours(r_tilt, note=f"ours: {r_rotation:.3f} of rotations since the erect film")


def _tilts(rows: pd.DataFrame) -> pd.DataFrame:
    """Tilts, deg: a row per patient and film, a column per vertebra above the lowest."""
    order = rows["vertebra"].unique()
    wide = rows.pivot(index=["specimen", "position"], columns="vertebra", values="orientation_deg")
    return wide[list(order[1:])]


def _rotations(tilts: pd.DataFrame) -> pd.DataFrame:
    """Rotations of segments since the erect film, deg; the lowest vertebra's tilt is 0."""
    turned = tilts.diff(axis=1).fillna(tilts.iloc[:, [0]])
    erect = turned.xs(ERECT, level="position")
    others = turned.drop(index=ERECT, level="position")
    return others - erect.reindex(others.index.get_level_values("specimen")).to_numpy()


def _pearson(one: pd.DataFrame, other: pd.DataFrame) -> float:
    first, second = one.to_numpy(float).ravel(), other.reindex(one.index).to_numpy(float).ravel()
    if not (np.ptp(first) > 0.0 and np.ptp(second) > 0.0):
        raise NotComputed("readings that do not vary, or are missing, have no correlation")
    return float(np.corrcoef(first, second)[0, 1])
