"""Numbers of the field from a joint's laws: stiffness, zone, break, loop area, drift.

All are read off the curve of load over one coordinate of one joint, the others at rest, as a tester
reads them off a measured one. No parameter's name is asked: laws of other formulas that hold the
same loads have the same numbers.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import simpson

from spinepipe.effects.contract import Array, Effect, JointLaw, PathLaw
from spinepipe.units import COORDINATES, TRANSLATIONS

Law = tuple[Effect, Array]
"""A law and its parameters (P,) at the joint, in the order of the model; (R, P) of many joints."""

NUMBERS = (
    "stiffness_at_zero",
    *("stiffness_at_minus", "stiffness_at_plus", "motion_at_minus", "motion_at_plus"),
    *("break_minus", "break_plus", "zone", "loop_area", "drift_per_decade"),
)
"""What `numbers_of` tells; minus and plus are the sides of -load and +load."""

LOAD_NM, LOAD_N = 5.0, 50.0
"""Load at which stiffness is told: of rotations, and of translations."""

FROM_S, TO_S = 60.0, 600.0
"""A decade of time over which drift is told."""

UNLIKE = 0.1
"""Share by which stiffness must change up to the load, for a break to be told."""

_FURTHEST_RAD, _FURTHEST_M = 1.5, 0.1
_HALVINGS = 60
_POINTS = 1001
_AT_ONCE = 64
"""Joints whose curves are held in memory together."""

_CYCLES = 2
_STEPS = 100
"""Of a branch; friction rounds the start of each step, so that more of them are not better."""


@dataclass(frozen=True)
class FieldNumbers:
    """What a tester reads off a joint's curve; SI, None where there is nothing of the kind.

    Attributes
    ----------
    load : N m or N, at which what follows is told.
    stiffness_at_zero : slope at rest. stiffness_at_load : slope at -load and at +load.
    motion_at_load : rad or m at -load and at +load.
    breaks : motion at which the slope is half way from that at rest to that at -load, and +load.
    zone : distance of the breaks, where the joint is softer at rest than at both loads.
    loop_area : J (per rad or m), between the branches of a cycle from -load to +load.
    drift_per_decade : motion from 1 to 10 minutes under +load over the motion at once.
    """

    load: float
    stiffness_at_zero: float
    stiffness_at_load: tuple[float | None, float | None]
    motion_at_load: tuple[float | None, float | None]
    breaks: tuple[float | None, float | None]
    zone: float | None
    loop_area: float | None
    drift_per_decade: float | None


def field_numbers(laws: Sequence[Law], coordinate: str, load: float | None = None) -> FieldNumbers:
    """Numbers of a joint with these laws, its springs among them, on one coordinate.

    Parameters
    ----------
    load : N m or N; `LOAD_NM` or `LOAD_N` by default.
    """
    at = load or usual_load(coordinate)
    found = numbers_of([(effect, np.asarray(own)[None]) for effect, own in laws], coordinate, at)
    told = {name: float(of[0]) if np.isfinite(of[0]) else None for name, of in found.items()}
    rest = told["stiffness_at_zero"]
    assert rest is not None
    return FieldNumbers(
        at,
        rest,
        (told["stiffness_at_minus"], told["stiffness_at_plus"]),
        (told["motion_at_minus"], told["motion_at_plus"]),
        (told["break_minus"], told["break_plus"]),
        told["zone"],
        told["loop_area"],
        told["drift_per_decade"],
    )


def usual_load(coordinate: str) -> float:
    """Load at which stiffness is told, N m or N."""
    return LOAD_N if coordinate in TRANSLATIONS else LOAD_NM


def numbers_of(laws: Sequence[Law], coordinate: str, load: float) -> dict[str, Array]:
    """The same of R joints with the same laws and parameters (R, P) of their own.

    Returns
    -------
    By `NUMBERS`, (R,) SI as `FieldNumbers` has them; NaN where there is nothing of the kind.
    """
    count = len(laws[0][1])
    parts = [
        _some([(effect, own[first : first + _AT_ONCE]) for effect, own in laws], coordinate, load)
        for first in range(0, count, _AT_ONCE)
    ]
    return {name: np.concatenate([part[name] for part in parts]) for name in NUMBERS}


def load_over(laws: Sequence[Law], coordinate: str, along: str, motions: Array) -> Array:
    """(n,) N m or N on a coordinate of a joint moved along a coordinate, m or rad, to motions (n,).

    The others are at rest; laws that remember a path are at the start of it.
    """
    place = np.zeros((len(motions), 6))
    place[:, COORDINATES.index(along)] = motions
    load = np.zeros_like(place)
    for effect, values in laws:
        rows = np.repeat(np.asarray(values)[None], len(motions), axis=0)
        if isinstance(effect, PathLaw):
            state = np.zeros((len(motions), effect.n_states))
            load = load + effect.respond_on_path(place, rows, state, 0.0, load).load
        elif isinstance(effect, JointLaw):
            load = load + effect.respond(place, rows, load).load
    return load[:, COORDINATES.index(coordinate)]


def _some(laws: Sequence[Law], coordinate: str, load: float) -> dict[str, Array]:
    joints = _Joints(laws, coordinate)
    rest = joints.slopes(np.zeros((joints.count, 1)))[:, 0]
    low, high = joints.motion(-load), joints.motion(load)
    slopes = [joints.slopes(end[:, None])[:, 0] for end in (low, high)]
    breaks = [
        _breaks(joints, end, rest, slope) for end, slope in zip((low, high), slopes, strict=True)
    ]
    softer = (slopes[0] > rest) & (slopes[1] > rest)
    zone = np.where(softer, breaks[1] - breaks[0], np.nan)
    area, drift = joints.loop_areas(low, high), joints.drifts(load, high)
    told = (rest, *slopes, low, high, *breaks, zone, area, drift)
    return dict(zip(NUMBERS, told, strict=True))


def _breaks(joints: "_Joints", end: Array, rest: Array, slope: Array) -> Array:
    """The first place where the slope is half way between that at rest and that at the end."""
    way = end[:, None] * np.linspace(0.0, 1.0, _POINTS)
    half, sign = 0.5 * (rest + slope)[:, None], np.sign(slope - rest)[:, None]

    def past(q: Array) -> NDArray[np.bool_]:
        return (joints.slopes(q) - half) * sign >= 0.0

    beyond = past(way)
    like = np.abs(slope - rest) < UNLIKE * np.maximum(np.abs(slope), np.abs(rest))
    last = np.maximum(np.argmax(beyond, axis=1), 1)
    rows = np.arange(len(way))
    low, high = way[rows, last - 1], way[rows, last]
    found = _halved(lambda q: past(q[:, None])[:, 0], low, high)
    return np.where(beyond.any(axis=1) & ~like, found, np.nan)


def _halved(past: Callable[[Array], NDArray[np.bool_]], low: Array, high: Array) -> Array:
    """Where ``past`` turns true between two places (R,)."""
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        there = past(middle)
        low, high = np.where(there, low, middle), np.where(there, middle, high)
    return 0.5 * (low + high)


class _Joints:
    """R joints moved along one coordinate; NaN in, NaN out."""

    def __init__(self, laws: Sequence[Law], coordinate: str) -> None:
        self.laws = [(effect, np.asarray(values)) for effect, values in laws]
        # looked up once: whether a law is a `JointLaw` is asked of all its methods, and slow
        self.without_memory = [
            (effect, values) for effect, values in self.laws if isinstance(effect, JointLaw)
        ]
        self.count = len(self.laws[0][1])
        self.at = COORDINATES.index(coordinate)
        self.furthest = _FURTHEST_M if coordinate in TRANSLATIONS else _FURTHEST_RAD

    def _loads(self, q: Array) -> tuple[Array, Array]:
        """Loads (R, n) at motions (R, n), and slopes; of the laws without a memory."""
        place = self._place(q.ravel())
        load, tangent = np.zeros_like(place), np.zeros((*place.shape, 6))
        for effect, values in self.without_memory:
            own = effect.respond(place, np.repeat(values, q.shape[1], axis=0), load)
            if own.by_carried is not None:
                tangent = tangent + own.by_carried @ tangent
            load, tangent = load + own.load, tangent + own.tangent
        held, slope = load[:, self.at], tangent[:, self.at, self.at]
        return held.reshape(q.shape), slope.reshape(q.shape)

    def slopes(self, q: Array) -> Array:
        """(R, n) tangent stiffness at motions."""
        known = np.isfinite(q)
        return np.where(known, self._loads(np.where(known, q, 0.0))[1], np.nan)

    def motion(self, load: float) -> Array:
        """(R,) where each joint holds a load; NaN where it does nowhere within reach."""
        return self._motion(lambda q: self._loads(q[:, None])[0][:, 0], load)

    def _motion(self, held: Callable[[Array], Array], load: float) -> Array:
        start, end = np.zeros(self.count), np.full(self.count, np.copysign(self.furthest, load))

        def enough(q: Array) -> NDArray[np.bool_]:
            """Where there is no pose, more than all is held."""
            return ~(held(q) / load < 1.0)

        found = _halved(enough, start, end)
        return np.where(enough(end) & ~enough(start), found, np.nan)

    def loop_areas(self, low: Array, high: Array) -> Array:
        """(R,) work lost in the last of some cycles between motions, at once; NaN without loops."""
        known = np.isfinite(low) & np.isfinite(high)
        if not self._remembers or not known.any():
            return np.full(self.count, np.nan)
        share = np.linspace(0.0, 1.0, _STEPS + 1)[:, None]
        low, high = np.where(known, low, -1e-6), np.where(known, high, 1e-6)
        first, up = share[1:] * low, low + share * (high - low)
        way = np.concatenate([first, *[branch[1:] for branch in (up, up[::-1])] * _CYCLES])
        held = self._along(way, np.zeros(len(way)))
        rising, falling = held[-2 * _STEPS - 1 : -_STEPS], held[-_STEPS - 1 :]
        area = simpson(rising, x=up, axis=0) + simpson(falling, x=up[::-1], axis=0)
        least = 1e-9 * np.ptp(held, axis=0) * np.ptp(way, axis=0)
        return np.where(known & (area > least), area, np.nan)

    def drifts(self, load: float, at_once: Array) -> Array:
        """(R,) motion of the decade under a constant load over that at once; NaN without drift."""
        if not self._remembers or not np.isfinite(at_once).any():
            return np.full(self.count, np.nan)
        first = self._motion(lambda q: self._along(q[None], np.zeros(1))[-1], load)
        at = np.where(np.isfinite(first), first, 0.0)

        def after(seconds: float) -> Array:
            """The load comes at once and then stays: the motion there is what holds it."""
            times = np.array([0.0, seconds])
            return self._motion(lambda q: self._along(np.stack([at, q]), times)[-1], load)

        start, begun, ended = after(0.0), after(FROM_S), after(TO_S)
        with np.errstate(divide="ignore", invalid="ignore"):
            drift = (ended - begun) / start
        told = np.isfinite(at_once) & np.isfinite(first) & (np.abs(drift) > 1e-9)
        return np.where(told, drift, np.nan)

    @property
    def _remembers(self) -> bool:
        return any(isinstance(effect, PathLaw) for effect, _ in self.laws)

    def _along(self, way: Array, seconds: Array) -> Array:
        """(n, R) loads of all laws on ways of motions (n, R), each reached in so many seconds."""
        states = [
            np.zeros((self.count, effect.n_states if isinstance(effect, PathLaw) else 0))
            for effect, _ in self.laws
        ]
        found = np.zeros(way.shape)
        for number, (motion, time) in enumerate(zip(way, seconds, strict=True)):
            place, load = self._place(motion), np.zeros((self.count, 6))
            for index, (effect, values) in enumerate(self.laws):
                if isinstance(effect, PathLaw):
                    step = (place, values, states[index], float(time), load)
                    own = effect.respond_on_path(*step)
                    states[index] = effect.advance(*step).state
                elif isinstance(effect, JointLaw):
                    own = effect.respond(place, values, load)
                else:
                    continue
                load = load + own.load
            found[number] = load[:, self.at]
        return found

    def _place(self, q: Array) -> Array:
        """(n, 6)"""
        place = np.zeros((len(q), 6))
        place[:, self.at] = q
        return place
