"""Markers of a lift as a motion of a person's spine, and what the parts of the body load it with.

Pelvis, thorax and head are turned as their markers are, against the stance trial, in which the
person stands upright and looks forwards: there all bodies have the axes of ground. What lies
between pelvis and thorax turns in fixed shares. The centre of L5S1 moves with the markers of the
pelvis; the chain of joints stands on it.

A part of the body loads the body that carries it with its weight, less its mass times its
acceleration, and with less than no moment: the rate of its angular momentum, negative.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from spinepipe.anatomy.segments import CENTRE, length_m, mass_kg
from spinepipe.effects.contract import Array
from spinepipe.frames import zxy_angles
from spinepipe.motion.body_segments import RigidPart, round_gyration, upright_head
from spinepipe.motion.lifted_load import LiftedLoad
from spinepipe.motion.marker_groups import rigid_rotations
from spinepipe.motion.plug_in_gait import (
    HEAD,
    PELVIS,
    THORAX,
    Places,
    head_centre,
    l5s1_centre,
    shoulder_centres,
)
from spinepipe.motion.skeleton import BODIES, JOINTS, rotations
from spinepipe.motion.smoothing import acceleration, angular_velocity, velocity
from spinepipe.motion.standing_spine import StandingSpine
from spinepipe.muscles.masses import ARM
from spinepipe.muscles.subject import Subject
from spinepipe.units import STANDARD_GRAVITY

T1 = "T1"
"""Carries head, arms, and what hands hold."""

RIGID_FROM = BODIES.index("T11")
"""From here up the bodies turn as the thorax does: its markers are spread over all of them."""

SIDES = {"right": "R", "left": "L"}


@dataclass(frozen=True, eq=False)
class CarriedLoads:
    """What parts of the body, and what hands hold, load the spine with.

    Attributes
    ----------
    names : (K,) slice_L5, ..., head, right_upper_arm, ..., load. carriers : (K,) of `BODIES`.
    at : (F, K, 3) m, centres of mass in ground.
    forces : (F, K, 3) N on the carrier: gravity less inertia, and less what the floor bears.
    moments : (F, K, 3) N m on the carrier about the part's own centre of mass.
    """

    names: tuple[str, ...]
    carriers: tuple[str, ...]
    at: Array
    forces: Array
    moments: Array


@dataclass(frozen=True, eq=False)
class RecordedMotion:
    """A motion of a person.

    Attributes
    ----------
    name : of the trial. time_s : (F,).
    l5s1 : (F, 3) m, centre of the disc. joints : (F, 17, 3) m, as `JOINTS`; all in ground.
    rotations : (F, 18, 3, 3) of `BODIES` in ground: how far each is turned from standing upright.
    loads : with inertia. still : at the same places as if nothing were accelerated.
    lift_off_s : when hands bear half of what they lift; None where they do so all the time.
    """

    name: str
    time_s: Array
    l5s1: Array
    joints: Array
    rotations: Array
    loads: CarriedLoads
    still: CarriedLoads
    lift_off_s: float | None = None


@dataclass(frozen=True, eq=False)
class MovingPart:
    """A part over time.

    Attributes
    ----------
    at : (F, 3) m, its centre of mass. momentum : (F, 3) kg m2/s about it.
    """

    name: str
    carrier: str
    kg: float
    at: Array
    momentum: Array


def move(
    name: str,
    time_s: Array,
    spine: StandingSpine,
    shares: Array,
    stance: Places,
    places: Places,
    load: LiftedLoad | None = None,
) -> RecordedMotion:
    """The motion that markers of Plug-in-Gait tell.

    Parameters
    ----------
    time_s : (F,), evenly spaced. shares : (17, 3) of joints in the rotation from pelvis to thorax,
        about the three axes; those above T11T12 count there.
    stance : (3,) m, mean places in the stance trial. places : (F, 3) m, smooth.
    load : what hands lift, if anything.
    """
    step_s = float(np.mean(np.diff(time_s)))
    turned = {
        part: _turned(stance, places, names)
        for part, names in (("pelvis", PELVIS), ("thorax", THORAX), ("head", HEAD))
    }
    bodies = shared_rotations(turned["pelvis"], turned["thorax"], shares)
    centre = l5s1_centre(stance, spine.subject.sex)
    l5s1 = _carried(stance, places, PELVIS, turned["pelvis"], centre)
    joints = joint_centres(spine, l5s1, bodies)
    centre = head_centre(stance, spine.subject)
    head = _carried(stance, places, HEAD, turned["head"], centre)
    parts = [
        *_slices(spine, joints, bodies, step_s),
        _rigid("head", T1, upright_head(spine.subject, centre), head, turned["head"], step_s),
        *_arms(spine.subject, places, step_s),
    ]
    loads, still = carried_loads(parts, load, step_s)
    lift_off = None if load is None or load.lift_off is None else float(time_s[load.lift_off])
    return RecordedMotion(name, time_s, l5s1, joints, bodies, loads, still, lift_off)


def shared_rotations(pelvis: Array, thorax: Array, shares: Array) -> Array:
    """(F, 18, 3, 3) of all bodies, from those of pelvis and thorax (F, 3, 3).

    Each body between them is turned against the pelvis by its part of the three angles of the
    thorax against the pelvis.

    Parameters
    ----------
    shares : (17, 3) of joints.
    """
    between = np.swapaxes(pelvis, -1, -2) @ thorax
    angles = np.array([zxy_angles(one) for one in between])
    passed = np.concatenate([np.zeros((1, 3)), np.cumsum(shares, axis=0)])
    passed = np.minimum(passed / passed[RIGID_FROM], 1.0)
    found: Array = pelvis[:, None] @ rotations(angles[:, None, :] * passed)
    return found


def joint_centres(spine: StandingSpine, l5s1: Array, bodies: Array) -> Array:
    """(F, 17, 3) m of joints in ground, l5s1 (F, 3) m, bodies (F, 18, 3, 3)."""
    legs = np.diff(spine.joints, axis=0, prepend=np.zeros((1, 3)))
    moved = np.einsum("fkij,kj->fki", bodies[:, :-1], legs)
    found: Array = l5s1[:, None] + np.cumsum(moved, axis=1)
    return found


def carried_loads(
    parts: Sequence[MovingPart], load: LiftedLoad | None, step_s: float
) -> tuple[CarriedLoads, CarriedLoads]:
    """What parts load the spine with: with inertia, and without."""
    names = tuple(part.name for part in parts)
    carriers = tuple(part.carrier for part in parts)
    kg = np.array([part.kg for part in parts])[:, None]
    at = np.stack([part.at for part in parts], axis=1)
    weight = np.broadcast_to(kg * STANDARD_GRAVITY, at.shape)
    inertia = kg * acceleration(at, step_s)
    moments = -velocity(np.stack([part.momentum for part in parts], axis=1), step_s)
    if load is not None:
        names, carriers = (*names, "load"), (*carriers, T1)
        at = np.concatenate([at, load.at[:, None]], axis=1)
        weight = np.concatenate([weight, load.weight[:, None]], axis=1)
        inertia = np.concatenate([inertia, load.inertia(step_s)[:, None]], axis=1)
        moments = np.concatenate([moments, np.zeros_like(load.at)[:, None]], axis=1)
    still = CarriedLoads(names, carriers, at, weight, np.zeros_like(moments))
    return CarriedLoads(names, carriers, at, weight - inertia, moments), still


def net_moments(joints: Array, loads: CarriedLoads) -> tuple[Array, Array]:
    """What the body below each joint exerts on all above it, to move it as it was seen.

    Parameters
    ----------
    joints : (F, 17, 3) m.

    Returns
    -------
    Forces (F, 17, 3) N and moments (F, 17, 3) N m about the joints, ground axes: right bending,
    left rotation, extension.
    """
    above = (
        np.array([BODIES.index(name) for name in loads.carriers]) > np.arange(len(JOINTS))[:, None]
    )
    total = np.einsum("jk,fki->fji", above, loads.forces)
    about_origin = np.cross(loads.at, loads.forces) + loads.moments
    moments = np.einsum("jk,fki->fji", above, about_origin) - np.cross(joints, total)
    return -total, -moments


def _turned(stance: Places, places: Places, names: Sequence[str]) -> Array:
    """(F, 3, 3) rotation of a group of markers from the stance."""
    there = [name for name in names if name in stance and name in places]
    model = np.array([stance[name] for name in there])
    moving = np.stack([places[name] for name in there], axis=1)
    return rigid_rotations(model, moving, np.ones(moving.shape[:2], dtype=bool))[0]


def _carried(
    stance: Places, places: Places, names: Sequence[str], turned: Array, point: Array
) -> Array:
    """(F, 3) m of a point (3,) m of the stance that moves with a group of markers."""
    there = [name for name in names if name in stance and name in places]
    middle = np.mean([stance[name] for name in there], axis=0)
    found: Array = np.mean([places[name] for name in there], axis=0) + turned @ (point - middle)
    return found


def _slices(
    spine: StandingSpine, joints: Array, bodies: Array, step_s: float
) -> Iterator[MovingPart]:
    for k, part in enumerate(spine.slices):
        turn = bodies[:, k + 1]
        at = joints[:, k] + turn @ (part.com - spine.joints[k])
        yield _rigid(f"slice_{part.name}", part.name, part, at, turn, step_s)


def _rigid(
    name: str, carrier: str, part: RigidPart, at: Array, turn: Array, step_s: float
) -> MovingPart:
    about = turn @ part.about_com @ np.swapaxes(turn, -1, -2)
    momentum = np.einsum("fij,fj->fi", about, angular_velocity(turn, step_s))
    return MovingPart(name, carrier, part.kg, at, momentum)


def _arms(subject: Subject, places: Places, step_s: float) -> Iterator[MovingPart]:
    """Upper arm, forearm and hand of both sides, each a straight piece."""
    shoulders = shoulder_centres(places)
    for side, letter in SIDES.items():
        elbow, knuckle = places[f"{letter}ELB"], places[f"{letter}FIN"]
        wrist = 0.5 * (places[f"{letter}WRA"] + places[f"{letter}WRB"])
        ends = ((shoulders[letter], elbow), (elbow, wrist), (wrist, knuckle))
        for segment, (start, end) in zip(ARM, ends, strict=True):
            kg = mass_kg(segment, subject.sex, subject.mass_kg)
            line = end - start
            size = np.linalg.norm(line, axis=1, keepdims=True)
            along, length = line / size, length_m(segment, subject.sex, subject.height_m)
            # markers tell both ends of a segment, but of the hand its direction alone
            reach = length if segment == "hand" else size
            across, _ = round_gyration(segment, subject.sex)
            momentum = kg * (across * length) ** 2 * np.cross(along, velocity(along, step_s))
            at = start + CENTRE[f"{segment} {subject.sex}"] * reach * along
            yield MovingPart(f"{side}_{segment}", T1, kg, at, momentum)
