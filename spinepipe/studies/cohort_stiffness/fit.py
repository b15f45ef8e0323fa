"""Job: stiffness of one specimen in one representation, fitted to some of its load cases."""

from dataclasses import replace
from typing import Any

import numpy as np

from spinepipe.calibration import Fit, Problem, fit
from spinepipe.cohort import Cohort
from spinepipe.designs import specimen_seed
from spinepipe.effects.contract import Array
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.model import RefusedModel, ScopedEffect
from spinepipe.statics import with_parameters
from spinepipe.status import Status, joined
from spinepipe.studies.cohort_stiffness.fit_rows import (
    criteria,
    independent,
    no_fit,
    stiffness_rows,
)
from spinepipe.studies.cohort_stiffness.nuisances import (
    fitted_nuisances,
    nuisance_rows,
    start_from_plain,
    without_nuisances,
)
from spinepipe.studies.cohort_stiffness.predict import error_rows
from spinepipe.studies.cohort_stiffness.problem import (
    SpecimenTests,
    base_effects,
    base_of,
    calibration_problem,
    origin,
    specimen_tests,
)
from spinepipe.studies.cohort_stiffness.representations import named
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness
from spinepipe.studies.cohort_stiffness.stages import SHARED_ERROR
from spinepipe.studies.cohort_stiffness.stiffening import (
    Growth,
    fitted_growth,
    laws,
    status_with_growth,
)
from spinepipe.studies.cohort_stiffness.tables import ERRORS, FITS, NUISANCES, STIFFNESS
from spinepipe.studies.problem import BUSHING
from spinepipe.tables import from_rows, write
from spinepipe.units import COORDINATES

Row = dict[str, Any]


def run(
    root: str,
    study: str,
    specimen: str,
    representation: str,
    fitted_to: str,
    stiffness: str,
    fits: str,
    errors: str,
    nuisances: str,
) -> None:
    """Write stiffness, the record of the fit, and the errors under all tests of the specimen.

    And what was fitted beside: errors of joint centres and axes.
    """
    settings, cohort = study_of_kind(CohortStiffness, root, study)
    others = base_effects(base_of(root, settings), cohort, specimen)
    rows = fitted(settings, cohort, specimen, representation, fitted_to, others)
    made = origin("fit", root, settings, cohort, [specimen])
    paths = {STIFFNESS: stiffness, FITS: fits, ERRORS: errors, NUISANCES: nuisances}
    of = {"specimen": specimen, "representation": representation, "fitted_to": fitted_to}
    for table, path in paths.items():
        write(from_rows(table, rows[table.name], **of), path, made)


def fitted(
    settings: CohortStiffness,
    cohort: Cohort,
    specimen: str,
    representation: str,
    fitted_to: str,
    others: tuple[ScopedEffect, ...] = (),
) -> dict[str, list[Row]]:
    """Rows of the tables ``stiffness``, ``fits``, ``errors`` and ``nuisances`` of one fit.

    Parameters
    ----------
    fitted_to : a test, ``all``, or ``all_but_<test>``. others : effects besides the bushings.
    """
    tests = specimen_tests(settings, cohort, specimen)
    where = specimen, representation, fitted_to
    problem, found, refusal = _fit(settings, cohort, *where, tests, others)
    predicted: list[Row] = []
    if problem is None or found is None:
        nowhere = np.full((len(cohort.joint_names), len(COORDINATES)), np.nan)
        none = np.zeros(nowhere.shape, dtype=int)
        values = stiffness_rows(
            cohort.joint_names, settings.free, nowhere, nowhere, 0.0, none.astype(bool), none
        )
        status, told = Status.REFUSED, []
        record = no_fit(status.value, refusal)
    else:
        # A law that stiffens has growth beside its stiffness, and others none.
        stiffens = named(representation).stiffens
        growth = fitted_growth(settings, problem, found) if stiffens else None
        k, values = _stiffness(settings, cohort, problem, found, growth)
        status, record = found.status, _record(problem, found)
        told = nuisance_rows(problem, found, cohort.joint_names)
        if status.usable:
            effects = laws(settings, None if growth is None else growth.values)
            acting = (*effects, *fitted_nuisances(problem, found), *others)
            predicted = error_rows(cohort, specimen, tests, k, acting)
    ended = {"status": status.value, "message": refusal if found is None else found.message}
    by = {"source": "own"}
    rows = [{**ended, **row, **by} for row in values]
    seen = [{**row, **by, "stage": tests.stage(row["test"], fitted_to)} for row in predicted]
    return {STIFFNESS.name: rows, FITS.name: [record], ERRORS.name: seen, NUISANCES.name: told}


def _fit(
    settings: CohortStiffness,
    cohort: Cohort,
    specimen: str,
    representation: str,
    fitted_to: str,
    tests: SpecimenTests,
    others: tuple[ScopedEffect, ...],
) -> tuple[Problem | None, Fit | None, str]:
    """The problem and its fit, or why there is none."""
    chosen = tests.fitted_to(fitted_to)
    if not chosen:
        return None, None, f"{specimen}: {tests.why_none(fitted_to)}"
    try:
        problem = calibration_problem(
            settings, cohort, specimen, representation, tests.frames, chosen, others
        )
        seed = specimen_seed(settings.seed, f"{specimen}/{representation}/{fitted_to}")
        below = settings.identifiable_below
        held = ""
        if named(representation).without_nuisances:
            plain = fit(without_nuisances(problem), settings.starts, seed, below)
            problem, held = start_from_plain(problem, plain)
        found = fit(problem, settings.starts, seed, below, profiled=True)
        found = replace(found, message=joined(found.message, held))
        if named(representation).stiffens:
            status, message = status_with_growth(
                problem, found.at_bound, found.status, found.message
            )
            found = replace(found, status=status, message=message)
        return problem, found, ""
    except RefusedModel as error:
        return None, None, str(error)


def _stiffness(
    settings: CohortStiffness,
    cohort: Cohort,
    problem: Problem,
    found: Fit,
    growth: Growth | None,
) -> tuple[Array, list[Row]]:
    """Stiffness (J, 6) for predictions, NaN where the fit has none, and the rows of what it has."""
    usable = found.status.usable
    model = with_parameters(problem.model, problem.free, found.x)
    k = problem.model.effects[BUSHING].values.copy()  # of what no reading depends on
    error = np.full(k.shape, np.inf)
    known, bound = np.zeros(k.shape, dtype=bool), np.zeros(k.shape, dtype=int)
    silent = np.full(k.shape, usable)
    reaches = {}  # where the fit looked for no region, the interval stands
    for index, unknown in enumerate(problem.free):
        if unknown.effect != BUSHING or found.uncertainty.silent[index]:
            continue  # of a law that stiffens, or a nuisance; or of no reading
        at = (list(unknown.rows), unknown.column)
        k[at], silent[at] = model.effects[BUSHING].values[at], False
        error[at] = found.uncertainty.standard_error[index]
        known[at] = found.identifiable(index)
        bound[at] = found.at_bound[index]
        for row in unknown.rows:
            one = row, unknown.column
            reach = found.reach(index, k[one])
            if reach is not None:
                reaches[one] = reach
    values = k if usable else np.full(k.shape, np.nan)
    freedom = found.uncertainty.degrees_of_freedom
    return values, stiffness_rows(
        *(cohort.joint_names, settings.free, values, error, freedom, known, bound, reaches),
        *(growth if usable else None, silent),
    )


def _record(problem: Problem, found: Fit) -> Row:
    """The row of the table ``fits``; its cost is that of the readings alone.

    Of the unknowns those count that priors do not decide about.
    """
    unknowns = len(problem.free)
    readings = sum(
        int(np.isfinite(case.measured[:, :, problem.weights > 0.0]).sum()) for case in problem.cases
    )
    cost = found.cost - found.cost_of_priors if found.status.usable else None
    effective = None if cost is None else unknowns - found.uncertainty.held_by_priors
    alone = independent(problem)
    notes = [found.message]
    if found.n_optima > 1:
        notes.append(f"{found.n_optima} optima: the answer depends on the start")
    if not alone and cost is not None:
        notes.append(SHARED_ERROR)
    return {
        "readings": readings,
        "unknowns": unknowns,
        "effective_unknowns": effective,
        "cost": cost,
        **criteria(
            *(cost, readings, effective, found.uncertainty.degrees_of_freedom, alone),
            cost_of_priors=found.cost_of_priors,
        ),
        "iterations": found.iterations,
        "evaluations": found.evaluations,
        "n_optima": found.n_optima,
        "status": found.status.value,
        "message": joined(*notes),
        "degrees_of_freedom": None if cost is None else found.uncertainty.degrees_of_freedom,
    }
