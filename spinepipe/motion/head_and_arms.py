"""Head and arms that T1 carries: rigid, where the arms are in the task.

Masses, centres, radii of gyration and lengths are those of de Leva 1996. Where they lie relative to
the joint T1T2 comes from the trunk that `trunk_loads` uses. All grow with height.

Arms are two straight pieces, upper arm and forearm with hand. Where the hands are is a choice:

- hanging: straight below the shoulders;
- behind_head: at the back of the head, elbows outwards;
- crossed: on the other shoulder's front, elbows downwards.
"""

from collections.abc import Iterator
from typing import Literal, get_args

import numpy as np

from spinepipe.anatomy.segments import CENTRE, GYRATION, MASS_PERCENT, length_m
from spinepipe.effects.contract import Array
from spinepipe.facts import several
from spinepipe.frames import Pose
from spinepipe.motion.rigid import RigidPart, joined, seen_from
from spinepipe.motion.skeleton import BODIES, JOINTS, Masses, Skeleton, body_poses
from spinepipe.muscles.masses import ARM
from spinepipe.muscles.subject import REFERENCE, Subject
from spinepipe.units import COORDINATES

Arms = Literal["hanging", "behind_head", "crossed"]
ARMS: tuple[Arms, ...] = get_args(Arms)

T1 = BODIES.index("T1")

SHOULDER_M = np.array(several(__name__, "shoulder_from_joint")[""])
"""Right shoulder from the joint T1T2 at the reference height, ground axes."""

HEAD_M = np.array(several(__name__, "head_from_joint")[""])
"""Centre of mass of head and neck from the joint T1T2 at the reference height."""

BEHIND_HEAD_M = np.array([-0.10, 0.0, 0.03])
"""Right hand from the centre of the head, behind it: a choice."""

ON_SHOULDER_M = np.array([0.06, -0.03, 0.0])
"""A hand from the other shoulder, ahead of it and below: a choice."""

ELBOW_TOWARDS = {"behind_head": (0.3, 0.3, 1.0), "crossed": (0.3, -1.0, 0.3)}
"""Where a right elbow points, off the line from shoulder to hand: a choice."""


def hung(skeleton: Skeleton, arms: Arms, subject: Subject) -> Masses:
    """The skeleton's masses, T1 carrying the head and both arms as well.

    The skeleton's own T1 is a slice of the trunk, without them.

    T1 stands as in the skeleton's neutral pose, upright; what it carries moves with it.

    Raises
    ------
    ValueError
        Where the arms are none of `ARMS`.
    """
    if arms not in ARMS:
        raise ValueError(f"arms {arms!r} are none of {', '.join(ARMS)}")
    given = skeleton.masses
    t1 = _neutral(skeleton)
    carried = carried_parts(arms, subject, t1.origin)
    own = RigidPart("T1", float(given.kg[T1]), given.com[T1], given.about_com[T1])
    whole = joined("T1", [own, *(seen_from(part, t1.rotation, t1.origin) for part in carried)])
    kg, com, about = given.kg.copy(), given.com.copy(), given.about_com.copy()
    kg[T1], com[T1], about[T1] = whole.kg, whole.com, whole.about_com
    return Masses(kg, com, about)


def _neutral(skeleton: Skeleton) -> Pose:
    """T1's frame in ground, all coordinates being zero."""
    rest = np.zeros((len(JOINTS) + 1, len(COORDINATES)))
    turns, places = body_poses(skeleton, rest)
    return Pose(turns[T1], places[T1])


def carried_parts(arms: Arms, subject: Subject, t1: Array) -> tuple[RigidPart, ...]:
    """Head and neck, and the segments of both arms, ground axes, the joint T1T2 at t1 (3,) m."""
    tall = subject.height_m / REFERENCE.height_m
    head = t1 + tall * HEAD_M
    shoulder = t1 + tall * SHOULDER_M
    right = tuple(_arm(arms, subject, shoulder, head, t1))
    left = (_mirrored(part, t1) for part in right)
    return (_head(subject, head), *right, *left)


def _head(subject: Subject, at: Array) -> RigidPart:
    head = f"head {subject.sex}"
    kg = MASS_PERCENT[head] / 100.0 * subject.mass_kg
    length = length_m("head", subject.sex, subject.height_m)
    forwards, sideways, along = length * np.array(GYRATION[head])
    return RigidPart("head", kg, at, kg * np.diag([forwards**2, along**2, sideways**2]))


def _arm(
    arms: Arms, subject: Subject, shoulder: Array, head: Array, t1: Array
) -> Iterator[RigidPart]:
    """Segments of the right arm."""
    upper, fore, hand = ARM
    lengths = [length_m(segment, subject.sex, subject.height_m) for segment in ARM]
    to_hand = lengths[1] + CENTRE[f"{hand} {subject.sex}"] * lengths[2]
    tall = subject.height_m / REFERENCE.height_m
    if arms == "hanging":
        elbow = shoulder - [0.0, lengths[0], 0.0]
        towards = np.array([0.0, -1.0, 0.0])
    else:
        other = t1 + (shoulder - t1) * [1.0, 1.0, -1.0]
        target = (
            head + tall * BEHIND_HEAD_M if arms == "behind_head" else other + tall * ON_SHOULDER_M
        )
        elbow = elbow_between(shoulder, target, lengths[0], to_hand, np.array(ELBOW_TOWARDS[arms]))
        towards = (target - elbow) / to_hand
    down = (elbow - shoulder) / lengths[0]
    wrist = elbow + lengths[1] * towards
    places = ((upper, shoulder, down), (fore, elbow, towards), (hand, wrist, towards))
    for (segment, start, along), length in zip(places, lengths, strict=True):
        yield _segment(segment, subject, start, along, length)


def _segment(
    segment: str, subject: Subject, start: Array, along: Array, length: float
) -> RigidPart:
    """A segment from its upper end along a direction (3,); round, as its axes are not known.

    De Leva's two radii across the segment differ by 1 to 18 %; their mean square is taken.
    """
    named = f"{segment} {subject.sex}"
    kg = MASS_PERCENT[named] / 100.0 * subject.mass_kg
    forwards, sideways, lengthwise = GYRATION[named]
    across = 0.5 * (forwards**2 + sideways**2)
    axis = np.outer(along, along)
    about = kg * length**2 * (across * (np.eye(3) - axis) + lengthwise**2 * axis)
    at = start + CENTRE[named] * length * along
    return RigidPart(f"right_{segment}", kg, at, about)


def elbow_between(
    shoulder: Array, hand: Array, upper: float, lower: float, towards: Array
) -> Array:
    """(3,) m where the elbow is: arms of two lengths between two places, bent towards a side.

    Raises
    ------
    ValueError
        Where the two lengths do not reach from one place to the other.
    """
    line = hand - shoulder
    apart = float(np.linalg.norm(line))
    if not abs(upper - lower) < apart < upper + lower:
        raise ValueError(
            f"no arm of {1e3 * upper:.0f} and {1e3 * lower:.0f} mm has its ends "
            f"{1e3 * apart:.0f} mm apart"
        )
    along = line / apart
    share = (upper**2 - lower**2 + apart**2) / (2.0 * apart)
    side = towards - (towards @ along) * along
    out = side / np.linalg.norm(side)
    return shoulder + share * along + np.sqrt(upper**2 - share**2) * out


def _mirrored(part: RigidPart, t1: Array) -> RigidPart:
    """The left arm's segment, through the plane of symmetry at T1."""
    flip = np.diag([1.0, 1.0, -1.0])
    at = t1 + flip @ (part.com - t1)
    name = part.name.replace("right", "left")
    return RigidPart(name, part.kg, at, flip @ part.about_com @ flip)
