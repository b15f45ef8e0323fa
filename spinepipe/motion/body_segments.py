"""Masses and inertias of a person's segments: slices of the trunk, and what hangs on T1.

Slices, where a cohort tells no inertia, are elliptic cylinders. A slice is as high as its vertebra
with one disc, from the joint below it to the one above; T1, above which no joint is told, is as
high as T2. Its area follows from its mass at the density of water, and it is 0.65 times as deep as
wide, as the middle part of de Leva's men is. The pelvis is turned as his lower trunk, growing with
height.

T1 carries head and arms, rigidly, where the arms are in the task. Their masses, centres, radii of
gyration and lengths are those of de Leva 1996. Where they lie relative to the joint T1T2 comes from
the trunk that `trunk_loads` uses. All grow with height. Arms are two straight pieces, upper arm and
forearm with hand. Where the hands are is a choice:

- hanging: straight below the shoulders;
- behind_head: at the back of the head, elbows outwards;
- crossed: on the other shoulder's front, elbows downwards.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from spinepipe.anatomy.segments import CENTRE, GYRATION, HEIGHT_M, LENGTH_M, Sex, length_m, mass_kg
from spinepipe.effects.contract import Array
from spinepipe.facts import number, several
from spinepipe.frames import Pose
from spinepipe.motion.skeleton import BODIES, PELVIS, Masses, Skeleton, body_poses
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

DENSITY_KG_PER_M3 = 1000.0
"""A choice; a thorax with its lungs is some 10 % lighter."""

DEPTH_OVER_WIDTH = number(__name__, "trunk_depth_over_width")

WIDEST_M = 0.6
"""A slice wider than this has no slice's mass: head and arms are hung on T1 separately."""


@dataclass(frozen=True, eq=False)
class RigidPart:
    """A rigid part.

    Attributes
    ----------
    name : of what. kg : its mass. com : (3,) m, its centre of mass.
    about_com : (3, 3) kg m2, inertia about it; both in axes that all parts share.
    """

    name: str
    kg: float
    com: Array
    about_com: Array


def combine(name: str, parts: Sequence[RigidPart]) -> RigidPart:
    """All parts as one, by parallel axes."""
    kg = sum(part.kg for part in parts)
    com = sum((part.kg * part.com for part in parts), np.zeros(3)) / kg
    about = []
    for part in parts:
        # Steiner: a mass so far away adds its square, less what lies along the axis
        away = part.com - com
        square = np.einsum("i,i->", away, away)
        about.append(part.about_com + part.kg * (square * np.eye(3) - np.outer(away, away)))
    return RigidPart(name, kg, com, np.sum(about, axis=0))


def in_frame(part: RigidPart, rotation: Array, origin: Array) -> RigidPart:
    """The part in a frame that has this rotation (3, 3) and origin (3,) m in the present axes."""
    com, about = rotation.T @ (part.com - origin), rotation.T @ part.about_com @ rotation
    return RigidPart(part.name, part.kg, com, about)


def slice_inertias(steps: Sequence[Pose], kg: Array, subject: Subject) -> Array:
    """(18, 3, 3) kg m2 of all bodies about their centres of mass, in their own axes.

    Parameters
    ----------
    steps : (17,) of a skeleton. kg : (18,) mass of each body, without head and arms.
    subject : whose pelvis it is.

    Raises
    ------
    ValueError
        Where a mass makes a slice wider than `WIDEST_M`.
    """
    # each slice's axis from its lower to its upper joint
    axes = [step.origin for step in steps[1:]]
    axes.append(np.array([0.0, float(np.linalg.norm(axes[-1])), 0.0]))
    slices = [cylinder(axis, kg[k], BODIES[k]) for k, axis in enumerate(axes, start=1)]
    return np.array([pelvis_inertia(float(kg[PELVIS]), subject), *slices])


def cylinder(axis: Array, kg: float, name: str) -> Array:
    """(3, 3) kg m2 of an elliptic cylinder along an axis (3,) m, wide along the body's z.

    Raises
    ------
    ValueError
        Where it would be wider than `WIDEST_M`.
    """
    height = float(np.linalg.norm(axis))
    half_width = np.sqrt(kg / (DENSITY_KG_PER_M3 * np.pi * height * DEPTH_OVER_WIDTH))
    if 2.0 * half_width > WIDEST_M:
        raise ValueError(
            f"{name}: {kg:.2f} kg between joints {1e3 * height:.0f} mm apart are no slice of a "
            f"trunk, {2e3 * half_width:.0f} mm wide; give its inertia"
        )
    half_depth = DEPTH_OVER_WIDTH * half_width
    deep, high, wide = half_depth**2 / 4.0, height**2 / 12.0, half_width**2 / 4.0
    # axes forwards, up and to the right of a slice whose axis is up
    up = axis / height
    forwards = np.cross(up, [0.0, 0.0, 1.0])
    forwards /= np.linalg.norm(forwards)
    turn = np.column_stack([forwards, up, np.cross(forwards, up)])
    found: Array = kg * turn @ np.diag([wide + high, wide + deep, deep + high]) @ turn.T
    return found


def pelvis_inertia(kg: float, subject: Subject) -> Array:
    """(3, 3) kg m2 of the pelvis, axes of ground in the neutral pose."""
    trunk, tall = f"lower_trunk {subject.sex}", subject.height_m / HEIGHT_M[subject.sex]
    forwards, right, up = tall * LENGTH_M[trunk] * np.array(GYRATION[trunk])
    found: Array = kg * np.diag(np.array([forwards, up, right]) ** 2)
    return found


def with_head_and_arms(skeleton: Skeleton, arms: Arms, subject: Subject) -> Masses:
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
    turns, places = body_poses(skeleton, np.zeros((len(BODIES), len(COORDINATES))))
    turn, at = turns[T1], places[T1]
    own = RigidPart("T1", float(given.kg[T1]), given.com[T1], given.about_com[T1])
    hanging = (in_frame(part, turn, at) for part in head_and_arm_parts(arms, subject, at))
    whole = combine("T1", [own, *hanging])
    kg, com, about = given.kg.copy(), given.com.copy(), given.about_com.copy()
    kg[T1], com[T1], about[T1] = whole.kg, whole.com, whole.about_com
    return Masses(kg, com, about)


def head_and_arm_parts(arms: Arms, subject: Subject, t1: Array) -> tuple[RigidPart, ...]:
    """Head and neck, and the segments of both arms, ground axes, the joint T1T2 at t1 (3,) m."""
    tall = subject.height_m / REFERENCE.height_m
    head = t1 + tall * HEAD_M
    shoulder = t1 + tall * SHOULDER_M
    right = tuple(_arm(arms, subject, shoulder, head, t1))
    # the left arm lies across the plane of symmetry at T1
    flip = np.diag([1.0, 1.0, -1.0])
    left = (
        RigidPart(
            part.name.replace("right", "left"),
            part.kg,
            t1 + flip @ (part.com - t1),
            flip @ part.about_com @ flip,
        )
        for part in right
    )
    return (upright_head(subject, head), *right, *left)


def upright_head(subject: Subject, at: Array) -> RigidPart:
    """Head and neck, their centre of mass at (3,) m, ground axes."""
    kg = mass_kg("head", subject.sex, subject.mass_kg)
    length = length_m("head", subject.sex, subject.height_m)
    forwards, sideways, along = length * np.array(GYRATION[f"head {subject.sex}"])
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
    """A segment from its upper end along a direction (3,)."""
    kg = mass_kg(segment, subject.sex, subject.mass_kg)
    across, lengthwise = round_gyration(segment, subject.sex)
    axis = np.outer(along, along)
    about = kg * length**2 * (across**2 * (np.eye(3) - axis) + lengthwise**2 * axis)
    at = start + CENTRE[f"{segment} {subject.sex}"] * length * along
    return RigidPart(f"right_{segment}", kg, at, about)


def round_gyration(segment: str, sex: Sex) -> tuple[float, float]:
    """Radii across a segment of an arm and along it, shares of its length; round, as its axes are
    not known.

    De Leva's two radii across the segment differ by 1 to 18 %; their mean square is taken.
    """
    forwards, sideways, lengthwise = GYRATION[f"{segment} {sex}"]
    return float(np.sqrt(0.5 * (forwards**2 + sideways**2))), lengthwise


def elbow_between(
    shoulder: Array, hand: Array, upper: float, lower: float, towards: Array
) -> Array:
    """(3,) m where the elbow is: arms of two lengths between two places, bent towards a side.

    Raises
    ------
    ValueError
        Where the two lengths do not reach from one place to the other.
    """
    # the triangle of both lengths and the line between the places (law of cosines)
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
