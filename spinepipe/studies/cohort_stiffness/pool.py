"""Job: the stiffness of all specimens at once, each drawn towards its cohort; or all but one."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from spinepipe.calibration import Pooled, PooledSpecimen, Problem, pool
from spinepipe.calibration.hierarchy import MEAN_SD
from spinepipe.cohort import Cohort
from spinepipe.effects.contract import Array, Indices
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.model import RefusedModel, ScopedEffect
from spinepipe.status import NOT_FITTED, Status, joined
from spinepipe.studies.cohort_stiffness.fit_rows import (
    LEVEL,
    NO_ROW,
    criteria,
    independent,
    no_fit,
    stiffness_rows,
)
from spinepipe.studies.cohort_stiffness.predict import error_rows
from spinepipe.studies.cohort_stiffness.problem import (
    base_effects,
    base_of,
    calibration_problem,
    origin,
    own_values_note,
    specimen_tests,
    start_stiffness,
)
from spinepipe.studies.cohort_stiffness.settings import NOBODY, CohortStiffness
from spinepipe.studies.cohort_stiffness.stages import SHARED_ERROR
from spinepipe.studies.cohort_stiffness.stiffening import (
    Growth,
    PooledUnknowns,
    growth_spread,
    laws,
    pooled_growth,
    pooled_status,
)
from spinepipe.studies.cohort_stiffness.tables import ERRORS, FITS, POOLING, SPREAD_CELLS, STIFFNESS
from spinepipe.tables import from_rows, write
from spinepipe.units import COORDINATES, STIFFNESS_COLUMNS, STIFFNESS_UNITS

Row = dict[str, Any]
NOBODY_FITTED = "no specimen has motion to fit"

UNTOLD_SD = 0.999 * MEAN_SD
"""Of a mean of which hardly more is known than its prior: no reading of the cohort tells of it."""

DECIDED = 0.5
"""Share of a newcomer's variance below which a specimen's own readings decide."""

_OF_SPREADS = (
    *("centre", "between_levels", "between_specimens", "between_joints", "scatter"),
    *("effective_unknowns", "log_likelihood", *SPREAD_CELLS),
)
"""Cells of table ``pooling`` that stay empty where nothing was fitted."""

NOT_DECIDED = "the specimen's readings do not decide: value and interval are the cohort's"


def run(
    root: str,
    study: str,
    representation: str,
    fitted_to: str,
    without: str,
    stiffness: str,
    fits: str,
    errors: str,
    pooling: str,
) -> None:
    """Write what the pooled fit says of its specimens, or of the one that was left out."""
    settings, cohort = study_of_kind(CohortStiffness, root, study)
    base = base_of(root, settings)
    others = {
        name: base_effects(base, cohort, name, left_out=name == without)
        for name in cohort.specimen_names
    }
    note = "" if without == NOBODY else own_values_note(base, cohort, without)
    rows = pooled(settings, cohort, representation, fitted_to, without, others, note)
    made = origin("pool", root, settings, cohort)
    paths = {STIFFNESS: stiffness, ERRORS: errors, FITS: fits, POOLING: pooling}
    of = {"representation": representation, "fitted_to": fitted_to}
    for table, path in paths.items():
        told = of | {"without": without} if table is POOLING else of
        write(from_rows(table, rows[table.name], **told), path, made)


def pooled(
    settings: CohortStiffness,
    cohort: Cohort,
    representation: str,
    fitted_to: str,
    without: str,
    others: Mapping[str, tuple[ScopedEffect, ...]],
    note: str = "",
) -> dict[str, list[Row]]:
    """Rows of the tables ``stiffness``, ``errors``, ``fits`` and ``pooling`` of one pooled fit.

    Parameters
    ----------
    without : the specimen that is left out, of which alone the rows then are; or ``nobody``.
    others : effects of each specimen besides the bushings. note : to be told of a newcomer's.
    """
    fitted = [name for name in cohort.specimen_names if name != without]
    problems, refusals = _problems(settings, cohort, representation, fitted, fitted_to, others)
    asked = list(problems.values())
    found = pooled_status(asked, pool(asked)) if asked else None
    everyone = without == NOBODY
    rows = PooledRows(
        *(settings, cohort, representation, fitted_to, problems, refusals, found, others, note)
    )
    names = fitted if everyone else [without]
    by = {"source": "own" if everyone else "others_pooled"}
    return {
        STIFFNESS.name: [{**row, **by} for name in names for row in rows.stiffness(name)],
        ERRORS.name: [{**row, **by} for name in names for row in rows.errors(name)],
        FITS.name: [rows.record(name) for name in names] if everyone else [],
        POOLING.name: rows.pooling(),
    }


def _problems(
    settings: CohortStiffness,
    cohort: Cohort,
    representation: str,
    names: list[str],
    fitted_to: str,
    others: Mapping[str, tuple[ScopedEffect, ...]],
) -> tuple[dict[str, Problem], dict[str, str]]:
    """The problem of each specimen that has motion to fit, and why the others have none."""
    found, refusals = {}, {}
    for name in names:
        tests = specimen_tests(settings, cohort, name)
        chosen = tests.fitted_to(fitted_to)
        if not chosen:
            refusals[name] = f"{name}: {tests.why_none(fitted_to)}"
            continue
        try:
            found[name] = calibration_problem(
                settings, cohort, name, representation, tests.frames, chosen, others[name]
            )
        except RefusedModel as error:
            refusals[name] = str(error)
    return found, refusals


@dataclass(frozen=True)
class PooledRows:
    """What a pooled fit says, specimen by specimen; nothing where it did not end.

    Attributes
    ----------
    problems : of the specimens that were fitted. refusals : why some have no problem. A specimen
        in neither is a newcomer to them.
    found : None where there was nothing to fit.
    others : effects of each specimen besides the bushings. note : to be told of a newcomer's.
    """

    study: CohortStiffness
    cohort: Cohort
    representation: str
    fitted_to: str
    problems: Mapping[str, Problem]
    refusals: Mapping[str, str]
    found: Pooled | None
    others: Mapping[str, tuple[ScopedEffect, ...]]
    note: str

    def stiffness(self, specimen: str) -> list[Row]:
        """Rows of table ``stiffness`` for a fitted specimen or a newcomer."""
        joints, newcomer = self.cohort.joint_names, self._newcomer(specimen)
        values, silent = self._values(specimen), np.tile(self._silent, (len(joints), 1))
        if values is None:
            silent = np.zeros_like(silent)
            none = np.zeros((len(joints), len(COORDINATES)), dtype=int)
            values = np.full(none.shape, np.nan), none + np.nan, none, none
        k, error, bound, decided = values
        known = None if newcomer else (error < self.study.identifiable_below) & (decided > 0)
        rows = stiffness_rows(
            *(joints, self.study.free, k, error, self._freedom(specimen), known, bound),
            growth=self._growth(specimen),
            silent=silent,
        )
        status, message = self._ended(specimen)
        for row in (one for one in rows if "status" not in one):
            at = joints.index(row["joint"]), COORDINATES.index(row["coordinate"])
            of_cohort = not newcomer and np.isfinite(error[at]) and not decided[at]
            note = joined(message, NOT_DECIDED if of_cohort else "")
            row |= {"status": status.value, "message": note}
        return [row | {"specimen": specimen} for row in rows]

    def errors(self, specimen: str) -> list[Row]:
        """Rows of table ``errors``: all tests of a fitted specimen, those fitted of a newcomer."""
        values = self._values(specimen)
        if values is None:
            return []
        tests = specimen_tests(self.study, self.cohort, specimen)
        growth = self._growth(specimen)
        effects = laws(self.study, None if growth is None else growth.values)
        others = (*effects, *self.others.get(specimen, ()))
        rows = []
        for row in error_rows(self.cohort, specimen, tests, values[0], others):
            stage = tests.stage(row["test"], self.fitted_to)
            if specimen in self.problems:
                rows.append({**row, "specimen": specimen, "stage": stage})
            elif stage == "fitted":
                rows.append({**row, "specimen": specimen, "stage": "left_out_specimen"})
        return rows

    def record(self, specimen: str) -> Row:
        """The row of table ``fits`` of a fitted specimen."""
        own = self._own(specimen)
        status, message = self._ended(specimen)
        ended = {"specimen": specimen, "status": status.value, "message": message}
        if own is None or self.found is None:
            return {"specimen": specimen, **no_fit(status.value, message)}
        usable = status.usable
        cost, effective = (own.cost, own.effective_parameters) if usable else (None, None)
        alone = independent(self.problems[specimen])
        if usable and not alone:
            ended["message"] = joined(message, SHARED_ERROR)
        return {
            "readings": own.n_readings,
            "unknowns": len(own.x),
            "effective_unknowns": effective,
            "cost": cost,
            **criteria(cost, own.n_readings, effective, independent=alone),
            "iterations": self.found.iterations,
            "evaluations": own.evaluations,
            "n_optima": int(usable),
            "degrees_of_freedom": None,
            **ended,
        }

    def pooling(self) -> list[Row]:
        """Rows of table ``pooling``, one per free coordinate."""
        spreads = {s.name: s for s in self.found.spreads if not s.effect} if self.found else {}
        start = start_stiffness(self.study, self.cohort, self.representation)[0]
        alone = all(independent(problem) for problem in self.problems.values())
        rows = []
        for name in self.study.free:
            place = COORDINATES.index(name)
            row: Row = {
                "coordinate": name,
                "unit": STIFFNESS_UNITS[name],
                "specimens": self._specimens(),
                "iterations": 0,
                "status": Status.REFUSED.value,
                "message": NOBODY_FITTED,
                **dict.fromkeys(_OF_SPREADS),
            }
            spread = spreads.get(STIFFNESS_COLUMNS[place])
            if self._silent[place]:
                row |= {"status": NOT_FITTED, "message": NO_ROW["message"]}
            elif self.found is not None and spread is not None:
                row |= {
                    "centre": float(start[place]) * float(np.exp(spread.mean)),
                    "between_levels": spread.level or None,  # zero: not told from the rest
                    "between_specimens": spread.specimen or None,
                    "between_joints": spread.rest,
                    **growth_spread(self.study, self.found, name),
                    "scatter": self.found.scatter,
                    "effective_unknowns": self.found.effective_parameters,
                    "log_likelihood": self.found.log_likelihood if alone else None,
                    "iterations": self.found.iterations,
                    "status": self.found.status.value,
                    "message": joined(self.found.message, "" if alone else SHARED_ERROR),
                }
            rows.append(row)
        return rows

    @cached_property
    def _silent(self) -> NDArray[np.bool_]:
        """(6,) coordinates that no reading of any specimen depends on."""
        silent = np.zeros(len(COORDINATES), dtype=bool)
        if self.found is not None and self.found.status.usable:
            for spread in self.found.spreads:
                if not spread.effect:
                    silent[spread.column] = spread.mean_se > UNTOLD_SD
        return silent

    def _own(self, specimen: str) -> PooledSpecimen | None:
        if self.found is None or specimen not in self.problems:
            return None
        return self.found.specimens[list(self.problems).index(specimen)]

    def _ended(self, specimen: str) -> tuple[Status, str]:
        """Its own status, or the pool's: each stiffness hangs on the spreads of all."""
        own = self._own(specimen)
        if specimen in self.refusals:
            return Status.REFUSED, self.refusals[specimen]
        if self.found is None:
            return Status.REFUSED, NOBODY_FITTED
        pool = self.found.status, self.found.message
        if own is None:
            return pool[0], joined("what the others lead one to expect", pool[1], self.note)
        if own.status.usable and not pool[0].usable:
            return pool[0], joined(own.message, f"pooled fit: {pool[1] or pool[0].value}")
        return own.status, own.message

    def _values(self, specimen: str) -> tuple[Array, Array, Indices, Indices] | None:
        """Stiffness, error of its logarithm, bounds reached and what readings decide, (J, 6).

        None without a fit.
        """
        unknowns = self._unknowns(specimen)
        if unknowns is None:
            return None
        k = start_stiffness(self.study, self.cohort, self.representation)
        error = np.full(k.shape, np.inf)
        bound = np.zeros(k.shape, dtype=int)
        decided = np.zeros(k.shape, dtype=int)
        for index, unknown in enumerate(unknowns.free):
            if unknown.effect or self._silent[unknown.column]:
                continue  # of a law that stiffens; or of no reading
            at = unknown.rows[0], unknown.column
            k[at] *= np.exp(unknowns.x[index])
            bound[at] = unknowns.at_bound[index]
            decided[at] = unknowns.decided is not None and unknowns.decided[index]
            if not bound[at]:  # the covariance is not told of bounds
                error[at] = np.sqrt(unknowns.variance[index])
        return k, error, bound, decided

    def _unknowns(self, specimen: str) -> PooledUnknowns | None:
        """What the pool says of the unknowns of a fitted specimen or a newcomer.

        A newcomer has them where the pool has ended: it can be expected to be like the others.
        """
        if self.found is None or not self._ended(specimen)[0].usable:
            return None
        own, newcomer = self._own(specimen), np.diagonal(self.found.newcomer_covariance)
        free = next(iter(self.problems.values())).free
        if (
            own is None
        ):  # the prior predictive of the cohort: its mean, and what specimens differ by
            nothing = np.zeros(len(free), dtype=int)
            return PooledUnknowns(free, self.found.newcomer, newcomer, nothing, None)
        # Own readings decide where they make the specimen much surer than the cohort alone would.
        variance = np.diagonal(own.covariance)
        decided = variance < DECIDED * newcomer
        return PooledUnknowns(free, own.x, variance, own.at_bound, decided)

    def _growth(self, specimen: str) -> Growth | None:
        """What is known of growth; None for a linear fit or without one."""
        unknowns, freedom = self._unknowns(specimen), self._freedom(specimen)
        if unknowns is None:
            return None
        reach = float(stats.t.ppf(LEVEL, freedom)) if freedom > 0.0 else np.inf
        return pooled_growth(self.study, unknowns, len(self.cohort.joint_names), reach)

    def _freedom(self, specimen: str) -> float:
        """Degrees of freedom of intervals: a newcomer's hang on spreads that are estimated."""
        return self._specimens() - 1.0 if self._newcomer(specimen) else np.inf

    def _newcomer(self, specimen: str) -> bool:
        """Whether it took no part in the pool, be it fitted or refused."""
        return specimen not in self.problems and specimen not in self.refusals

    def _specimens(self) -> int:
        """How many specimens the spreads were estimated from."""
        return sum(bool(one.poses) for one in self.found.specimens) if self.found else 0
