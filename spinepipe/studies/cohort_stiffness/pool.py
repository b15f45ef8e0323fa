"""Job: the stiffness of all specimens at once, each drawn towards its cohort; or all but one."""

from collections.abc import Mapping

from spinepipe.calibrate import Problem, pool
from spinepipe.cohort import Cohort
from spinepipe.jobs.cohort_stiffness.base_model import base_effects, origin, seen_note
from spinepipe.jobs.cohort_stiffness.pooled_rows import PooledRows
from spinepipe.jobs.cohort_stiffness.problem import calibration_problem
from spinepipe.jobs.cohort_stiffness.tested import specimen_tests
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.model import RefusedModel, ScopedEffect
from spinepipe.studies import CohortStiffness
from spinepipe.studies.fitted_to import NOBODY, POOLED
from spinepipe.tables import ERRORS, FITS, POOLING, STIFFNESS, from_rows, write


def run(
    root: str,
    study: str,
    fitted_to: str,
    without: str,
    stiffness: str,
    fits: str,
    errors: str,
    pooling: str,
) -> None:
    """Write what the pooled fit says of its specimens, or of the one that was left out."""
    settings, cohort = study_of_kind(CohortStiffness, root, study)
    fitted = [name for name in cohort.specimen_names if name != without]
    others = {
        name: base_effects(root, settings, cohort, name, left_out=name == without)
        for name in cohort.specimen_names
    }
    problems, refusals = _problems(settings, cohort, fitted, fitted_to, others)
    found = pool(list(problems.values())) if problems else None
    everyone = without == NOBODY
    note = "" if everyone else seen_note(root, settings, cohort, without)
    rows = PooledRows(settings, cohort, fitted_to, problems, refusals, found, others, note)
    told = fitted if everyone else [without]
    values = [row for name in told for row in rows.stiffness(name)]
    seen = [row for name in told for row in rows.errors(name)]
    records = [rows.record(name) for name in told] if everyone else []
    source = "own" if everyone else "others_pooled"
    by = {"representation": POOLED, "source": source}
    made = origin("pool", root, settings, cohort)
    shape = STIFFNESS.without("fitted_to")
    write(from_rows(shape, [{**row, **by} for row in values]), stiffness, made)
    write(from_rows(ERRORS.without("fitted_to"), [{**row, **by} for row in seen]), errors, made)
    write(from_rows(FITS.without("fitted_to"), [{**row, **by} for row in records]), fits, made)
    write(from_rows(POOLING.without("fitted_to", "without"), rows.pooling()), pooling, made)


def _problems(
    settings: CohortStiffness,
    cohort: Cohort,
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
                settings, cohort, name, POOLED, tests.frames, chosen, others[name]
            )
        except RefusedModel as error:
            refusals[name] = str(error)
    return found, refusals
