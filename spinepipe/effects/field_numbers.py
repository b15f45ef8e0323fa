"""Numbers of the field from a joint's laws: stiffness, zone, break, loop area, drift.

All are read off the curve of load over one coordinate of one joint, the others at rest, as a tester
reads them off a measured one. No parameter's name is asked: laws of other formulas that hold the
same loads have the same numbers.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.integrate import simpson
from scipy.optimize import brentq

from spinepipe.effects.contract import Array, Effect, JointLaw, PathLaw
from spinepipe.units import COORDINATES, TRANSLATIONS

Law = tuple[Effect, Array]
"""A law and its parameters (P,) at the joint, in the order of the model."""

LOAD_NM, LOAD_N = 5.0, 50.0
"""Load at which stiffness is told: of rotations, and of translations."""

FROM_S, TO_S = 60.0, 600.0
"""A decade of time over which drift is told."""

UNLIKE = 0.1
"""Share by which stiffness must change up to the load, for a break to be told."""

_FURTHEST_RAD, _FURTHEST_M = 1.5, 0.1
_HALVINGS = 60
_LARGEST = 1e6
_POINTS = 2001
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
    joint = _Joint(laws, coordinate)
    at = load or (LOAD_N if coordinate in TRANSLATIONS else LOAD_NM)
    rest = joint.slope(0.0)
    ends = (joint.motion(-at), joint.motion(at))
    slopes = tuple(None if end is None else joint.slope(end) for end in ends)
    breaks = tuple(
        None if end is None or slope is None else _break(joint, end, rest, slope)
        for end, slope in zip(ends, slopes, strict=True)
    )
    softer = all(slope is not None and slope > rest for slope in slopes)
    zone = breaks[1] - breaks[0] if softer and None not in breaks else None  # type: ignore[operator]
    return FieldNumbers(
        at,
        rest,
        (slopes[0], slopes[1]),
        ends,
        (breaks[0], breaks[1]),
        zone,
        joint.loop_area(ends),
        joint.drift(at, ends[1]),
    )


def _break(joint: "_Joint", end: float, rest: float, slope: float) -> float | None:
    """The first place where the slope is half way between that at rest and that at the end."""
    if abs(slope - rest) < UNLIKE * max(abs(slope), abs(rest)):
        return None
    way = np.linspace(0.0, end, _POINTS)
    beyond = (joint.slopes(way) - 0.5 * (rest + slope)) * np.sign(slope - rest) >= 0.0
    if not beyond.any():
        return None
    last = max(int(np.argmax(beyond)), 1)

    def past(q: float) -> bool:
        return bool((joint.slope(q) - 0.5 * (rest + slope)) * np.sign(slope - rest) >= 0.0)

    return _halved(past, float(way[last - 1]), float(way[last]))


def _halved(past: Callable[[float], bool], low: float, high: float) -> float:
    """Where ``past`` turns true between two places."""
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if past(middle) else (middle, high)
    return 0.5 * (low + high)


class _Joint:
    """One joint moved along one coordinate."""

    def __init__(self, laws: Sequence[Law], coordinate: str) -> None:
        self.laws = [(effect, np.asarray(values)[None]) for effect, values in laws]
        self.at = COORDINATES.index(coordinate)
        self.furthest = _FURTHEST_M if coordinate in TRANSLATIONS else _FURTHEST_RAD

    def loads(self, q: Array) -> tuple[Array, Array]:
        """Loads (n,) at motions (n,), and slopes; of the laws without a memory."""
        place = self._place(q)
        load, tangent = np.zeros_like(place), np.zeros((*place.shape, 6))
        for effect, values in self.laws:
            if isinstance(effect, JointLaw):
                own = effect.respond(place, np.repeat(values, len(q), axis=0), load)
                if own.by_carried is not None:
                    tangent = tangent + own.by_carried @ tangent
                load, tangent = load + own.load, tangent + own.tangent
        return load[:, self.at], tangent[:, self.at, self.at]

    def slopes(self, q: Array) -> Array:
        """(n,)"""
        return self.loads(q)[1]

    def slope(self, q: float) -> float:
        """Tangent stiffness at a motion."""
        return float(self.slopes(np.array([q]))[0])

    def motion(self, load: float) -> float | None:
        """Where the joint holds a load; None where it does nowhere within reach."""
        return self._motion(lambda q: float(self.loads(np.array([q]))[0][0]), load)

    def _motion(self, held: Callable[[float], float], load: float) -> float | None:
        end = float(np.copysign(self.furthest, load))

        def left(q: float) -> float:
            """What is still to be held, in loads; where there is no pose, more than all is."""
            share = held(q) / load
            return float(np.clip(share, -_LARGEST, _LARGEST)) - 1.0

        if left(end) < 0.0 or left(0.0) > 0.0:
            return None
        return float(brentq(left, 0.0, end, xtol=1e-12 * self.furthest))

    def loop_area(self, ends: tuple[float | None, float | None]) -> float | None:
        """Work lost in the last of some cycles between two motions, at once; None without loops."""
        if not self._remembers or ends[0] is None or ends[1] is None:
            return None
        up = np.linspace(ends[0], ends[1], _STEPS + 1)
        first = np.linspace(0.0, ends[0], _STEPS + 1)[1:]
        way = np.concatenate([first, *[branch[1:] for branch in (up, up[::-1])] * _CYCLES])
        held = self._along(way, np.zeros(len(way)))
        rising, falling = held[-2 * _STEPS - 1 : -_STEPS], held[-_STEPS - 1 :]
        area = float(simpson(rising, x=up) + simpson(falling, x=up[::-1]))
        return area if area > 1e-9 * np.ptp(held) * np.ptp(way) else None

    def drift(self, load: float, at_once: float | None) -> float | None:
        """Motion of the decade under a constant load over that at once; None without drift."""
        if not self._remembers or at_once is None:
            return None

        def after(seconds: float) -> float | None:
            """The load comes at once and then stays: the motion there is what holds it."""
            first = self._motion(lambda q: float(self._along(np.array([q]), np.zeros(1))[-1]), load)
            if first is None:
                return None
            return self._motion(
                lambda q: float(self._along(np.array([first, q]), np.array([0.0, seconds]))[-1]),
                load,
            )

        start, begun, ended = after(0.0), after(FROM_S), after(TO_S)
        if start is None or begun is None or ended is None:
            return None
        drift = (ended - begun) / start
        return drift if abs(drift) > 1e-9 else None

    @property
    def _remembers(self) -> bool:
        return any(isinstance(effect, PathLaw) for effect, _ in self.laws)

    def _along(self, way: Array, seconds: Array) -> Array:
        """(n,) loads of all laws on a way of motions, each reached in so many seconds."""
        states = [
            np.zeros((1, effect.n_states)) if isinstance(effect, PathLaw) else np.zeros((1, 0))
            for effect, _ in self.laws
        ]
        found = np.zeros(len(way))
        for number, (place, time) in enumerate(zip(self._place(way), seconds, strict=True)):
            load = np.zeros((1, 6))
            for index, (effect, values) in enumerate(self.laws):
                if isinstance(effect, PathLaw):
                    step = (place[None], values, states[index], float(time), load)
                    own = effect.respond_on_path(*step)
                    states[index] = effect.advance(*step).state
                elif isinstance(effect, JointLaw):
                    own = effect.respond(place[None], values, load)
                else:
                    continue
                load = load + own.load
            found[number] = load[0, self.at]
        return found

    def _place(self, q: Array) -> Array:
        """(n, 6)"""
        place = np.zeros((len(q), 6))
        place[:, self.at] = q
        return place
