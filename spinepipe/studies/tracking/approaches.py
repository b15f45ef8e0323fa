"""Approaches by name: what each asks of a motion, and the motion that it finds."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.motion.objective import SHAPE, Ask, ResidualScales, Watched, watched
from spinepipe.motion.passive import PassiveLaw
from spinepipe.motion.passive_elements import PassiveElements
from spinepipe.motion.points import COUNT
from spinepipe.motion.posture import postures
from spinepipe.motion.ratios import RatioSet
from spinepipe.motion.skeleton import PELVIS, MarkerTrial
from spinepipe.motion.skin import with_sliding_skin
from spinepipe.motion.trajectory import solve
from spinepipe.status import Status
from spinepipe.studies.tracking.persons import TrackedPerson, carrying
from spinepipe.studies.tracking.settings import (
    CONSTRAINED,
    LEARNT,
    OWN,
    Approach,
    Scales,
    Tracking,
)
from spinepipe.units import COORDINATES, DEG_PER_RAD, MM_PER_M, ROTATIONS, TRANSLATIONS

_LENGTHS = len(TRANSLATIONS)

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

    ask: Ask
    watched: Watched
    motion: tuple[Array, Array, Array]
    status: Status
    message: str
    unknowns: int
    steps: int

    @property
    def q(self) -> Array:
        """(N + 1, 18, 6) m and rad."""
        return self.motion[0]


def learns(approach: str) -> bool:
    """Whether an approach takes over passive elements that were calibrated on trials."""
    return approach in LEARNT or approach == OWN


def source_of(approach: str, kind: str) -> str:
    """From which trials the passive elements of an approach are, in a trial of a kind."""
    return LEARNT.get(approach, kind)


def sizes_of(scales: Scales) -> ResidualScales:
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


def seen_in(settings: Tracking, person: TrackedPerson, trial: MarkerTrial) -> Watched:
    """What is seen of a trial at nodes; one posture, the mean, of a trial that stands."""
    skeleton = carrying(person, trial)
    if trial.kind == "stance":
        return watched(skeleton, person.markers, still(trial), settings.intervals)
    return watched(skeleton, person.markers, trial, settings.intervals)


def still(trial: MarkerTrial) -> MarkerTrial:
    """The mean of a trial as its only frame."""
    count = trial.seen.sum(axis=0)
    places = np.where(trial.seen[..., None], trial.places, 0.0).sum(axis=0)
    mean = places / np.maximum(count, 1)[:, None]
    return replace(trial, time_s=trial.time_s[:1], places=mean[None], seen=(count > 0)[None])


def law_of(elements: PassiveElements, approach: str, learnt: PassiveLaw | None) -> PassiveLaw:
    """Passive elements that an approach starts with or keeps."""
    if learnt is not None:
        return learnt
    ends = {"optk_generic_lower": elements.lower, "optk_generic_upper": elements.upper}
    return PassiveLaw(elements.a * ends.get(approach, 1.0), elements.b)


def unloaded(settings: Tracking, person: TrackedPerson) -> Array:
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
    ask = Ask(low=low, high=high, passive=law, loads=False, sizes=sizes_of(settings.scales))
    seen = watched(carrying(person, static), person.markers, still(static), settings.intervals)
    found: Array = postures(ask, seen).q[0, PELVIS + 1 :]
    return found


def asked_of(
    settings: Tracking, person: TrackedPerson, approach: Approach, learnt: PassiveLaw | None = None
) -> Ask:
    """What an approach asks; learnt : passive elements that it takes over."""
    sizes = sizes_of(settings.scales)
    if approach.startswith("ik") and approach != "ik_springs":
        return Ask(
            free=_rotations_alone(), loads=False, smooth=approach == "ik_smooth", sizes=sizes
        )
    low, high = _ranges(settings, person)
    law = law_of(person.passive, approach, learnt)
    return Ask(
        low=low,
        high=high,
        passive=None if approach == "optk_zero" else replace(law, rest=unloaded(settings, person)),
        loads=approach != "ik_springs",
        force_cost=settings.force_cost,
        sizes=sizes,
    )


def fitting(settings: Tracking, person: TrackedPerson) -> Ask:
    """Elements of all rotations are fitted; those along axes, which no marker tells, stay."""
    ask = asked_of(settings, person, "optk_generic")
    fitted = np.zeros_like(ask.fitted)
    fitted[:, [COORDINATES.index(name) for name in ROTATIONS]] = True
    return replace(ask, fitted=fitted)


def _rotations_alone() -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    free = np.ones(SHAPE, dtype=bool)
    free[PELVIS + 1 :, :_LENGTHS] = False
    return free


def _ranges(settings: Tracking, person: TrackedPerson) -> tuple[Array, Array]:
    """(18, 6) m and rad, the ends of how far coordinates may go; those of the pelvis anywhere."""
    limits = person.limits.widened(settings.bounds.times)
    low, high = np.full(SHAPE, -np.inf), np.full(SHAPE, np.inf)
    low[PELVIS + 1 :], high[PELVIS + 1 :] = limits[..., 0], limits[..., 1]
    return low, high


def found_by(
    approach: Approach, ask: Ask, seen: Watched, ratios: Mapping[str, RatioSet]
) -> ApproachMotion:
    """The motion that an approach finds."""
    if approach.startswith(CONSTRAINED):
        chosen = ratios[approach.removeprefix(CONSTRAINED)]
        return _frames(ask, seen, _whole(chosen))
    if approach in ("ik", "ik_springs") or seen.grid.intervals == 0:
        return _frames(ask, seen)
    return trajectory(ask, seen)


def trajectory(ask: Ask, seen: Watched) -> ApproachMotion:
    """The motion over all its time."""
    seen, begin = begun(ask, seen)
    solved = solve(ask, [seen], [begin])
    return ApproachMotion(
        *(ask, seen, seen.grid.at_nodes(solved.coefficients[0]), solved.status, solved.message),
        *(int(ask.free.sum()) * seen.grid.coefficients, solved.steps),
    )


def begun(ask: Ask, seen: Watched) -> tuple[Watched, Array]:
    """A trial with markers weighed as skin slides, and coefficients (N + 3, 18, 6) to begin with.

    Both are from postures of each frame by itself, near enough. Without dynamics markers are
    weighed alike, as inverse kinematics has it.
    """
    simple = replace(ask, loads=False, smooth=False, fitted=np.zeros_like(ask.fitted))
    found = postures(simple, seen, most_steps=_NEAR_ENOUGH).q
    known = with_sliding_skin(seen, found, ask.sizes) if ask.loads else seen
    return known, seen.grid.through(found)


def _whole(ratios: RatioSet) -> Array:
    """(108, 9) what the pelvis and three driving rotations make of all coordinates."""
    found = np.zeros((COUNT, len(SHAPE) + 7))
    pelvis = SHAPE[1]
    found[:pelvis, :pelvis] = np.eye(pelvis)
    found[pelvis:, pelvis:] = ratios.mapping.reshape(-1, 3)
    return found


def _frames(ask: Ask, seen: Watched, ratios: Array | None = None) -> ApproachMotion:
    """Each frame by itself; how fast it went follows from the curve through the frames."""
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
