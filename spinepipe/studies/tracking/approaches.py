"""Approaches by name: what each asks of a motion, and the motion that it finds."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.motion.objective import (
    SHAPE,
    MotionObjective,
    ResidualScales,
    SampledTrial,
    sample_trial,
)
from spinepipe.motion.passive import PassiveLaw
from spinepipe.motion.points import COUNT
from spinepipe.motion.posture import postures
from spinepipe.motion.skeleton import PELVIS, MarkerTrial
from spinepipe.motion.skin import with_sliding_skin
from spinepipe.motion.trajectory import solve
from spinepipe.status import Status
from spinepipe.studies.recordings import STANCE
from spinepipe.studies.tracking.persons import TrackedPerson, skeleton_in_trial
from spinepipe.studies.tracking.settings import CONSTRAINED, Approach, Scales, Tracking
from spinepipe.units import COORDINATES, DEG_PER_RAD, MM_PER_M, ROTATIONS, TRANSLATIONS

_NEAR_ENOUGH = 25
"""Steps to a first guess of a posture."""


@dataclass(frozen=True, eq=False)
class ApproachMotion:
    """A motion as an approach has it.

    Attributes
    ----------
    ask, watched : what was asked, and of what. motion : place, velocity and acceleration at nodes,
        (N + 1, 18, 6) each, m and rad; the last two are zero for a posture that stands.
    unknowns : how many numbers were searched for. steps : of the search.
    """

    ask: MotionObjective
    watched: SampledTrial
    motion: tuple[Array, Array, Array]
    status: Status
    message: str
    unknowns: int
    steps: int

    @property
    def q(self) -> Array:
        """(N + 1, 18, 6) m and rad."""
        return self.motion[0]


def residual_scales(scales: Scales) -> ResidualScales:
    """The study's scales in SI."""
    return ResidualScales(
        marker_m=scales.marker_mm / MM_PER_M,
        moment_nm=scales.moment_nm,
        force_n=scales.force_n,
        loads=scales.loads,
        common_n=scales.common_force_n,
        own_skin_m=scales.skin_mm / MM_PER_M,
        shared_skin_m=scales.shared_skin_mm / MM_PER_M,
        turn_rad_per_s2=scales.turn_deg_per_s2 / DEG_PER_RAD,
        move_m_per_s2=scales.move_mm_per_s2 / MM_PER_M,
        size=scales.size_sd,
        shape=scales.shape_sd,
        frames=scales.frames,
    )


def sample_at_nodes(settings: Tracking, person: TrackedPerson, trial: MarkerTrial) -> SampledTrial:
    """What is seen of a trial at nodes; one posture, the mean, of a trial that stands."""
    if trial.kind == STANCE:
        trial = mean_frame(trial)
    skeleton = skeleton_in_trial(person, trial)
    return sample_trial(skeleton, person.markers, trial, settings.intervals)


def mean_frame(trial: MarkerTrial) -> MarkerTrial:
    """The mean of a trial as its only frame."""
    # of each marker over the frames that see it
    count = trial.seen.sum(axis=0)
    places = np.where(trial.seen[..., None], trial.places, 0.0).sum(axis=0)
    mean = places / np.maximum(count, 1)[:, None]
    return replace(trial, time_s=trial.time_s[:1], places=mean[None], seen=(count > 0)[None])


def unloaded_posture(settings: Tracking, person: TrackedPerson) -> Array:
    """(17, 6) m and rad, where passive elements are at rest.

    Raises
    ------
    ValueError
        Where it is to be the posture of the static trial, and there is none.
    """
    if settings.unloaded_posture == "neutral":
        return np.zeros(SHAPE)[PELVIS + 1 :]
    static = next((one for one in person.trials if one.name == person.static), None)
    if static is None:
        raise ValueError("there is no static trial in whose posture joints could be unloaded")
    low, high = _ranges(settings, person)
    law = PassiveLaw(person.passive.a, person.passive.b)
    scales = residual_scales(settings.scales)
    ask = MotionObjective(low=low, high=high, passive=law, loads=False, sizes=scales)
    skeleton = skeleton_in_trial(person, static)
    seen = sample_trial(skeleton, person.markers, mean_frame(static), settings.intervals)
    found: Array = postures(ask, seen).q[0, PELVIS + 1 :]
    return found


def objective_of(
    settings: Tracking, person: TrackedPerson, approach: Approach, learnt: PassiveLaw | None = None
) -> MotionObjective:
    """What an approach asks; learnt : passive elements that it takes over."""
    scales = residual_scales(settings.scales)
    if approach.startswith("ik") and approach != "ik_springs":
        # joints turn and do not slide
        free = np.ones(SHAPE, dtype=bool)
        free[PELVIS + 1 :, : len(TRANSLATIONS)] = False
        smooth = approach == "ik_smooth"
        return MotionObjective(free=free, loads=False, smooth=smooth, sizes=scales)
    low, high = _ranges(settings, person)
    generic = person.passive
    ends = {"optk_generic_lower": generic.lower, "optk_generic_upper": generic.upper}
    law = learnt or PassiveLaw(generic.a * ends.get(approach, 1.0), generic.b)
    rest = unloaded_posture(settings, person) if approach != "optk_zero" else None
    return MotionObjective(
        low=low,
        high=high,
        passive=None if rest is None else replace(law, rest=rest),
        loads=approach != "ik_springs",
        force_cost=settings.force_cost,
        sizes=scales,
    )


def calibration_objective(settings: Tracking, person: TrackedPerson) -> MotionObjective:
    """Elements of all rotations are fitted; those along axes, which no marker tells, stay."""
    ask = objective_of(settings, person, "optk_generic")
    fitted = np.zeros_like(ask.fitted)
    fitted[:, [COORDINATES.index(name) for name in ROTATIONS]] = True
    return replace(ask, fitted=fitted)


def _ranges(settings: Tracking, person: TrackedPerson) -> tuple[Array, Array]:
    """(18, 6) m and rad, the ends of how far coordinates may go; those of the pelvis anywhere."""
    limits = settings.bounds.times * person.limits
    low, high = np.full(SHAPE, -np.inf), np.full(SHAPE, np.inf)
    low[PELVIS + 1 :], high[PELVIS + 1 :] = limits[..., 0], limits[..., 1]
    return low, high


def find_motion(
    approach: Approach, ask: MotionObjective, seen: SampledTrial, ratios: Mapping[str, Array]
) -> ApproachMotion:
    """The motion that an approach finds."""
    if approach.startswith(CONSTRAINED):
        return _frame_by_frame(ask, seen, _driven(ratios[approach.removeprefix(CONSTRAINED)]))
    if approach in ("ik", "ik_springs") or seen.grid.intervals == 0:
        return _frame_by_frame(ask, seen)
    # the motion over all its time
    seen, begin = first_guess(ask, seen)
    solved = solve(ask, [seen], [begin])
    return ApproachMotion(
        *(ask, seen, seen.grid.at_nodes(solved.coefficients[0]), solved.status, solved.message),
        *(int(ask.free.sum()) * seen.grid.coefficients, solved.steps),
    )


def first_guess(ask: MotionObjective, seen: SampledTrial) -> tuple[SampledTrial, Array]:
    """A trial with markers weighed as skin slides, and coefficients (N + 3, 18, 6) to begin with.

    Both are from postures of each frame by itself, near enough. Without dynamics markers are
    weighed alike, as inverse kinematics has it.
    """
    simple = replace(ask, loads=False, smooth=False, fitted=np.zeros_like(ask.fitted))
    found = postures(simple, seen, most_steps=_NEAR_ENOUGH).q
    known = with_sliding_skin(seen, found, ask.sizes) if ask.loads else seen
    return known, seen.grid.through(found)


def _driven(ratios: Array) -> Array:
    """(108, 9) what the pelvis and three driving rotations make of all coordinates.

    Parameters
    ----------
    ratios : (17, 3) shares of joints in extension, right bending and left rotation.
    """
    # the pelvis moves by its own six; each joint by its share of the three sums
    pelvis = SHAPE[1]
    found = np.zeros((COUNT, pelvis + len(ROTATIONS)))
    found[:pelvis, :pelvis] = np.eye(pelvis)
    for k, name in enumerate(ROTATIONS):
        found[pelvis + COORDINATES.index(name) :: pelvis, pelvis + k] = ratios[:, k]
    return found


def _frame_by_frame(
    ask: MotionObjective, seen: SampledTrial, ratios: Array | None = None
) -> ApproachMotion:
    """Each frame by itself; how fast it went follows from the curve through the frames."""
    # a natural spline through the frames tells speed and acceleration; one posture has neither
    found = postures(ask, seen, ratios)
    grid = seen.grid
    rest = np.zeros_like(found.q)
    motion = grid.at_nodes(grid.through(found.q)) if grid.intervals else (found.q, rest, rest)
    lost = len(found.q) - int(np.count_nonzero(found.settled))
    unknowns = int(ask.free.sum()) if ratios is None else ratios.shape[1]
    return ApproachMotion(
        *(ask, seen, motion),
        Status.NOT_CONVERGED if lost else Status.CONVERGED,
        f"{lost} of {len(found.q)} frames did not settle" if lost else "",
        unknowns * len(found.q),
        found.steps,
    )
