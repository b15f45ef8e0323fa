"""Job: fits in a cohort's own joint poses, from sampled starts or with sampled damping.

Fits of one way of loading are solved side by side: of one alone, calls of numpy take the time.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from spinepipe.calibration import Evaluator, Fit, Problem, fit_alike, side_by_side
from spinepipe.cohort import Cohort
from spinepipe.designs import sample_log_uniform, specimen_seed
from spinepipe.effects.contract import Array
from spinepipe.jobs.digest import provenance
from spinepipe.model import RefusedModel
from spinepipe.statics import Course
from spinepipe.status import Status
from spinepipe.studies.joint_pose_sensitivity.inputs import start_stiffness, study_and_cohort
from spinepipe.studies.joint_pose_sensitivity.problem import (
    ERROR_COLUMNS,
    absolute_errors,
    calibration_problem,
    fitted_stiffness,
    mean_errors,
)
from spinepipe.studies.joint_pose_sensitivity.settings import (
    SETS_PER_BATCH,
    JointPoseSensitivity,
)
from spinepipe.studies.joint_pose_sensitivity.tables import BOOTSTRAP
from spinepipe.tables import from_rows, write
from spinepipe.units import STIFFNESS_COLUMNS

NO_REST = "with this stiffness the spine was still moving away when it was read: no rest"


def run(
    root: str, study: str, specimen: str, bootstrap: str, loading: str, batch: str, output: str
) -> None:
    """Write the rows, one per joint, of the fits of one batch of sets."""
    settings, cohort = study_and_cohort(root, study)
    first = int(batch) * SETS_PER_BATCH
    sets = sample_sets(settings, specimen, bootstrap)[first : first + SETS_PER_BATCH]
    found = _fits(root, settings, cohort, specimen, loading, sets)
    key = {"specimen": specimen, "bootstrap": bootstrap, "loading": loading}
    rows = [
        {
            **key,
            "set": number,
            **{f"start_{n}": float(v) for n, v in zip(STIFFNESS_COLUMNS, start, strict=True)},
            "damping_translation_n_s_per_m": float(damping[0]),
            "damping_rotation_nm_s_per_rad": float(damping[5]),
            **row,
        }
        for number, ((start, damping), own) in enumerate(zip(sets, found, strict=True), first)
        for row in own
    ]
    write(from_rows(BOOTSTRAP, rows), output, provenance("bootstrap", settings, cohort, [specimen]))


def sample_sets(
    settings: JointPoseSensitivity, specimen: str, bootstrap: str
) -> tuple[tuple[Array, Array], ...]:
    """Start stiffness (6,) and damping (6,) of every set, SI; what is not drawn is the study's."""
    start, damping = start_stiffness(settings), np.array(settings.damping.in_order())
    seed = specimen_seed(settings.seed, f"{bootstrap}/{specimen}")
    if bootstrap == "start":
        part = settings.start_bootstrap
        ends = part.lowest.in_order(), part.highest.in_order()
        return tuple((row, damping) for row in _sample(*ends, part.sets, seed))
    reach, sets = settings.damping_bootstrap.factor, settings.damping_bootstrap.sets
    two = damping[[0, 5]]  # translations share a coefficient, and so do rotations
    low, high = (tuple(end.tolist()) for end in (two / reach, two * reach))
    return tuple((start, np.repeat(row, 3)) for row in _sample(low, high, sets, seed))


@lru_cache(maxsize=16)
def _sample(low: tuple[float, ...], high: tuple[float, ...], sets: int, seed: int) -> Array:
    """(sets, D) log-uniform between two ends; a Latin hypercube has two points at least."""
    return sample_log_uniform(np.array(low), np.array(high), max(sets, 2), seed)[:sets]


def course(settings: JointPoseSensitivity, loading: str) -> Course | None:
    """How the loads of a bootstrap come on; None for poses at rest."""
    if loading == "equilibrium":
        return None
    if loading == "quasi_static":
        return Course(settings.settle_time_s)
    ramp = settings.dynamic
    return Course(ramp.ramp_s, ramp.ramp_s, ramp.steps_per_s)


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
        problems = []
        for start, damping in sets:
            problem = calibration_problem(root, settings, specimen, stiffness=start)
            of_joints = np.broadcast_to(damping, problem.model.damping.shape).copy()
            model = replace(problem.model, damping=of_joints)
            problems.append(replace(problem, model=model, course=course(settings, loading)))
        found = fit_alike(problems)
    except RefusedModel as error:
        nothing = dict.fromkeys((*STIFFNESS_COLUMNS, *ERROR_COLUMNS, "cost"))
        ended = {"evaluations": 0, "status": Status.REFUSED.value, "message": str(error)}
        return [[{"joint": name, **nothing, **ended} for name in cohort.joint_names]] * len(sets)
    at_rest = _rests(problems, found)
    return [_rows(cohort, *one) for one in zip(problems, found, at_rest, strict=True)]


def _rests(problems: Sequence[Problem], found: Sequence[Fit]) -> list[bool]:
    """Of each fit, whether there is an equilibrium where a moving spine was read, if one was."""
    rests = [True] * len(found)
    moving = [n for n, p in enumerate(problems) if p.course is not None and found[n].status.usable]
    evaluators: list[Evaluator] = []
    # all behind the first share its chain, so that they are solved in one stack
    for number in moving:
        still = replace(problems[number], course=None)
        evaluators.append(Evaluator(still, evaluators[0] if evaluators else None))
    points = [(n, one, found[n].x) for n, one in zip(moving, evaluators, strict=True)]
    for number, there in zip(moving, side_by_side(points), strict=True):
        rests[number] = there.residual is not None
    return rests


def _rows(cohort: Cohort, problem: Problem, found: Fit, rests: bool) -> list[dict[str, Any]]:
    """One row per joint: its stiffness and its own mean errors."""
    solved = found.status.usable
    values = fitted_stiffness(problem, found.x)
    errors = absolute_errors(found.cases, found.poses)
    ended = {
        "cost": found.cost if solved else None,
        "evaluations": found.evaluations,
        "status": found.status.value,
        "message": "; ".join(filter(None, (found.message, "" if rests else NO_REST))),
    }
    return [
        {
            "joint": name,
            **dict.fromkeys(STIFFNESS_COLUMNS),
            **(dict(zip(STIFFNESS_COLUMNS, values[joint].tolist(), strict=True)) if solved else {}),
            **mean_errors(errors[:, joint]),
            **ended,
        }
        for joint, name in enumerate(cohort.joint_names)
    ]
