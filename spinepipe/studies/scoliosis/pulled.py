"""A spine that is pulled along itself at the top: how hard, and so how stiff it is in all.

Under traction nothing holds the uppermost vertebra aside: its height alone is prescribed, and the
holder's push is the pull. A spine twice as stiff stands the same under twice the pull, so films
under pulls that are known tell the size of stiffness which other films leave open.

A film is seen from its lowest vertebra, which may be tilted: the pull is along the line from the
lowest to the uppermost vertebra of the erect film, which a patient carries upright. It acts above
the joints, half an endplate behind the line of the centres: the model has no kyphosis which a pull
at the centres would straighten, and would bend to the back instead. The top does not tip (decision
0019).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from spinepipe.effects.contract import Array
from spinepipe.model import SpineModel
from spinepipe.statics.prescribed_chain import PrescribedChain, PrescribedPlace, Tilt
from spinepipe.status import PrescribedStatus
from spinepipe.studies.scoliosis.film_fit import FilmFit
from spinepipe.studies.scoliosis.films import Film, FilmSd
from spinepipe.studies.scoliosis.fixed_end_spine import ANTERIOR, UP, FixedEndSpine, SpinePose
from spinepipe.studies.scoliosis.personal import Patient
from spinepipe.studies.scoliosis.population import PatientPrior
from spinepipe.units import DEG_PER_RAD, MM_PER_M

MOST_STEPS, SETTLED = 60, 0.02
"""Gauss-Newton's, and the share of the height's SD that the last one may change."""

DRAWS, LEVEL = 40, 0.95
"""Laws drawn from what is known of a patient, and the level of intervals."""


@dataclass(frozen=True)
class Pull:
    """The pull with which a model is nearest a film.

    Attributes
    ----------
    newton : N, at the model's own size of stiffness. sd : N, what reading the film makes of it.
    """

    newton: float
    sd: float


def pulled_spine(patient: Patient, model: SpineModel, depth_mm: float) -> FixedEndSpine:
    """The spine of a model whose top is held at a height alone, and kept from tipping."""
    erect, top = patient.erect, model.n_joints - 1
    point = np.array([-0.5 * depth_mm / MM_PER_M, erect.up[-1], erect.right[-1]])
    along = np.append(0.0, erect.top[1::-1]) / np.hypot(*erect.top[:2])
    grips = (PrescribedPlace(top, point, along), Tilt(top, ANTERIOR, ANTERIOR, UP))
    free = np.tile([False] * 3 + [True] * 3, model.n_joints)
    return FixedEndSpine(PrescribedChain(model, grips, free), erect)


def pull_of(spine: FixedEndSpine, film: Film, sd: FilmSd) -> Pull | None:
    """Least squares of all places and tilts but the lowest's, over height and the film's frame.

    None where the way to the film has no stable pose.
    """
    along = spine.chain.prescriptions[0].vectors[1]
    height, near = float(along @ [0.0, film.up[-1], film.right[-1]]), None
    for _ in range(MOST_STEPS):
        posed = spine.at(np.array([height]), near)
        if posed.result.status is not PrescribedStatus.CONVERGED:
            return None
        near = posed.result
        by_height, push_by_height = _by_height(posed)
        right, up, _ = film.rows[:, 1:]
        moves = np.zeros((3, len(up), 4))
        moves[..., 0] = posed.film_by @ by_height
        moves[0, :, 1], moves[1, :, 2] = -1.0, -1.0
        moves[:, :, 3] = -np.stack([up, -right, np.ones_like(up)])
        off = (posed.film.rows - film.rows)[:, 1:] / sd.vertebra[:, None]
        slopes = (moves / sd.vertebra[:, None, None]).reshape(-1, 4)
        # errors of the frame are drawn about nothing; a model misses the lowest vertebra's, too
        frame = np.diag([0.0, *1.0 / sd.vertebra])
        slopes, off = np.vstack([slopes, frame]), np.append(off.ravel(), np.zeros(4))
        precision = slopes.T @ slopes
        step = float(np.linalg.solve(precision, -slopes.T @ off)[0])
        height += step
        height_sd = float(np.sqrt(np.linalg.inv(precision)[0, 0]))
        if abs(step) < SETTLED * height_sd:
            break
    else:
        return None
    return Pull(float(near.pushes[0]), abs(push_by_height) * height_sd)


def _by_height(posed: SpinePose) -> tuple[Array, float]:
    """(n,) change of the pose, and of the pull (N/m), with the height."""
    assert posed.result.answers is not None
    q, pushes = posed.result.answers.to(np.zeros((len(posed.result.q), 1)), np.eye(2)[:, :1])
    return q[:, 0], float(pushes[0, 0])


@dataclass(frozen=True)
class AbsoluteStiffness:
    """(S,) N m/deg of the segments at rest, and of their geometric mean, with 95 % intervals.

    Attributes
    ----------
    joints, mean : (3, S) and (3,): value, low, high. films : under known pulls, by which it is.
    """

    joints: Array
    mean: Array
    films: tuple[str, ...]


def stiffness_by_pulls(
    patient: Patient, fit: FilmFit, known: PatientPrior, depth_mm: float
) -> AbsoluteStiffness | str:
    """The stiffness with which films under known pulls are as they are; or why nothing tells it.

    Pulls are those of the model, times its scale, less what all these films have in common, as
    the weight that lying takes away: a line through known over model pulls, whose slope is the
    scale. The interval has what reading these films and the laws themselves leave open.
    """
    stated = {n: f for n, f in patient.read.traction.items() if np.isfinite(f)}
    if len(set(stated.values())) < 2:
        return "one pull alone: a film of the same posture under another traction_n is needed"
    rng, s = np.random.default_rng(0), fit.segments
    root = np.linalg.cholesky(known.covariance)
    # every draw has a mirror image, so that the mean of draws is that of what is known
    half = rng.normal(size=(DRAWS // 2, len(known.mean)))
    found = []
    for number, away in enumerate([np.zeros(len(known.mean)), *half, *-half]):
        numbers = known.mean + root @ away
        spine = pulled_spine(patient, fit.model_of(numbers), depth_mm)
        pulls = [pull_of(spine, patient.read.films[name], fit.sd) for name in stated]
        scale = _scale(list(stated.values()), pulls, rng.normal() if number else 0.0)
        if scale is not None:
            found.append(np.log(scale * fit.size / DEG_PER_RAD) + numbers[:s])
        elif not number:
            return "no pose of the model is as long as these films under a pull that grows"
    if len(found) < 0.8 * DRAWS:
        return f"{DRAWS + 1 - len(found)} of {DRAWS} drawn laws have no pose under these pulls"
    logs = np.array(found)
    logs = np.column_stack([logs, logs.mean(axis=1)])
    reach = float(norm.ppf(0.5 + 0.5 * LEVEL)) * logs[1:].std(axis=0, ddof=1)
    ends = np.exp(np.stack([logs[0], logs[0] - reach, logs[0] + reach]))
    return AbsoluteStiffness(ends[:, :-1], ends[:, -1], tuple(stated))


def _scale(known: Sequence[float], pulls: Sequence[Pull | None], away: float) -> float | None:
    """Slope of known pulls over the model's, so many SD of reading off; None without one."""
    there = [one for one in pulls if one is not None]
    if len(there) < len(pulls):
        return None
    forces = np.array(known) - np.mean(known)
    # the model's pulls over known ones: known ones are exact
    inverse = float(forces @ [one.newton for one in there]) / float(forces @ forces)
    sd = float(np.hypot.reduce(forces * [one.sd for one in there])) / float(forces @ forces)
    return float(np.exp(away * sd / inverse)) / inverse if inverse > 0.0 else None
