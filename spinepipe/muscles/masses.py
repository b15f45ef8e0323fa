"""Where every kilogram of a person goes: slices of the trunk, head, arms, and what the hands hold.

Slices of the trunk hang on T1 to L5: their share of body mass grows from 1.1 % at T1 to 2.6 % at
L5, their centres lie up to 5 cm ahead of the vertebrae, most in the lower thorax; how share and
distance run between the printed values is a straight line here. Sources: `facts.csv`.
"""

from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import numpy as np

from spinepipe.anatomy.segments import CENTRE, MASS_PERCENT, Sex, mass_kg
from spinepipe.effects.contract import Array
from spinepipe.facts import numbers
from spinepipe.frames import rotation_zxy
from spinepipe.muscles.subject import REFERENCE, Subject
from spinepipe.muscles.task import Hands
from spinepipe.muscles.trunk import SIDES, SLICES, THORAX, Mass, Trunk, body_of
from spinepipe.units import STANDARD_GRAVITY

SLICE_PERCENT = numbers(__name__, "slice_mass_percent")
"""Share of body mass of the slices at T1 and at L5."""

AHEAD_AT = numbers(__name__, "slice_ahead")
"""How far slices lie ahead of the vertebrae, cm: straight between these, 1 cm below L3L4."""

HALF_GRIP_M = 0.15
"""How far each hand is from the middle of a load that both hold: a choice, a crate 30 cm wide."""

FARTHEST_LEAN_DEG = 90
"""How far a trunk is tried to lean further for what is out of reach."""

_ROUNDING_M = 1e-9

ARM_LENGTH_PERCENT = numbers(__name__, "arm_length_percent")
"""Lengths of the segments of an arm, shoulder to fingertip, of body height; only ratios count."""

ARM = tuple(ARM_LENGTH_PERCENT)


@dataclass(frozen=True, eq=False)
class Load:
    """A force that is where it is, not where a body takes it.

    Attributes
    ----------
    name : right_forearm, left_hand_load, ...
    body : index into BODIES of the body that holds it.
    force, at : (3,) N and (3,) m, ground axes, in the posture of the moment.
    """

    name: str
    body: int
    force: Array
    at: Array


@dataclass(frozen=True)
class MassShare:
    """A part of the body: its share of body mass in per cent, and whether the trunk carries it."""

    part: str
    percent: float
    carried: bool


def masses_of(trunk: Trunk, subject: Subject, ahead_times: float = 1.0) -> tuple[Mass, ...]:
    """Slices and head, which move with their bodies; arms and hands are `arm_loads`.

    Parameters
    ----------
    trunk : the subject's own, at the subject's size.
    ahead_times : factor of how far slices lie ahead of the vertebrae.
    """
    tall = subject.height_m / REFERENCE.height_m
    slices = zip(SLICES, slice_percents(), trunk.vertebrae, ahead_cm(), strict=True)
    head_kg = mass_kg("head", subject.sex, subject.mass_kg)
    return (
        *(
            Mass(
                f"slice_{name}",
                body_of(name),
                percent / 100.0 * subject.mass_kg,
                centre + np.array([ahead_times * tall * ahead / 100.0, 0.0, 0.0]),
            )
            for name, percent, centre, ahead in slices
        ),
        Mass("head", THORAX, head_kg, trunk.head),
    )


def slice_percents() -> tuple[float, ...]:
    """Share of body mass of each slice, T1 to L5, per cent."""
    return tuple(np.linspace(SLICE_PERCENT["T1"], SLICE_PERCENT["L5"], len(SLICES)).tolist())


def ahead_cm() -> tuple[float, ...]:
    """How far each slice lies ahead of its vertebra, T1 to L5, cm at the reference height."""
    # a level lies half way between its two vertebrae
    places = {name: float(k) for k, name in enumerate(SLICES)}
    places |= {"".join(pair): k + 0.5 for k, pair in enumerate(pairwise(SLICES))}
    at = [places[name] for name in AHEAD_AT]
    return tuple(np.interp(range(len(SLICES)), at, list(AHEAD_AT.values())).tolist())


def shares(subject: Subject) -> tuple[MassShare, ...]:
    """Where 100 % of the body is; what the trunk does not carry is what is left."""
    sex = subject.sex
    arms = ((f"both {s.replace('_', ' ')}s", 2.0 * MASS_PERCENT[f"{s} {sex}"]) for s in ARM)
    carried = (
        ("slices T1 to L5", float(sum(slice_percents()))),
        ("head and neck", MASS_PERCENT[f"head {sex}"]),
        *arms,
    )
    left = 100.0 - sum(percent for _, percent in carried)
    return (
        *(MassShare(part, percent, True) for part, percent in carried),
        MassShare("pelvis and legs (what is left)", left, False),
    )


def arm_loads(
    subject: Subject, shoulders: Array, hands: Hands, arm_length: float
) -> tuple[Load, ...]:
    """Weights of the arms and of what the hands hold.

    A hand that holds nothing while the other carries hangs below its shoulder, and so do both
    where no place is given. A load in both hands lies half and half, `HALF_GRIP_M` to each side of
    its middle.

    Parameters
    ----------
    shoulders : (2, 3) m, right and left, in the posture of the moment.
    hands : where they are and what they hold, ground axes from L5S1.
    arm_length : m, shoulder to the middle of the hand.

    Raises
    ------
    ValueError
        If a hand is farther from its shoulder than the arm is long: by how much, and how far the
        trunk would have to lean.
    """
    carried: list[Mass] = []
    places = _places(shoulders, hands, arm_length)
    beyond = _beyond(shoulders, places, arm_length)
    if max(beyond) > 0.0:
        side = SIDES[int(np.argmax(beyond))]
        raise ValueError(
            f"the {side} hand is {1e3 * max(beyond):.0f} mm farther from the shoulder than the arm "
            f"is long ({1e3 * arm_length:.0f} mm); {_what_reaches(shoulders, hands, arm_length)}"
        )
    for side, shoulder, hand in zip(SIDES, shoulders, places, strict=True):
        carried += arm_masses(side, shoulder, hand, subject)
        if hands.kg > 0.0 and hands.holding in ("both", side):
            kg = hands.kg * (0.5 if hands.holding == "both" else 1.0)
            carried.append(Mass(f"{side}_hand_load", THORAX, kg, hand))
    return tuple(
        Load(mass.name, mass.body, mass.kg * STANDARD_GRAVITY, mass.at) for mass in carried
    )


def arm_masses(side: str, shoulder: Array, hand: Array, subject: Subject) -> tuple[Mass, ...]:
    """An arm's segments on the straight line from shoulder to hand, where they stand, m.

    A bent arm is taken as a shorter straight one: each centre keeps its share of the line.
    """
    return tuple(
        Mass(
            f"{side}_{segment}",
            THORAX,
            mass_kg(segment, subject.sex, subject.mass_kg),
            shoulder + share * (hand - shoulder),
        )
        for segment, share in zip(ARM, centre_shares(subject.sex), strict=True)
    )


@cache
def centre_shares(sex: Sex) -> tuple[float, ...]:
    """Where on the line from shoulder to hand each segment's centre lies, as a share; hand: 1."""
    starts = np.cumsum([0.0, *ARM_LENGTH_PERCENT.values()])
    centres = [
        start + CENTRE[f"{segment} {sex}"] * percent
        for start, (segment, percent) in zip(starts, ARM_LENGTH_PERCENT.items(), strict=False)
    ]
    return tuple(float(centre / centres[-1]) for centre in centres)


def _places(shoulders: Array, hands: Hands, arm_length: float) -> Array:
    """(2, 3) m, where the right and the left hand are."""
    found = shoulders - np.array([0.0, arm_length, 0.0])
    for k, side in enumerate(SIDES):
        if hands.at is not None and hands.holding in ("both", side):
            outwards = (HALF_GRIP_M, -HALF_GRIP_M)[k] if hands.holding == "both" else 0.0
            found[k] = hands.at + np.array([0.0, 0.0, outwards])
    return found


def _beyond(shoulders: Array, places: Array, arm_length: float) -> list[float]:
    """m by which each hand is too far."""
    away: list[float] = np.linalg.norm(places - shoulders, axis=1).tolist()
    return [one - arm_length if one > arm_length + _ROUNDING_M else 0.0 for one in away]


def _what_reaches(shoulders: Array, hands: Hands, arm_length: float) -> str:
    """The least further lean of the trunk about L5S1 from which both arms reach, in words."""
    for deg in range(1, FARTHEST_LEAN_DEG + 1):
        for sign, way in ((-1.0, "forwards"), (1.0, "backwards")):
            leant = shoulders @ rotation_zxy(sign * np.deg2rad(deg), 0.0, 0.0).T
            if max(_beyond(leant, _places(leant, hands, arm_length), arm_length)) <= 0.0:
                return f"a trunk that leans {deg} deg further {way} would reach"
    return "no lean of the trunk would reach: bring the load nearer"
