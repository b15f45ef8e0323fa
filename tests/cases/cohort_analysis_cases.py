"""Rows of errors, fits and stiffness of cohort studies, made up for their analyses."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.jobs.tested_rows import corrected_rows
from spinepipe.studies.cohort_stiffness.claims import CohortClaim
from spinepipe.studies.cohort_stiffness.findings import finding_rows
from spinepipe.studies.cohort_stiffness.mae import mae_rows
from spinepipe.studies.cohort_stiffness.ranking import ranking_rows
from spinepipe.studies.cohort_stiffness.significance import all_tests
from spinepipe.studies.cohort_stiffness.tables import FINDINGS, MAE, RANKING, STATISTICS
from spinepipe.tables import from_rows
from spinepipe.units import ROTATIONS

Row = dict[str, Any]

SOURCES = {
    "literature": "literature",
    "fitted": "own",
    "left_out_case": "own",
    "left_out_specimen": "others_median",
}


def seen(
    specimen: str,
    joint: str,
    error: float | None,
    representation: str = "per_specimen",
    stage: str = "fitted",
    test: str = "flexion",
    fitted_to: str = "flexion",
    **more: Any,
) -> Row:
    """A row of ``errors``: the loaded extension, with the same error in every measure."""
    size = None if error is None else abs(error)
    row = {
        **{"specimen": specimen, "representation": representation, "fitted_to": fitted_to},
        **{"source": SOURCES[stage], "stage": stage, "test": test, "joint": joint},
        **{"coordinate": "extension", "loaded": True, "readings": 10, "bias": error},
        **{"mae": size, "rmse": size, "peak_error": error, "measured": 5.0},
        "measured_peak": 10.0,
    }
    return row | more


def statistics_of(errors: Iterable[Row], fits: pd.DataFrame | None = None) -> pd.DataFrame:
    """Table ``statistics`` of such errors."""
    no_fits = pd.DataFrame(columns=["specimen", "representation", "fitted_to", "cost"])
    rows = all_tests(pd.DataFrame(errors), no_fits if fits is None else fits)
    return from_rows(STATISTICS, list(corrected_rows(rows))).to_pandas()


def only(table: pd.DataFrame, **wanted: str) -> pd.Series:
    """The one row with these values."""
    for name, value in wanted.items():
        table = table[table[name] == value]
    assert len(table) == 1
    return table.iloc[0]


def series(*values: float, names: str = "abcdef") -> pd.Series:
    return pd.Series(values, index=list(names[: len(values)]))


def fit(
    fitted_to: str, cost: float | None, readings: int, unknowns: int = 1, at_bounds: int = 0
) -> Row:
    freedom = None if cost is None else readings - unknowns + at_bounds
    row = {"specimen": "a", "representation": "per_joint", "fitted_to": fitted_to, "cost": cost}
    row |= {"readings": readings, "unknowns": unknowns, "degrees_of_freedom": freedom}
    return row | {"aicc": cost, "bic": cost}


def stiff(specimen: str, joint: str, log: float, **more: Any) -> Row:
    row: Row = {"specimen": specimen, "joint": joint, "coordinate": "extension", "source": "own"}
    row |= {"representation": "per_joint", "fitted_to": "all", "stiffness": np.exp(log)}
    row |= {"standard_error": 0.1 * np.exp(log), "identifiable": True, "at_bound": "no"}
    return row | more


RATINGS = ((9, 2, 5, 8), (6, 1, 3, 2), (8, 4, 6, 8), (7, 1, 2, 6), (10, 5, 6, 9), (6, 2, 4, 7))
"""Shrout and Fleiss 1979, doi:10.1037/0033-2909.86.2.420, Table 2: six targets, four judges."""


def rated() -> list[Row]:
    return [
        stiff(name, joint, float(rating))
        for name, ratings in zip("abcdef", RATINGS, strict=True)
        for joint, rating in zip(("L2L3", "L3L4", "L4L5", "L5S1"), ratings, strict=True)
    ]


def analysed(frames: Mapping[str, pd.DataFrame]) -> dict[str, pd.DataFrame]:
    """All analyses of the tables of a study, through their schemas."""
    errors, fits = frames["errors"], frames["fits"]
    tested = list(corrected_rows(all_tests(errors, fits)))
    statistics = from_rows(STATISTICS, tested).to_pandas()
    said = list(finding_rows({**frames, "statistics": statistics}, 0.05))
    order = ranking_rows(errors, fits, frames.get("pooling"))
    return {
        "mae": from_rows(MAE, mae_rows(errors)).to_pandas(),
        "ranking": from_rows(RANKING, order).to_pandas(),
        "statistics": statistics,
        "findings": from_rows(FINDINGS, said).to_pandas(),
    }


CLAIM = CohortClaim("name", "It is so.", "a number", "deg")
JOINTS = ("L3L4", "L4L5", "L5S1")


def study(
    specimens: str = "abc",
    tests: tuple[str, ...] = ("flexion", "bend", "twist"),
    representations: tuple[str, ...] = ("per_specimen", "level_ratio", "per_joint"),
    levels: bool = True,
    held_out: bool = True,
) -> dict[str, pd.DataFrame]:
    """Errors, fits and stiffness with random numbers, as the jobs before would write them."""
    rng = np.random.default_rng(1)
    labels = (*tests, *(("all",) if len(tests) > 1 else ()))
    folds = tuple(f"all_but_{test}" for test in tests) if len(tests) > 2 and held_out else ()
    errors: list[Row] = []
    fits: list[Row] = []
    stiffness: list[Row] = []

    def tell(specimen: str, name: str, label: str, stage: str, test: str) -> None:
        for joint in JOINTS:
            for place, c in enumerate(ROTATIONS):
                here = {"coordinate": c, "loaded": tests.index(test) == place}
                error = float(rng.normal())
                errors.append(seen(specimen, joint, error, name, stage, test, label, **here))

    for specimen in specimens:
        for test in tests:
            for name in ("literature", *(("literature_levels",) if levels else ())):
                tell(specimen, name, "nothing", "literature", test)
        for name in representations:
            for label in (*labels, *folds):
                of = {"specimen": specimen, "representation": name, "fitted_to": label}
                within = [test for test in tests if label in (test, "all")]
                within += [t for t in tests if label[:7] == "all_but" and label[8:] != t]
                cost = float(rng.uniform(30, 60)) * len(within)
                fits.append(fit(label, cost, 60 * len(within), 3) | of)
                for joint in JOINTS:
                    stiffness += [
                        stiff(specimen, joint, float(rng.normal()), coordinate=c) | of
                        for c in ROTATIONS
                    ]
                for test in tests:
                    stage = "fitted" if test in within else "left_out_case"
                    tell(specimen, name, label, stage, test)
                    if held_out and len(specimens) > 1 and label in labels and test in within:
                        tell(specimen, name, label, "left_out_specimen", test)
    frames = {"errors": pd.DataFrame(errors), "stiffness": pd.DataFrame(stiffness)}
    columns = list(fit("x", 0.0, 0))
    return frames | {"fits": pd.DataFrame(fits, columns=columns)}


def without_rotations_in(test: str, **choices: Any) -> dict[str, pd.DataFrame]:
    """One test was read in a translation only, in which it has no main moment."""
    frames = study(**choices)
    errors = frames["errors"]
    here = errors["test"] == test
    errors.loc[here, "loaded"] = False
    errors = errors[~here | (errors["coordinate"] == "extension")].copy()
    errors.loc[errors["test"] == test, "coordinate"] = "superior"
    return {**frames, "errors": errors}
