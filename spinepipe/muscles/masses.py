"""Where every kilogram of a person goes: slices of the trunk, head, arms, and what the hands hold.

Slices of the trunk hang on T1 to L5: their share of body mass grows from 1.1 % at T1 to 2.6 % at
L5, their centres lie up to 5 cm ahead of the vertebrae, most in the lower thorax (Pearsall 1996,
abstract, four trunks; how share and distance run between the printed values is a straight line
here). Together 31.45 %; another generic male model has 32.1 %. Head and arms are those of de Leva
1996.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import Literal

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.model import STANDARD_GRAVITY
from spinepipe.muscles.subject import REFERENCE, Subject
from spinepipe.muscles.task import Hands
from spinepipe.muscles.trunk import SIDES, SLICES, THORAX, Mass, Trunk, body_of

SLICE_PERCENT = (1.1, 2.6)
"""Share of body mass of the slices at T1 and at L5."""

AHEAD_AT = {"T1": 0.0, "T7T8": 4.0, "T11": 5.0, "L3L4": 1.0}
"""How far slices lie ahead of the vertebrae, cm: straight between these, 1 cm below L3L4."""

HEAD_PERCENT = {"male": 6.94, "female": 6.68}
"""Head and neck, de Leva 1996."""

HALF_GRIP_M = 0.15
"""How far each hand is from the middle of a load that both hold: a choice, a crate 30 cm wide."""


@dataclass(frozen=True)
class Segment:
    """A segment of the arm.

    Attributes
    ----------
    name : upper_arm, forearm, hand.
    percent : of body mass, one side, by sex (de Leva 1996).
    centre : share of the segment's length from its upper end, by sex (de Leva 1996).
    length_percent : of body height (Drillis and Contini 1966, from memory; only the ratios count).
    """

    name: str
    percent: dict[Literal["male", "female"], float]
    centre: dict[Literal["male", "female"], float]
    length_percent: float


ARM = (
    Segment("upper_arm", {"male": 2.71, "female": 2.55}, {"male": 0.5772, "female": 0.5754}, 18.6),
    Segment("forearm", {"male": 1.62, "female": 1.38}, {"male": 0.4574, "female": 0.4559}, 14.6),
    Segment("hand", {"male": 0.61, "female": 0.56}, {"male": 0.3624, "female": 0.3427}, 10.8),
)
"""Shoulder to fingertip; the hand's centre is counted along wrist to tip of the third finger."""


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
class Share:
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
        Mass("head", THORAX, HEAD_PERCENT[subject.sex] / 100.0 * subject.mass_kg, trunk.head),
    )


def slice_percents() -> tuple[float, ...]:
    """Share of body mass of each slice, T1 to L5, per cent."""
    return tuple(np.linspace(*SLICE_PERCENT, len(SLICES)).tolist())


def ahead_cm() -> tuple[float, ...]:
    """How far each slice lies ahead of its vertebra, T1 to L5, cm at the reference height."""
    at = [_position(name) for name in AHEAD_AT]
    return tuple(np.interp(range(len(SLICES)), at, list(AHEAD_AT.values())).tolist())


def _position(name: str) -> float:
    """Place in `SLICES` of a vertebra, or half way between the two of a level."""
    if name in SLICES:
        return float(SLICES.index(name))
    return next(k + 0.5 for k, pair in enumerate(pairwise(SLICES)) if "".join(pair) == name)


def shares(subject: Subject) -> tuple[Share, ...]:
    """Where 100 % of the body is; what the trunk does not carry is what is left."""
    sex = subject.sex
    arms = ((f"both {s.name.replace('_', ' ')}s", 2.0 * s.percent[sex]) for s in ARM)
    carried = (
        ("slices T1 to L5", float(sum(slice_percents()))),
        ("head and neck", HEAD_PERCENT[sex]),
        *arms,
    )
    left = 100.0 - sum(percent for _, percent in carried)
    return (
        *(Share(part, percent, True) for part, percent in carried),
        Share("pelvis and legs (what is left)", left, False),
    )


@dataclass(frozen=True)
class CentreCheck:
    """How far ahead of a level a part of the trunk has its centre: here and as published, cm."""

    part: str
    level: str
    here_cm: float
    published_cm: float


_PEARSALL = (("upper trunk", 0.0, 18.5, "T7T8", 4.0), ("middle trunk", 18.5, 30.7, "L3L4", 1.0))
"""Part, where it begins and ends in per cent of body mass from the top, level, cm ahead of it."""


def centre_checks(trunk: Trunk) -> tuple[CentreCheck, ...]:
    """Centres of parts of a trunk of reference size beside those that Pearsall 1996 prints.

    Its parts are 18.5, 12.2 and 10.7 % of body mass; the lowest reaches below L5, so that of the
    whole trunk the slices hold three quarters. Parts are cut off by mass, from T1 downwards.
    """
    whole = ("trunk, T1 to L5", 0.0, float(sum(slice_percents())), "L1L2", 2.0)
    return tuple(
        CentreCheck(part, level, _ahead_of(trunk, level, low, high), published)
        for part, low, high, level, published in (*_PEARSALL, whole)
    )


def _ahead_of(trunk: Trunk, level: str, low: float, high: float) -> float:
    """Centre of the slices from low to high per cent, ahead of the middle of a level, cm."""
    percents = np.array(slice_percents())
    ends = np.cumsum(percents)
    held = np.clip(np.minimum(ends, high) - np.maximum(ends - percents, low), 0.0, None)
    ahead = 100.0 * trunk.vertebrae[:, 0] + np.array(ahead_cm())
    at = np.interp(_position(level), range(len(SLICES)), 100.0 * trunk.vertebrae[:, 0])
    return float(held @ ahead / held.sum() - at)


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
        If a hand is farther from its shoulder than the arm is long.
    """
    loads: list[Load] = []
    for side, shoulder in zip(SIDES, shoulders, strict=True):
        hand = _hand(side, shoulder, hands, arm_length)
        loads += _weights(arm_masses(side, shoulder, hand, subject))
        if hands.kg > 0.0 and hands.holding in ("both", side):
            held = hands.kg * (0.5 if hands.holding == "both" else 1.0)
            loads += _weights([Mass(f"{side}_hand_load", THORAX, held, hand)])
    return tuple(loads)


def arm_masses(side: str, shoulder: Array, hand: Array, subject: Subject) -> tuple[Mass, ...]:
    """An arm's segments on the straight line from shoulder to hand, where they stand, m.

    A bent arm is taken as a shorter straight one: each centre keeps its share of the line.
    """
    return tuple(
        Mass(
            f"{side}_{segment.name}",
            THORAX,
            segment.percent[subject.sex] / 100.0 * subject.mass_kg,
            shoulder + share * (hand - shoulder),
        )
        for segment, share in zip(ARM, centre_shares(subject.sex), strict=True)
    )


@cache
def centre_shares(sex: Literal["male", "female"]) -> tuple[float, ...]:
    """Where on the line from shoulder to hand each segment's centre lies, as a share; hand: 1."""
    starts = np.cumsum([0.0, *(segment.length_percent for segment in ARM)])
    centres = [
        start + segment.centre[sex] * segment.length_percent
        for start, segment in zip(starts, ARM, strict=False)
    ]
    return tuple(float(centre / centres[-1]) for centre in centres)


def _hand(side: str, shoulder: Array, hands: Hands, arm_length: float) -> Array:
    if hands.at is None or hands.holding not in ("both", side):
        return shoulder - np.array([0.0, arm_length, 0.0])
    outwards = {"right": 1.0, "left": -1.0}[side] if hands.holding == "both" else 0.0
    hand = hands.at + np.array([0.0, 0.0, outwards * HALF_GRIP_M])
    beyond = float(np.linalg.norm(hand - shoulder)) - arm_length
    if beyond > 0.0:
        raise ValueError(
            f"the {side} hand is {1e3 * beyond:.0f} mm farther from the shoulder than the arm is "
            f"long ({1e3 * arm_length:.0f} mm)"
        )
    return hand


def _weights(masses: tuple[Mass, ...] | list[Mass]) -> Iterator[Load]:
    for mass in masses:
        yield Load(mass.name, mass.body, mass.kg * STANDARD_GRAVITY, mass.at)
