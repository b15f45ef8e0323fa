"""Terms of a joint law in SI: what a formula for a missing effect is put together from.

Each is a load that holds one coordinate of a joint: a power of its own motion, a product with the
joint's other motions, the motion of a neighbour, its rate where tests record time, the way it
moves, compression; or a reading that drifts. Evaluated where the model stands.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.model import LoadCase, SpineModel
from spinepipe.studies.discrepancy.search.hypothesis import Variant
from spinepipe.studies.discrepancy.search.prediction import SolvedSpecimen
from spinepipe.units import COORDINATES, DEG_PER_RAD, MM_PER_M, TRANSLATIONS, subtract_baseline

SUPERIOR = COORDINATES.index("superior")

AT_REST = 0.01
"""Share of the largest step below which a joint is said to move neither way."""

LOAD, READING = "load", "reading"


@dataclass(frozen=True)
class LawTerm:
    """One term for one coordinate of a joint; the joint is told apart.

    Attributes
    ----------
    coordinate : that it acts on. acts : load or reading. words : what multiplies the coefficient.
    powers : of m, rad, s and N in what multiplies it. of, signed : as of the effect `power_term`;
        none where that cannot say it.
    """

    coordinate: str
    acts: str
    words: str
    powers: tuple[int, int, int, int]
    of: tuple[str, ...] = ()
    signed: bool = False

    @property
    def variant(self) -> Variant | None:
        """The effect that the term is; None where it is none."""
        if not self.of:
            return None
        options = (("coordinate", self.coordinate), ("of", self.of), ("signed", self.signed))
        return Variant("power_term", options)

    @property
    def unit(self) -> str:
        """Of the coefficient in tables: N m or N, by rad, mm, s and N."""
        if self.acts == READING:
            return f"{'mm' if self.coordinate in TRANSLATIONS else 'deg'} per test"
        above = "N" if self.coordinate in TRANSLATIONS else "N m"
        below = [
            f"{name}^{power}" if power > 1 else name
            for name, power in zip(("mm", "rad", "s", "N"), self.powers, strict=True)
            if power > 0
        ]
        above += " s" * (self.powers[2] < 0)
        if not below:
            return above
        return f"{above}/{below[0]}" if len(below) == 1 else f"{above}/({' '.join(below)})"

    @property
    def display_per_si(self) -> float:
        """What one SI unit of the coefficient is in that unit."""
        if self.acts == READING:
            return MM_PER_M if self.coordinate in TRANSLATIONS else DEG_PER_RAD
        return float(MM_PER_M ** -self.powers[0])


Valued = tuple[LawTerm, Array]
"""A term and its values (T, J)."""


@dataclass(frozen=True)
class TermColumns:
    """Columns (T, J, 6, M x J) per test by coefficients of one SI unit, terms first, then joints.

    Attributes
    ----------
    sizes : (M, J) coefficient at which a term loads a joint as much as its springs do at most.
    """

    terms: tuple[LawTerm, ...]
    moved: tuple[Array, ...]
    sizes: Array


@dataclass(frozen=True)
class _TestState:
    """A test where the model stands: q (T, J, 6), its rate or None, its way, the joints' loads."""

    q: Array
    rate: Array | None
    way: Array
    load: Array


def term_columns(
    model: SpineModel,
    cases: Sequence[LoadCase],
    zeroed: bool,
    coordinates: Sequence[str],
    timed: bool,
    stiffness: Array,
) -> TermColumns:
    """All terms of a specimen.

    Parameters
    ----------
    timed : whether rates are terms; all tests then record time. stiffness : (J, 6) SI.

    Raises
    ------
    NoEquilibrium
        When a load step has no stable pose.
    """
    solved = SolvedSpecimen(model, cases, zeroed)
    states = _states(solved, timed)
    reach = np.max([np.abs(s.q).max(axis=0) for s in states], axis=0)
    terms: list[LawTerm] = []
    sizes: list[Array] = []
    moved: list[list[Array]] = [[] for _ in cases]
    for name in coordinates:
        at = COORDINATES.index(name)
        found = [list(_of(state, name, coordinates)) for state in states]
        own = [term for term, _ in found[0]]
        loads = [np.stack([values for _, values in test], axis=-1) for test in found]
        strongest = np.max([np.abs(one).max(axis=0) for one in loads], axis=0)  # (J, K)
        # a term that is nought everywhere has no size: springs over infinity
        springs = (stiffness[:, at] * reach[:, at])[:, None]
        sizes.append((springs / np.where(strongest > 0.0, strongest, np.inf)).T)
        terms += own
        for place, by_load in enumerate(solved.by_loads(loads, at)):
            moved[place].append(subtract_baseline(by_load, zeroed))
    for name in coordinates:
        at = COORDINATES.index(name)
        terms.append(LawTerm(name, READING, "step / last step", (0, 0, 0, 0)))
        sizes.append(reach[None, :, at])
        for place, state in enumerate(states):
            moved[place].append(subtract_baseline(_drift(state.q.shape, at), zeroed))
    columns = tuple(np.concatenate(of_test, axis=-1) for of_test in moved)
    return TermColumns(tuple(terms), columns, np.concatenate(sizes))


def _states(solved: SolvedSpecimen, timed: bool) -> list[_TestState]:
    found = []
    for q, load, case in zip(solved.poses, solved.held, solved.cases, strict=True):
        steps = np.diff(q, axis=0, prepend=q[:1])
        rate = None
        if timed:
            times = np.array([step.time for step in case.steps], dtype=float)
            # backward differences; the first step is at rest, whatever time it is given
            rate = steps / np.diff(times, prepend=times[0] - 1.0)[:, None, None]
        least = AT_REST * np.abs(steps).max(axis=0)
        way = np.where(np.abs(steps) > least, np.sign(steps), 0.0)
        found.append(_TestState(q, rate, way, load))
    return found


def tell_time(cases: Sequence[LoadCase]) -> bool:
    """Whether all tests record time, and it goes on."""
    times = [[step.time for step in case.steps] for case in cases]
    if any(time is None for of_test in times for time in of_test):
        return False
    return all(np.all(np.diff(np.array(of_test, dtype=float)) > 0.0) for of_test in times)


def _of(state: _TestState, name: str, coordinates: Sequence[str]) -> Iterator[Valued]:
    """Each term for a coordinate, and its values (T, J)."""
    yield from _powers(state.q, name, coordinates)
    own = state.q[..., COORDINATES.index(name)]
    word = name.replace("_", " ")

    def term(words: str, values: Array, moved: int = 0, s: int = 0, n: int = 0) -> Valued:
        powers = (moved, 0, s, n) if name in TRANSLATIONS else (0, moved, s, n)
        return LawTerm(name, LOAD, words, powers), values

    above, below = np.zeros_like(own), np.zeros_like(own)
    above[:, :-1], below[:, 1:] = own[:, 1:], own[:, :-1]
    if own.shape[1] > 1:
        yield term(f"{word} of the joint above", above, moved=1)
        yield term(f"{word} of the joint below", below, moved=1)
    if state.rate is not None:
        yield term(f"rate of {word}", state.rate[..., COORDINATES.index(name)], moved=1, s=-1)
    yield term(f"way of {word} (+1, 0, -1)", state.way[..., COORDINATES.index(name)])
    if name != "superior":
        compression = -state.load[..., SUPERIOR]
        yield term("compression", compression, n=1)
        yield term(f"compression x {word}", compression * own, moved=1, n=1)


def _powers(q: Array, name: str, coordinates: Sequence[str]) -> Iterator[Valued]:
    """The terms that the effect `power_term` says, at motion q (T, J, 6)."""
    own = q[..., COORDINATES.index(name)]
    word = name.replace("_", " ")

    def term(words: str, values: Array, *of: str, signed: bool = False) -> Valued:
        shifts = sum(one in TRANSLATIONS for one in of)
        powers = (shifts, len(of) - shifts, 0, 0)
        return LawTerm(name, LOAD, words, powers, of, signed), values

    yield term(word, own, name)
    yield term(f"{word}^2", own**2, name, name)
    yield term(f"{word}^3", own**3, name, name, name)
    yield term(f"{word} |{word}|", own * np.abs(own), name, name, signed=True)
    others = [one for one in coordinates if one != name]
    for one in others:
        x, said = q[..., COORDINATES.index(one)], one.replace("_", " ")
        yield term(said, x, one)
        yield term(f"{said}^2", x**2, one, one)
        yield term(f"{said} x {word}", x * own, one, name)
        yield term(f"{said}^2 x {word}", x**2 * own, one, one, name)
    for a, b in combinations(others, 2):
        x, y = (q[..., COORDINATES.index(one)] for one in (a, b))
        yield term(f"{a} x {b}".replace("_", " "), x * y, a, b)


def _drift(shape: tuple[int, ...], at: int) -> Array:
    """(T, J, 6, J) readings that move on with the steps, a joint each."""
    steps, joints = shape[:2]
    drift = np.zeros((steps, joints, 6, joints))
    every = np.arange(joints)
    drift[:, every, at, every] = (np.arange(steps) / max(steps - 1, 1))[:, None]
    return drift
