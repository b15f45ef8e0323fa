"""Job: fits in a cohort's own joint poses, from sampled starts or with sampled damping.

Fits of one way of loading are solved side by side: of one alone, calls of numpy take the time.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from spinepipe.calibrate import Evaluator, Fit, Problem, fit_alike, side_by_side
from spinepipe.cohort import Cohort
from spinepipe.designs import sample_log_uniform, specimen_seed
from spinepipe.effects.contract import Array
from spinepipe.jobs.digest import provenance
from spinepipe.model import RefusedModel
from spinepipe.statics import Course, with_parameters
from spinepipe.status import Status
from spinepipe.studies.joint_pose_sensitivity.inputs import (
    specimen_inputs,
    start_stiffness,
    study_and_cohort,
)
from spinepipe.studies.joint_pose_sensitivity.problem import absolute_errors, calibration_problem
from spinepipe.studies.joint_pose_sensitivity.settings import (
    SETS_PER_BATCH,
    JointPoseSensitivity,
)
from spinepipe.studies.joint_pose_sensitivity.tables import BOOTSTRAP
from spinepipe.tables import from_rows, write
from spinepipe.units import COORDINATE_COLUMNS, STIFFNESS_COLUMNS

NO_REST = "with this stiffness the spine was still moving away when it was read: no rest"
_START = [f"start_{name}" for name in STIFFNESS_COLUMNS]
_ERRORS = [
    f"{name}_error_{unit}"
    for name, unit in (column.rsplit("_", 1) for column in COORDINATE_COLUMNS)
]


def run(
    root: str, study: str, specimen: str, bootstrap: str, loading: str, batch: str, output: str
) -> None:
    """Write the rows, one per joint, of the fits of one batch of sets."""
    settings, cohort = study_and_cohort(root, study)
    first = int(batch) * SETS_PER_BATCH
    sets = sampled(settings, specimen, bootstrap)[first : first + SETS_PER_BATCH]
    found = _fits(root, settings, cohort, specimen, loading, sets)
    rows = []
    for number, ((start, damping), own) in enumerate(zip(sets, found, strict=True), start=first):
        common = {
            "specimen": specimen,
            "bootstrap": bootstrap,
            "loading": loading,
            "set": number,
            **dict(zip(_START, start.tolist(), strict=True)),
            "damping_translation_n_s_per_m": float(damping[0]),
            "damping_rotation_nm_s_per_rad": float(damping[5]),
        }
        rows += [{**common, **row} for row in own]
    write(from_rows(BOOTSTRAP, rows), output, provenance("bootstrap", settings, cohort, [specimen]))


def _fits(
    root: str,
    settings: JointPoseSensitivity,
    cohort: Cohort,
    specimen: str,
    loading: str,
    sets: Sequence[tuple[Array, Array]],
) -> list[list[dict[str, Any]]]:
    """The rows, one per joint, of the fit of each set; refused where one is: they are alike."""
    try:
        problems = [_problem(root, settings, cohort, specimen, *one) for one in sets]
        problems = [replace(problem, course=course(settings, loading)) for problem in problems]
        found = fit_alike(problems)
    except RefusedModel as error:
        return [_refused(cohort, str(error))] * len(sets)
    at_rest = _rests(problems, found)
    return [_fitted(cohort, *one) for one in zip(problems, found, at_rest, strict=True)]


def sampled(
    settings: JointPoseSensitivity, specimen: str, bootstrap: str
) -> tuple[tuple[Array, Array], ...]:
    """Start stiffness (6,) and damping (6,) of every set, SI; what is not drawn is the study's."""
    start, damping = start_stiffness(settings), np.array(settings.damping.in_order())
    seed = specimen_seed(settings.seed, f"{bootstrap}/{specimen}")
    if bootstrap == "start":
        part = settings.start_bootstrap
        low, high = np.array(part.lowest.in_order()), np.array(part.highest.in_order())
        return tuple((row, damping) for row in _sample(low, high, part.sets, seed))
    reach, sets = settings.damping_bootstrap.factor, settings.damping_bootstrap.sets
    two = damping[[0, 5]]  # translations share a coefficient, and so do rotations
    drawn = _sample(two / reach, two * reach, sets, seed)
    return tuple((start, np.repeat(row, 3)) for row in drawn)


def _sample(low: Array, high: Array, sets: int, seed: int) -> Array:
    return _cached_sample(tuple(low.tolist()), tuple(high.tolist()), sets, seed)


@lru_cache(maxsize=16)
def _cached_sample(low: tuple[float, ...], high: tuple[float, ...], sets: int, seed: int) -> Array:
    return sample_log_uniform(np.array(low), np.array(high), max(sets, 2), seed)[:sets]


def course(settings: JointPoseSensitivity, loading: str) -> Course | None:
    """How the loads of a bootstrap come on; None for poses at rest."""
    if loading == "equilibrium":
        return None
    if loading == "quasi_static":
        return Course(settings.settle_time_s)
    ramp = settings.dynamic
    return Course(ramp.ramp_s, ramp.ramp_s, ramp.steps_per_s)


def _problem(
    root: str,
    settings: JointPoseSensitivity,
    cohort: Cohort,
    specimen: str,
    start: Array,
    damping: Array,
) -> Problem:
    frames = specimen_inputs(root, settings.study, specimen, cohort.digest).frames
    problem = calibration_problem(root, settings, specimen, frames, start)
    shape = problem.model.damping.shape
    model = replace(problem.model, damping=np.broadcast_to(damping, shape).copy())
    return replace(problem, model=model)


def _fitted(cohort: Cohort, problem: Problem, found: Fit, rests: bool) -> list[dict[str, Any]]:
    """One row per joint: its stiffness and its own mean errors."""
    solved = found.status.usable
    message = "; ".join(filter(None, (found.message, "" if rests else NO_REST)))
    values = with_parameters(problem.model, problem.free, found.x).effects[0].values
    rows = []
    for joint, errors in enumerate(np.moveaxis(absolute_errors(found.cases, found.poses), 1, 0)):
        known = np.isfinite(errors).any(axis=0)
        rows.append(
            {
                "joint": cohort.joint_names[joint],
                **{
                    name: float(value) if solved else None
                    for name, value in zip(STIFFNESS_COLUMNS, values[joint], strict=True)
                },
                **{
                    name: float(np.nanmean(errors[:, column])) if known[column] else None
                    for column, name in enumerate(_ERRORS)
                },
                "cost": found.cost if solved else None,
                "evaluations": found.evaluations,
                "status": found.status.value,
                "message": message,
            }
        )
    return rows


def _rests(problems: Sequence[Problem], found: Sequence[Fit]) -> list[bool]:
    """Of each fit, whether there is an equilibrium where a moving spine was read, if one was."""
    rests = [True] * len(found)
    moving = [n for n, p in enumerate(problems) if p.course is not None and found[n].status.usable]
    evaluators: list[Evaluator] = []
    for number in moving:
        still = replace(problems[number], course=None)
        evaluators.append(Evaluator(still, evaluators[0] if evaluators else None))
    points = [(n, one, found[n].x) for n, one in zip(moving, evaluators, strict=True)]
    for number, there in zip(moving, side_by_side(points), strict=True):
        rests[number] = there.residual is not None
    return rests


def _refused(cohort: Cohort, message: str) -> list[dict[str, Any]]:
    """One row per joint without numbers."""
    nothing = dict.fromkeys((*STIFFNESS_COLUMNS, *_ERRORS, "cost"))
    ended = {"evaluations": 0, "status": Status.REFUSED.value, "message": message}
    return [{"joint": joint, **nothing, **ended} for joint in cohort.joint_names]
