"""Stiffness of the joints of a cohort, fitted to its measured motion."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pandas as pd
import xarray as xr

from spinepipe.api import plot
from spinepipe.api.result import Result, concluded, frame
from spinepipe.api.simulation import simulate
from spinepipe.api.study import NAME, Say, model_path, study_of
from spinepipe.cohort import Cohort
from spinepipe.model.file import EffectEntry, ModelFile, Scope, Values, read_model
from spinepipe.progress import silent
from spinepipe.status import USABLE
from spinepipe.studies.base_model import BUSHING
from spinepipe.studies.cohort_stiffness.fit import fitted
from spinepipe.studies.cohort_stiffness.left_out import predicted_by_others
from spinepipe.studies.cohort_stiffness.point_matrix import matrix_table
from spinepipe.studies.cohort_stiffness.pool import pooled
from spinepipe.studies.cohort_stiffness.problem import (
    base_effects,
    own_values_note,
    start_stiffness,
    with_stiffness,
)
from spinepipe.studies.cohort_stiffness.representations import POOLED
from spinepipe.studies.cohort_stiffness.settings import (
    NOBODY,
    CohortStiffness,
    joint_label,
    load_sets,
    tests_of,
)
from spinepipe.studies.cohort_stiffness.tables import ERRORS, FITS, PREDICTED_STIFFNESS, STIFFNESS
from spinepipe.units import STIFFNESS_COLUMNS

Row = dict[str, Any]
Rows = dict[str, list[Row]]

_TABLES = (STIFFNESS, PREDICTED_STIFFNESS, FITS, ERRORS)

Representation = Literal["per_specimen", "level_ratio", "per_joint", "partially_pooled"]


@dataclass(frozen=True, eq=False, repr=False)
class Stiffness(Result):
    """Fitted stiffness.

    Attributes
    ----------
    table : a row per specimen, joint and fitted coordinate: ``stiffness`` with ``low`` and ``high``
        (95 % region), ``identifiable``, ``at_bound``, ``status``. Fitted to all tests.
    fits : a row per specimen: readings, cost, optima, status.
    stiffness, predicted_stiffness, errors : all fits, what the others predict of each specimen, and
        errors of both, as the tables of the same names of a run.
    model : the fitted model, of the specimens that have a fit.
    """

    fits: pd.DataFrame
    stiffness: pd.DataFrame
    predicted_stiffness: pd.DataFrame
    errors: pd.DataFrame
    model: ModelFile
    cohort: Cohort

    def plot(self, ax: Any = None) -> Any:
        """Stiffness of each joint, see `spinepipe.plot.stiffness`."""
        coordinates = self.table["coordinate"]
        return plot.stiffness(self, coordinate=coordinates.iloc[0], ax=ax)

    @property
    def predicted(self) -> xr.Dataset:
        """Motion under all loads of the cohort, see `spinepipe.simulate`."""
        return simulate(self.model, self.cohort)

    def stiffness_matrix(
        self, point_mm: Sequence[float] = (0.0, 0.0, 0.0), joint: str | None = None
    ) -> pd.DataFrame:
        """The 6 x 6 stiffness and compliance of joints about a point, an entry a row.

        ``low`` and ``high`` end 95 % intervals; what is not known is NaN. At rest, without load.

        Parameters
        ----------
        point_mm : from the joint's origin along its axes.
        joint : which one; None for all.
        """
        found, names = [pd.DataFrame(columns=["joint"])], self.cohort.joint_names
        for specimen in dict.fromkeys(one.specimen for one in self.model.effects[0].values):
            rows = self.table[self.table["specimen"] == specimen]
            given = (one for one in self.model.effects[0].values if one.specimen == specimen)
            k = np.array([[one.parameters[c] for c in STIFFNESS_COLUMNS] for one in given])
            one = matrix_table(rows, k, names, point_mm)
            found.append(one.assign(specimen=specimen))
        every = pd.concat(found, ignore_index=True)
        return every if joint is None else every[every["joint"] == joint].reset_index(drop=True)

    @property
    def left_out(self) -> pd.DataFrame:
        """Errors on motion that the fits did not see; ``stage`` says what was left out."""
        unseen = self.errors["stage"].isin(("left_out_case", "left_out_specimen"))
        return self.errors[unseen].reset_index(drop=True)


def calibrate(
    cohort: Cohort,
    *,
    stiffness: Representation = "per_specimen",
    base: ModelFile | str | Path | None = None,
    free: Sequence[str] | None = None,
    tests: Sequence[str] | None = None,
    leave_out: Literal["test", "specimen"] | None = "test",
    settings: Mapping[str, Any] | None = None,
    say: Say = silent,
) -> Stiffness:
    """Fit the stiffness of every specimen to its measured motion.

    The numbers are those of a study of kind ``cohort_stiffness`` with these settings, to the bit.

    Parameters
    ----------
    stiffness : ``per_specimen``, one value of all joints; ``level_ratio``, published ratios of
        levels times one factor; ``per_joint``; ``partially_pooled``, each joint drawn towards its
        specimen and its cohort as far as the data ask for it.
    base : a model whose effects other than linear bushings act in every fit, such as
        ``find_missing_effects(cohort).model``.
    free : coordinates whose stiffness is fitted; the three rotations by default.
    tests : load cases that are used; all that have motion by default.
    leave_out : what is predicted without having been seen: each test, or each specimen.
    settings : any further keys of such a study, as in its file; they come before the others.
    say : told of each fit, such as `print`.

    Raises
    ------
    InputError
        With all that keeps these data from being fitted so.

    Examples
    --------
    >>> import spinepipe as sp
    >>> disc = sp.read_cohort("config/cohorts/l4l5_disc")
    >>> fit = sp.calibrate(disc, free=["extension"], tests=["extension"], leave_out=None)
    >>> list(fit.table.columns[:2]), fit.table["status"].unique().tolist()
    (['specimen', 'representation'], ['converged'])
    """
    with model_path(base) as path:
        asked = {
            "representations": [stiffness],
            "free": None if free is None else list(free),
            "tests": None if tests is None else list(tests),
            "base": None if path is None else {"model": path},
            "cross_validation": {
                "specimens": leave_out == "specimen",
                "load_cases": leave_out == "test",
            },
            **(settings or {}),
        }
        study = study_of(CohortStiffness, cohort, asked)
        file = None if path is None else read_model(path)
    rows = _rows(study, cohort, stiffness, leave_out, file, say)
    every = {one.name: frame(one, rows[one.name]) for one in _TABLES}
    label = joint_label(tests_of(study, cohort))
    own = every["stiffness"]
    own = own[own["fitted_to"] == label].reset_index(drop=True)
    fits = every["fits"]
    # neutral zones are of a run alone
    said = [one for one in concluded(study, cohort, every) if one.verdict != "neutral_zone"]
    return Stiffness(
        table=own,
        conclusions=said,
        fits=fits[fits["fitted_to"] == label].reset_index(drop=True),
        stiffness=every["stiffness"],
        predicted_stiffness=every["predicted_stiffness"],
        errors=every["errors"],
        model=_model(study, cohort, stiffness, own, file),
        cohort=cohort,
    )


def _rows(
    study: CohortStiffness,
    cohort: Cohort,
    name: str,
    leave_out: str | None,
    file: ModelFile | None,
    say: Say,
) -> Rows:
    """Rows of all tables, of all fits."""
    tests = tests_of(study, cohort)
    whole = joint_label(tests)
    labels = load_sets(study, tests) if leave_out == "test" else (whole,)
    found: Rows = {one.name: [] for one in _TABLES}

    def add(rows: Mapping[str, list[Row]], **where: str) -> None:
        for table, own in rows.items():
            for row in own if table in found else ():
                others = table == STIFFNESS.name and row["source"] != "own"
                found[PREDICTED_STIFFNESS.name if others else table].append({**where, **row})

    newcomers = cohort.specimen_names if leave_out == "specimen" else ()
    if name in POOLED:
        folds = [*((label, NOBODY) for label in labels), *((whole, one) for one in newcomers)]
        for label, without in folds:
            say(f"pooled fit to {label}, without {without}")
            others = {
                one: base_effects(file, cohort, one, left_out=one == without)
                for one in cohort.specimen_names
            }
            note = "" if without == NOBODY else own_values_note(file, cohort, without)
            rows = pooled(study, cohort, name, label, without, others, note)
            add(rows, representation=name, fitted_to=label)
        return found
    for specimen in cohort.specimen_names:
        for label in labels:
            say(f"{specimen}: fit to {label}")
            rows = fitted(
                study, cohort, specimen, name, label, base_effects(file, cohort, specimen)
            )
            add(rows, specimen=specimen, representation=name, fitted_to=label)
    of_all = [row for row in found["stiffness"] if row["fitted_to"] == whole]
    for specimen in newcomers:
        say(f"{specimen}: predicted from the others")
        fits = [
            frame(STIFFNESS, [row for row in of_all if row["specimen"] == one])
            for one in cohort.specimen_names
            if one != specimen
        ]
        beside = base_effects(file, cohort, specimen, left_out=True)
        note = own_values_note(file, cohort, specimen)
        rows = predicted_by_others(study, cohort, specimen, name, whole, fits, beside, note)
        add(rows, specimen=specimen, representation=name, fitted_to=whole)
    return found


def _model(
    study: CohortStiffness, cohort: Cohort, name: str, own: pd.DataFrame, file: ModelFile | None
) -> ModelFile:
    """Bushings with the fitted values, published where nothing was fitted, and the base's effects.

    Specimens without a fit are not in its scope.
    """
    start = start_stiffness(study, cohort, name)
    usable = own[own["status"].isin(USABLE) & own["stiffness"].notna()]
    specimens = tuple(dict.fromkeys(usable["specimen"]))
    values = []
    for specimen, rows in usable.groupby("specimen", sort=False):
        k = with_stiffness(start, cohort.joint_names, rows)
        for joint, row in zip(cohort.joint_names, k.tolist(), strict=True):
            given = dict(zip(STIFFNESS_COLUMNS, row, strict=True))
            values.append(Values(specimen=str(specimen), joint=joint, **given))
    bushing = EffectEntry(
        effect=BUSHING, scope=Scope(specimens=specimens or ("*",)), values=tuple(values)
    )
    others = () if file is None else (one for one in file.effects if one.effect != BUSHING)
    return ModelFile(model=f"{NAME}_{name}", cohort=cohort.name, effects=(bushing, *others))
