"""Job: what the data make likely of stiffness and landmarks of one specimen, and of its poses.

Three tables: the posterior of each unknown, by Hamiltonian Monte Carlo and by Laplace's
approximation; the motion that it predicts; and the weights that the data give to the sampled poses,
each with its most likely stiffness.

Two kinds of number. z: the unknowns that are searched and sampled, standard normal before the data
are seen (`spinepipe.calibration.posterior`); first the p stiffnesses, then three axes of each of
the F free landmarks, m = p + 3 F. x: what z stands for in the mechanical problem, moves of the
logarithms of stiffness, then offset (m) and tilt (rad) of each joint. A *pose* here is one sampled
set of joint frames of a specimen, no posture. C chains of D draws.
"""

from collections.abc import Sequence
from itertools import product
from typing import Any

import numpy as np
from scipy.special import ndtri

from spinepipe.calibration import fit
from spinepipe.calibration.posterior import Mode, Target, between, modes, normal_of
from spinepipe.calibration.sampler import MarkovChains, convergence, sample
from spinepipe.calibration.solvers import AtRest, CaseResiduals
from spinepipe.cohort import Cohort
from spinepipe.cohort.landmark_frames import displacement
from spinepipe.designs import specimen_seed
from spinepipe.effects.contract import Array
from spinepipe.jobs.digest import mark_of, provenance
from spinepipe.model import RefusedModel
from spinepipe.statics import FreeParameter
from spinepipe.status import Status
from spinepipe.studies.joint_pose_sensitivity.inputs import sampled_poses, study_and_cohort
from spinepipe.studies.joint_pose_sensitivity.landmarks import landmarks_of
from spinepipe.studies.joint_pose_sensitivity.posterior_rows import (
    PREDICTIONS,
    PosteriorQuantity,
    motion_rows,
    posterior_row,
    prior_row,
    refused_row,
)
from spinepipe.studies.joint_pose_sensitivity.posterior_target import (
    SpecimenPosterior,
    StiffnessInPoses,
    posterior_of,
    problem_of,
    scatter_of,
    stiffness_values,
)
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.studies.joint_pose_sensitivity.tables import (
    POSE_WEIGHTS,
    POSTERIOR,
    POSTERIOR_MOTION,
)
from spinepipe.tables import from_rows, write
from spinepipe.units import MM_PER_M, STIFFNESS_COLUMNS

PREDICTED = 400
"""Draws from which motion is predicted, evenly spaced among all: a 95 % band has 10 beyond each
end."""

TOGETHER = 50
"""Points that are solved at once; the rest waits, which bounds the memory."""


def run(
    root: str,
    study: str,
    poses: str,
    specimen: str,
    posterior: str,
    posterior_motion: str,
    pose_weights: str,
) -> None:
    """Write the three tables of one specimen.

    Parameters
    ----------
    poses : path of the sampled joint frames.
    posterior, posterior_motion, pose_weights : paths of the tables to be written.
    """
    settings, cohort = study_and_cohort(root, study)
    made_by = provenance("posterior", settings, cohort, [specimen], [mark_of(poses)])
    found = _rows(root, settings, cohort, specimen, poses)
    shapes = (POSTERIOR, POSTERIOR_MOTION, POSE_WEIGHTS)
    outputs = (posterior, posterior_motion, pose_weights)
    for shape, rows, output in zip(shapes, found, outputs, strict=True):
        nothing: dict[str, Any] = {column.name: None for column in shape.columns}
        keyed = [{**nothing, "specimen": specimen, **row} for row in rows]
        write(from_rows(shape, keyed), output, made_by)


Rows = list[dict[str, Any]]


def _rows(
    root: str, settings: JointPoseSensitivity, cohort: Cohort, specimen: str, poses: str
) -> tuple[Rows, Rows, Rows]:
    """Rows of the three tables.

    Where there is no posterior its table has one row that says why, and the motion none. Poses are
    weighed all the same if the cohort's own pose makes a model with a fit.
    """
    try:
        alone = problem_of(root, settings, specimen)
        found = fit(alone, settings.calibration.starts, specimen_seed(settings.seed, specimen))
        if not found.status.usable:
            return [refused_row(f"no fit in the cohort's own pose: {found.message}")], [], []
        marks = landmarks_of(cohort, specimen, settings.landmark_sd_mm)
        own = posterior_of(settings, cohort, alone, marks, scatter_of(settings, found))
        target = own.target()
    except (RefusedModel, ValueError) as error:
        return [refused_row(str(error))], [], []
    fitted = normal_of(*own.bounds, found.x)  # z of the stiffnesses of the fit
    weights = _weights(own, specimen, poses, fitted)
    # the search for the mode begins at the fit, with landmarks where they were felt
    start = np.concatenate([fitted, np.zeros(3 * len(own.unknowns.free))])
    mode = modes(target, start[None])[0]
    if mode.point is None:
        return [refused_row(mode.message)], [], weights
    asked = settings.posterior
    seed = specimen_seed(settings.seed, f"posterior/{specimen}")
    chains = sample(target, mode, asked.chains, asked.warm_up, asked.draws, seed)
    return *_sampled(own, mode, chains, seed), weights


def _sampled(
    own: SpecimenPosterior, mode: Mode, chains: MarkovChains, seed: int
) -> tuple[Rows, Rows]:
    """Rows of the posterior and of the motion it predicts.

    Where the chains have not converged, for one quantity or more, the rows stay, without what is
    made of draws.
    """
    quantities = list(_quantities(own, mode, chains.z))
    found = convergence([quantity.draws for quantity in quantities])
    ended = Status.NOT_CONVERGED if found.message else Status.CONVERGED
    told = {"status": ended.value, "message": found.message}
    believed = ended.usable
    columns = (found.r_hat.tolist(), found.ess_bulk.tolist(), found.ess_tail.tolist())
    rows = [
        {**posterior_row(quantity, *numbers, believed=believed), **told}
        for quantity, *numbers in zip(quantities, *columns, strict=True)
    ]
    # landmarks that move no joint or are certain: the posterior is the prior
    marks, free = own.landmarks, own.unknowns.free
    for place in np.setdiff1d(np.arange(len(marks.names)), free).tolist():
        for axis in "xyz":
            rows.append(prior_row(marks.names[place], axis, float(marks.sd[place] * MM_PER_M)))
    nothing = {} if believed else dict.fromkeys(PREDICTIONS)
    return rows, [{**row, **nothing, **told} for row in _motion(own, chains.z, seed)]


def _quantities(own: SpecimenPosterior, mode: Mode, z: Array) -> Sequence[PosteriorQuantity]:
    """What is told: stiffnesses, landmarks, and where these put the joints.

    ``z`` (C, D, m) : the draws.
    """
    assert mode.point is not None
    stiffnesses, unknowns, marks = own.alone.free, own.unknowns, own.landmarks
    sd = np.sqrt(np.diagonal(mode.covariance))
    near = list(zip(mode.point.z.tolist(), sd.tolist(), strict=True))  # Laplace: mean, SD of each z
    # N/m or N m/rad at which the logarithm has moved by 0
    start = stiffness_values(own.alone, np.zeros(len(stiffnesses))).tolist()
    found = []
    for place, (stiffness, low, high) in enumerate(zip(stiffnesses, *own.bounds, strict=True)):
        where, here = _where(own, stiffness), z[..., place]
        found.append(
            PosteriorQuantity.stiffness(where, here, near[place], (low, high), start[place])
        )
    for place, (mark, axis) in enumerate(product(unknowns.free, "xyz"), start=len(stiffnesses)):
        names, scale = marks.names[mark], float(marks.sd[mark] * MM_PER_M)
        found.append(PosteriorQuantity.landmark(names, axis, z[..., place], near[place], scale))
    return [*found, *_joints(own, mode, z)]


def _joints(own: SpecimenPosterior, mode: Mode, z: Array) -> Sequence[PosteriorQuantity]:
    """Offset and tilt of each joint that landmarks may move.

    They are functions of the landmarks. Draws are exact; Laplace's SD is by the slopes at the mode
    (delta method), the prior's SD by the slopes where the landmarks were palpated.
    """
    assert mode.point is not None
    count, names = len(own.alone.free), own.alone.model.joints
    draws = own.unknowns.placed(z.reshape(-1, z.shape[-1])).by
    top = own.unknowns.placed(mode.point.z[None])
    at_home = own.unknowns.placed(np.zeros((1, z.shape[-1])))
    scale = own.landmarks.sd[own.unknowns.free, None]
    # (J, 6, 3 F) m or rad by z of the landmarks: slope by position times SD of the landmark
    slope = (top.by_points[0] * scale).reshape(*top.by[0].shape, -1)
    before = (at_home.by_points[0] * scale).reshape(slope.shape)
    covariance = mode.covariance[count:, count:]
    found = []
    for joint, axis in product(range(len(names)), range(6)):
        if not before[joint, axis].any():
            continue  # no free landmark moves it
        here = slope[joint, axis]
        near = float(top.by[0, joint, axis]), float(np.sqrt(here @ covariance @ here))
        # independent z of SD 1: variances add up
        prior = float(np.linalg.norm(before[joint, axis]))
        own_draws = draws[:, joint, axis].reshape(z.shape[:2])
        found.append(PosteriorQuantity.joint(names[joint], axis, own_draws, near, prior))
    return found


def _where(own: SpecimenPosterior, stiffness: FreeParameter) -> tuple[str, str]:
    """Joint (``*``: one stiffness of all) and the column of the table, which has the unit."""
    shared = len(stiffness.rows) > 1 or own.settings.calibration.grouping == "per_specimen"
    joint = "*" if shared else own.alone.model.joints[stiffness.rows[0]]
    return joint, STIFFNESS_COLUMNS[stiffness.column]


def _motion(own: SpecimenPosterior, z: Array, seed: int) -> Rows:
    """Bands of motion at every load step that was tested.

    Draws at which loads have no stable equilibrium are left out.
    """
    flat = z.reshape(-1, z.shape[-1])
    chosen = flat[np.linspace(0, len(flat) - 1, min(PREDICTED, len(flat))).astype(int)]
    x, _, _ = own.unknowns.at([0] * len(chosen), chosen)
    problem = own.problem
    cases = [case.case for case in problem.cases]
    solver = AtRest(problem.model, cases, problem.free, problem.scale)
    seen: list[CaseResiduals] = []
    for first in range(0, len(x), TOGETHER):
        found = solver.solve(list(enumerate(x[first : first + TOGETHER])))
        seen += [one for one in found if isinstance(one, CaseResiduals)]
    return motion_rows(problem, seen, own.noise, seed) if seen else []


def _weights(own: SpecimenPosterior, specimen: str, poses: str, start: Array) -> Rows:
    """Each sampled pose with its most likely stiffness, and the weight that the data give it.

    Importance weights: poses are drawn from the landmarks' prior, so a pose's share of the
    posterior is in proportion to how likely it makes the data, stiffness integrated out. That is
    the evidence, here by Laplace's approximation. The weights of all poses sum to 1, or are all 0.

    ``start`` (p,) : z of the stiffnesses at which each search begins.
    """
    sampled, count = sampled_poses(poses), own.settings.poses
    frames = {number: sampled.of(specimen, number)[0] for number in range(count)}
    stated = own.alone.model.frames
    placed = {n: displacement(stated, one) for n, one in frames.items() if one is not None}
    found: dict[int, Mode] = {}
    numbers = list(placed)
    for first in range(0, len(numbers), TOGETHER):
        some = numbers[first : first + TOGETHER]
        # over stiffnesses alone, in the frames of each pose
        unknowns = StiffnessInPoses(*own.bounds, np.array([placed[number] for number in some]))
        target = Target(own.evaluator, unknowns, own.noise)
        # searches are numbered from 0 in every stack: none may go on from another pose's solution
        target.evaluator.forget()
        found |= dict(zip(some, modes(target, np.tile(start, (len(some), 1))), strict=True))
    # weights in proportion to the evidence; less its largest, or exp would under- or overflow
    evidence = np.array([found[n].log_evidence if n in found else -np.inf for n in range(count)])
    weights = np.exp(evidence - evidence.max()) if np.isfinite(evidence).any() else 0.0 * evidence
    total = float(weights.sum()) or 1.0
    rows: Rows = []
    for number in range(count):
        mode = found.get(number)
        refused = sampled.of(specimen, number)[1] if mode is None else mode.message
        rows += _pose_rows(own, number, mode, float(weights[number]) / total, refused)
    return rows


def _pose_rows(
    own: SpecimenPosterior, number: int, mode: Mode | None, weight: float, refused: str
) -> Rows:
    """A row per free stiffness of a pose, without values where the pose has no mode.

    ``refused`` : why it has none.
    """
    places = [dict(zip(("joint", "unknown"), _where(own, k), strict=True)) for k in own.alone.free]
    if mode is None or mode.point is None:
        why = Status.REFUSED if mode is None else Status.NOT_CONVERGED
        told = {"weight": 0.0, "status": why.value, "message": refused}
        return [{"pose": number, **place, **told} for place in places]
    top, sd = mode.point.z, np.sqrt(np.diagonal(mode.covariance))
    # mode and 95 % interval by the normal in z, carried over to stiffness, which grows with z
    value, low, high = (
        stiffness_values(own.alone, between(*own.bounds, top + side * sd)[0])
        for side in (0.0, *ndtri([0.025, 0.975]))
    )
    told = {"log_evidence": mode.log_evidence, "weight": weight}
    told |= {"status": Status.CONVERGED.value, "message": ""}
    return [
        {"pose": number, **place, "value": float(v), "low": float(a), "high": float(b), **told}
        for place, v, a, b in zip(places, value, low, high, strict=True)
    ]
