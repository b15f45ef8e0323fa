"""Everything that may be wrong with films is told, with film, vertebra and remedy.

Would catch a fault of films that passes, sound films that are blamed, and words that do not name
the film, the vertebra or what to do.
"""

from collections.abc import Callable
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scoliosis_cases import STUDY, write_shipped
from sweeps import sweep

from spinepipe import cohort as cohorts
from spinepipe.documents.yaml_text import YamlDocument
from spinepipe.problems import InputError
from spinepipe.studies.scoliosis.checks import check_scoliosis
from spinepipe.studies.scoliosis.films import CENTRE, FILMS, PATIENTS


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A cohort of one patient without a fault."""
    folder = tmp_path_factory.mktemp("films") / "ais"
    write_shipped(folder, 1)
    return folder


def told(folder: Path, sound: Path, change: Callable[[pd.DataFrame], pd.DataFrame]) -> list[str]:
    """What is said of the sound cohort with its films changed."""
    folder = folder / "ais"
    folder.mkdir()
    for file in ("cohort.yaml", "specimens.csv", "patients.csv"):
        (folder / file).write_bytes((sound / file).read_bytes())
    change(pd.read_csv(sound / "films.csv")).to_csv(folder / "films.csv", index=False)
    document = YamlDocument("s.yaml", {"cohort": "ais"}, {})
    try:
        cohort = cohorts.read(folder, (FILMS, PATIENTS))
    except InputError as error:
        return [str(problem) for problem in error.problems]
    return [str(problem) for problem in check_scoliosis(document, STUDY, cohort)]


def on(table: pd.DataFrame, *positions: str) -> "pd.Series[bool]":
    return table["position"].isin(positions)


def test_sound_films_are_not_blamed(tmp_path: Path, sound: Path) -> None:
    assert told(tmp_path, sound, lambda table: table) == []


def mirrored(*positions: str) -> Callable[[pd.DataFrame], pd.DataFrame]:
    def change(table: pd.DataFrame) -> pd.DataFrame:
        rows = on(table, *positions)
        table.loc[rows, ["y_mm", "orientation_deg"]] *= -1.0
        return table

    return change


def exchanged(one: str, other: str) -> Callable[[pd.DataFrame], pd.DataFrame]:
    names = {one: other, other: one}
    return lambda table: table.assign(position=table["position"].replace(names))


def copied(source: str, target: str) -> Callable[[pd.DataFrame], pd.DataFrame]:
    def change(table: pd.DataFrame) -> pd.DataFrame:
        numbers = table.loc[on(table, source), list(CENTRE)].to_numpy()
        table.loc[on(table, target), list(CENTRE)] = numbers
        return table

    return change


def twice(table: pd.DataFrame) -> pd.DataFrame:
    again = table[on(table, "erect") & (table["vertebra"] == "T8")].assign(observer=None)
    both = table.assign(observer=None)
    return pd.concat([both, again])


def shifted(table: pd.DataFrame) -> pd.DataFrame:
    rows = on(table, "erect")
    table.loc[rows, "z_mm"] += 12.0
    return table


def without(position: str, vertebra: str | None = None) -> Callable[[pd.DataFrame], pd.DataFrame]:
    def change(table: pd.DataFrame) -> pd.DataFrame:
        gone = on(table, position)
        if vertebra is not None:
            gone &= table["vertebra"] == vertebra
        return table[~gone]

    return change


def without_all_but(position: str) -> Callable[[pd.DataFrame], pd.DataFrame]:
    return lambda table: table[on(table, position)]


def two_left(table: pd.DataFrame) -> pd.DataFrame:
    return table[~on(table, "left_bending") | table["vertebra"].isin(["L4", "T8"])]


def blank(table: pd.DataFrame) -> pd.DataFrame:
    table.loc[on(table, "erect"), list(CENTRE)] = None
    return table


def emptied(table: pd.DataFrame) -> pd.DataFrame:
    row = on(table, "right_bending") & (table["vertebra"] == "T5")
    table.loc[row, "orientation_deg"] = None
    return table


@sweep(
    "change, words",
    [
        (mirrored("right_bending"), ["film right_bending", "mirrored"]),
        (mirrored("right_bending", "left_bending"), ["both bending films", "exchange"]),
        (exchanged("right_bending", "left_bending"), ["both bending films", "exchange"]),
        (copied("erect", "right_bending"), ["right_bending", "the same as film erect"]),
        (copied("neutral", "traction"), ["film traction", "the same as film neutral"]),
        (shifted, ["film erect", "L4 at", "subtract its place"]),
        (without("erect"), ["no film of p01 in position erect", "add its rows"]),
        (without("left_bending"), ["no film of p01 in position left_bending"]),
        (two_left, ["film left_bending: 2 vertebrae read on all", "at least 3", "read more"]),
        (blank, ["film erect: 0 vertebrae read on all", "0 on this one"]),
        (without_all_but("erect"), ["no film of p01 in position right_bending"]),
        (emptied, ["film right_bending", "T5 has no orientation_deg", "fill the cells, or empty"]),
        (twice, ["film erect", "T8 twice", "a position once"]),
    ],
)
def test_a_fault_is_told_with_its_film_and_remedy(
    tmp_path: Path,
    sound: Path,
    change: Callable[[pd.DataFrame], pd.DataFrame],
    words: list[str],
) -> None:
    found = told(tmp_path, sound, change)
    assert found
    assert any(all(word in line for word in words) for line in found), "\n".join(found)


@sweep("positions, vertebrae", [(["erect"], ["T8"]), (["erect"], None), (["traction"], ["L4"])])
def test_corners_listed_around_a_vertebra_are_told_before_tilts(
    tmp_path: Path, sound: Path, positions: list[str], vertebrae: list[str] | None
) -> None:
    """Bodies 40 mm wide and 24 mm high, of which some have the lower corners exchanged."""

    def cornered(table: pd.DataFrame) -> pd.DataFrame:
        turn = np.deg2rad(table["orientation_deg"])
        wrong = on(table, *positions) & (
            table["vertebra"].isin(vertebrae) if vertebrae else table["vertebra"].notna()
        )
        for end, side in product((1, -1), (1, -1)):
            across = np.where(wrong & (end < 0), -20.0, 20.0) * side
            name = f"{'upper' if end > 0 else 'lower'}_{'left' if side > 0 else 'right'}"
            table[f"{name}_y_mm"] = table["y_mm"] + across * np.cos(turn) + 12 * end * np.sin(turn)
            table[f"{name}_z_mm"] = table["z_mm"] - across * np.sin(turn) + 12 * end * np.cos(turn)
        return table.drop(columns=list(CENTRE))

    (line,) = told(tmp_path, sound, cornered)
    assert f"film {positions[0]}: diagonals that do not cross inside" in line
    assert vertebrae is None or f"inside {vertebrae[0]};" in line


@sweep("vertebra", ["L4", "T8", "T1"])
@sweep("position", ["erect", "right_bending", "traction"])
def test_a_vertebra_that_was_not_read_is_no_fault(
    tmp_path: Path, sound: Path, position: str, vertebra: str
) -> None:
    assert told(tmp_path, sound, without(position, vertebra)) == []


def test_neutral_and_traction_may_be_missing(tmp_path: Path, sound: Path) -> None:
    kept = ["erect", "right_bending", "left_bending"]
    assert told(tmp_path, sound, lambda table: table[on(table, *kept)]) == []


def test_a_cohort_without_films_is_refused(sound: Path) -> None:
    cohort = cohorts.read(sound, (FILMS, PATIENTS))
    bare = type(cohort)(**{**vars(cohort), "further": {}})
    document = YamlDocument("s.yaml", {"cohort": "ais"}, {"cohort": 3})
    (problem,) = check_scoliosis(document, STUDY, bare)
    assert "films.csv" in problem.found
