"""Muscle forces that hold a task where the spine has moved to under them.

Rotations are given; the joints' forces follow by adding up what is above each joint, and with them
how far the vertebrae have moved on each other and how stiff the joints have become. That moves the
fascicles, which changes the forces: a fixed point in the joints' forces, found by relaxed rounds
whose step follows Aitken's rule (Irons and Tuck 1969, Int J Numer Methods Eng 1:275).
"""

from dataclasses import dataclass, replace

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.muscles.applied_loads import AppliedLoads, applied_loads
from spinepipe.muscles.forces import Demand, Forces, least_stress
from spinepipe.muscles.passive_tissue import LIGAMENT_ARM_M
from spinepipe.muscles.paths import Pulls
from spinepipe.muscles.person import Person, above
from spinepipe.muscles.pose import BodyPoses, place_bodies, rotations_of
from spinepipe.muscles.task import Task
from spinepipe.muscles.trunk import EXTENSION, LEVELS
from spinepipe.status import Balanced

L4L5 = LEVELS.index("L4L5")

_SHORTEST, _LONGEST = 0.1, 5.0
"""Least and largest step of a round: Aitken's rule overshoots where two rounds are nearly alike."""

_HEAVY_N = 3000.0
"""Compression of all joints that the second search starts from: a heavy load."""

_LOWEST = 3
"""Rows of L5S1 in a demand."""

_ALONG = 1
"""Axis of a disc along the spine."""


@dataclass(frozen=True)
class SolverOptions:
    """How rounds are repeated, and what wrong simplification is tried.

    Attributes
    ----------
    change, residual_nm : of forces over their size, and out of balance; less than that at the end.
    slack_nm : moment that may be left over before a task counts as beyond strength.
    most : rounds.
    feedback : whether forces move the spine at all. translates : whether joints do more than turn.
    lowest_alone : whether L5S1 alone is balanced.
    twice : whether to look for a second answer from another start.
    """

    change: float = 0.01
    residual_nm: float = 0.1
    slack_nm: float = 0.5
    most: int = 60
    feedback: bool = True
    translates: bool = True
    lowest_alone: bool = False
    twice: bool = False


@dataclass(frozen=True)
class SolverRound:
    """One round: change over size (None in the first), N m out of balance, compression of L4L5."""

    change: float | None
    residual_nm: float
    compression_n: float


@dataclass(frozen=True, eq=False)
class SolvedTask:
    """A task with the muscle forces that were found for it.

    Attributes
    ----------
    poses, pulls, applied : posture, fascicles and what acts from outside.
    demand : what muscles have to do, 21 rows: joint by joint about x, y, z of ground.
    found : their forces. stretched : (M,) N, share of them that comes of being stretched.
    pushes : (7, 3) N of what is above on what is below, on the axes of the disc: forwards, up,
        to the right; compression is the downward one.
    joint_moments : (7, 3) N m of the joints on what is above, disc axes.
    stiffening : (7,) factor of the joints' bending stiffness.
    """

    status: Balanced
    message: str
    poses: BodyPoses
    pulls: Pulls
    applied: AppliedLoads
    demand: Demand
    found: Forces
    stretched: Array
    pushes: Array
    joint_moments: Array
    stiffening: Array
    rounds: tuple[SolverRound, ...] = ()

    @property
    def compression(self) -> Array:
        """(7,) N."""
        found: Array = -self.pushes[:, 1]
        return found

    @property
    def on_discs(self) -> Array:
        """(7, 3) N m that muscles have to make on what is above, disc axes."""
        return np.einsum("kji,kj->ki", self.poses.discs, self.demand.required.reshape(-1, 3))

    @property
    def slack_on_discs(self) -> Array:
        """(7, 3) N m that no muscle holds, disc axes."""
        return np.einsum("kji,kj->ki", self.poses.discs, self.found.slack.reshape(-1, 3))


def angles_of(person: Person, task: Task) -> Array:
    """(8, 3) rad, the bodies' angles in a task."""
    return task.turned + person.upright if task.from_upright else task.turned


@dataclass(frozen=True, eq=False)
class TurnedPose:
    """What of a posture forces do not change: the rotations are given.

    Attributes
    ----------
    poses : without translations. unpressed : (7, 3) N m of joints without compression, disc axes.
    ligaments : (7,) N m of what lies behind the joints, extension positive.
    """

    poses: BodyPoses
    unpressed: Array
    ligaments: Array

    @classmethod
    def of(cls, person: Person, task: Task) -> "TurnedPose":
        """Of a person in a task."""
        if task.instant is None:
            rotations = rotations_of(person.chain, angles_of(person, task))
        else:
            rotations = task.instant.turned @ rotations_of(person.chain, person.upright)
        poses = place_bodies(person.chain, rotations, np.zeros((len(LEVELS), 3)))
        unpressed = person.laws.moments(poses.turned, np.zeros(len(LEVELS)))
        return cls(poses, unpressed, person.laws.ligament_moments(poses.turned))


def solve_task(
    person: Person,
    task: Task,
    options: SolverOptions = SolverOptions(),
    tone: float | None = None,
    nearby: SolvedTask | None = None,
) -> SolvedTask:
    """Muscle forces of a task.

    Parameters
    ----------
    tone : least activation of every muscle, share of its largest; the task's own by default.
    nearby : a task much like it, such as the frame before, whose forces shorten the way.

    Raises
    ------
    ValueError
        For a load that the arms do not reach.
    """
    least = task.tone_share if tone is None and task.tone == "stated" else tone or 0.0
    still = np.zeros((len(LEVELS), 3))
    first = _iterate(person, task, options, least, nearby.pushes if nearby else still, nearby)
    if not (options.twice and options.feedback) or first.status is not Balanced.CONVERGED:
        return first
    again = _iterate(person, task, options, least, np.array([0.0, -_HEAVY_N, 0.0]) + still)
    apart = _change(again.found.forces, first.found.forces)
    if apart > 2.0 * options.change:
        message = f"another start ends {100.0 * apart:.1f} % away"
        return replace(first, status=Balanced.TWO_ANSWERS, message=message)
    return first


def solve_with_forces(person: Person, task: Task, forces: Array, rounds: int = 20) -> SolvedTask:
    """The task with given muscle forces (M,) N, where the spine has moved to under them."""
    turned = TurnedPose.of(person, task)
    pushes, options = np.zeros((len(LEVELS), 3)), SolverOptions()
    for _ in range(rounds):
        now = _solve_round(person, task, options, 0.0, turned, pushes, given=forces)
        pushes = now.pushes
    return now


def _iterate(
    person: Person,
    task: Task,
    options: SolverOptions,
    tone: float,
    pushes: Array,
    nearby: SolvedTask | None = None,
) -> SolvedTask:
    """Rounds from a spine whose joints carry `pushes` (7, 3) N, disc axes."""
    turned = TurnedPose.of(person, task)
    rounds: list[SolverRound] = []
    trail: list[Array] = []
    step, last, found = 1.0, np.zeros_like(pushes), nearby.found if nearby else None
    while True:
        now = _solve_round(person, task, options, tone, turned, pushes, nearby=found)
        found = now.found
        before = trail[-1] if trail else np.zeros_like(found.forces)
        change = _change(found.forces, before) if trail else None
        residual = _residual(now, before, options)
        trail.append(found.forces)
        rounds.append(
            SolverRound(change, residual if change is not None else 0.0, now.compression[L4L5])
        )
        settled = change is not None and change < options.change and residual < options.residual_nm
        if settled or not options.feedback or len(rounds) >= options.most:
            done = settled or not options.feedback
            status, message = _outcome(now, options, rounds, trail, done)
            return replace(now, status=status, message=message, rounds=tuple(rounds))
        off = now.pushes - pushes
        step, last = (_aitken_step(step, off, last) if len(rounds) > 1 else step), off
        pushes = pushes + step * off


def _aitken_step(step: float, off: Array, last: Array) -> float:
    """How far to go towards what a round found: Aitken's rule, shorter where rounds swing, longer
    where they creep."""
    by = (off - last).ravel()
    size = float(by @ by)
    wanted = -step * float(last.ravel() @ by) / size if size > 0.0 else 1.0
    return min(max(wanted, _SHORTEST), _LONGEST)


def _residual(now: SolvedTask, before: Array, options: SolverOptions) -> float:
    """N m by which the forces of the round before miss what this one asks of them.

    Beyond strength they are held against those of this round, which miss it, too.
    """
    off = now.demand.required - now.demand.arms @ before
    if not now.found.enough:
        off = now.demand.arms @ (now.found.forces - before)
    return float(np.abs(off[: _LOWEST if options.lowest_alone else None]).max())


def _outcome(
    now: SolvedTask,
    options: SolverOptions,
    rounds: list[SolverRound],
    trail: list[Array],
    settled: bool,
) -> tuple[Balanced, str]:
    """Status and message of the last round; `trail` are the forces of all."""
    if not settled:
        change = rounds[-1].change or 0.0
        message = f"after {len(rounds)} rounds forces still change by {100.0 * change:.1f} %"
        # back at the forces of the last round but one: two rounds feed each other
        back = _change(trail[-1], trail[-3]) if len(trail) > 2 else np.inf
        if back < 0.1 * change:
            return Balanced.CYCLING, f"{message}, to and fro"
        return Balanced.NOT_CONVERGED, message
    if not now.found.enough:
        slack = np.abs(now.found.slack.reshape(-1, 3))
        short, level = float(slack.max()), LEVELS[int(np.argmax(slack.max(axis=1)))]
        if short > options.slack_nm:
            return Balanced.BEYOND_STRENGTH, f"{short:.1f} N m too much for the muscles at {level}"
        return Balanced.CONVERGED, f"{short:.2f} N m left over at {level}"
    return Balanced.CONVERGED, ""


def _solve_round(
    person: Person,
    task: Task,
    options: SolverOptions,
    tone: float,
    turned: TurnedPose,
    pushes: Array,
    given: Array | None = None,
    nearby: Forces | None = None,
) -> SolvedTask:
    """Forces, or what given ones do, where the joints' forces were `pushes` (7, 3) N."""
    # where the joints' compliance puts the vertebrae, and how stiff compression makes them
    moves = options.feedback and options.translates
    translations = person.laws.translations(pushes) if moves else np.zeros_like(pushes)
    poses = turned.poses.translated(translations)
    pulls = person.lines.pulls(poses)
    loads = applied_loads(person, task, poses)
    stiffening = person.laws.stiffening(-pushes[:, 1])
    joint = stiffening[:, None] * turned.unpressed
    joint[:, EXTENSION] += turned.ligaments
    # what loads and joints leave to the muscles, and what these can make
    weights, turning = above(loads.forces, loads.moments, poses.centres)
    required = -(turning + np.einsum("kij,kj->ki", poses.discs, joint))
    drawn, arms = above(pulls.forces, pulls.moments, poses.centres)
    muscles = person.lines.trunk.muscles
    strength = task.stress_pa * muscles.pcsa
    stretched = person.passive.forces(pulls.lengths, person.rest, person.fibres, strength)
    demand = Demand(
        np.ascontiguousarray(arms.reshape(len(muscles), -1).T),
        required.ravel(),
        stretched + tone * strength,
        stretched + strength,
        muscles.pcsa,
        pulls.along_sheath,
    )
    if given is not None:
        found = Forces(given, demand.required - demand.arms @ given, True)
    else:
        asked = demand
        if options.lowest_alone:
            rows = {"arms": demand.arms[:_LOWEST], "required": demand.required[:_LOWEST]}
            asked = replace(demand, **rows)
        found = least_stress(asked, nearby)
        found = replace(found, slack=demand.required - demand.arms @ found.forces)
    # what is above a joint is carried by it: weights, and all fascicles that cross it
    on_joints = weights + np.einsum("mki,m->ki", drawn, found.forces)
    on_discs = np.einsum("kji,kj->ki", poses.discs, on_joints)
    # ligaments pull the vertebrae together behind the joint
    on_discs[:, _ALONG] -= turned.ligaments / LIGAMENT_ARM_M
    return SolvedTask(
        *(Balanced.CONVERGED, "", poses, pulls, loads, demand, found),
        *(stretched, on_discs, joint, stiffening),
    )


def _change(now: Array, before: Array) -> float:
    """Size of what changed over the size of what is; nought where there is nothing."""
    size = float(np.sqrt(now @ now))
    apart = now - before
    return float(np.sqrt(apart @ apart)) / size if size > 0.0 else 0.0
