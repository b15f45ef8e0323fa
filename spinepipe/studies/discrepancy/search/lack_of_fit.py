"""Lack of fit: does the generic basis explain what the model leaves, and where most.

A generic basis: what could be missing without being any known effect, joint by joint.

Loads that are polynomials and bumps of a joint's own motion, cross terms of its other motions,
terms of the neighbouring joints' motion, and readings that drift over the steps of a test or are
shifted in each test anew; in each coordinate that was read.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.linalg import block_diag
from scipy.special import logsumexp

from spinepipe.effects import PlaceSpread
from spinepipe.effects.contract import Array
from spinepipe.model import LoadCase, SpineModel
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.prediction import SolvedSpecimen, bushing_stiffness
from spinepipe.studies.discrepancy.search.projected import (
    Linearised,
    Products,
    linearised,
    products,
    taken_out,
)
from spinepipe.studies.discrepancy.search.screen import Group, summation
from spinepipe.units import COORDINATES, subtract_baseline

SIZE = 0.1
"""Prior size of a term at the largest motion, as a share of the joint's load there."""

LEAST_REACH = np.array([5e-5] * 3 + [np.deg2rad(0.2)] * 3)
"""m and rad; less motion than this has no shape."""

BUMPS, BUMP_WIDTH = (-0.6, -0.2, 0.2, 0.6), 0.25
"""Centres of Gaussian bumps and their width, in parts of the largest motion: they overlap."""


OWN = "own"
FAMILIES = {
    OWN: "load over the joint's own {coordinate}",
    "cross": "load in {coordinate} over the joint's other motions",
    "neighbour": "load in {coordinate} over that of the neighbouring joints",
    "drift": "readings of {coordinate} that drift over the steps of a test",
    "shift": "readings of {coordinate} with a shift of its own in each test",
}


@dataclass(frozen=True)
class Term:
    """One column: a family's term for a coordinate of a joint."""

    family: str
    coordinate: str
    number: int
    joint: int


@dataclass(frozen=True)
class GenericColumns:
    """Columns (T, J, 6, M) per test, in prior sizes, and what they are."""

    terms: tuple[Term, ...]
    moved: tuple[Array, ...]


def generic_columns(
    model: SpineModel,
    cases: Sequence[LoadCase],
    zeroed: bool,
    coordinates: Sequence[str],
    shifted: Sequence[str] = (),
) -> GenericColumns:
    """The generic basis of a specimen where its model stands.

    ``shifted`` : tests that may have a shift of their own; none tells how that of another test is.
    """
    solved = SolvedSpecimen(model, cases, zeroed)
    motions = solved.poses
    largest = [np.abs(q).max(axis=0) for q in motions]
    reach = np.maximum(np.max(largest, axis=0), LEAST_REACH)
    bushings = bushing_stiffness(model)
    stiffness = np.where(bushings > 0.0, bushings, 1.0)  # 1 where a joint has none
    terms: list[Term] = []
    moved: list[list[Array]] = [[] for _ in cases]
    for name in coordinates:
        at = COORDINATES.index(name)
        for family, count in _counts(len(coordinates), len(shifted)).items():
            terms += [
                Term(family, name, number, joint)
                for number in range(count)
                for joint in range(model.n_joints)
            ]
        size = SIZE * stiffness[:, at] * reach[:, at]
        loads = [_loads(motion / reach, at, coordinates) * size[:, None] for motion in motions]
        by_load = solved.by_loads(loads, at)
        for place, motion in enumerate(motions):
            ramp = np.linspace(0.0, 1.0, len(motion))[:, None]
            shift = np.tile(
                [float(cases[place].test == test) for test in shifted], (len(motion), 1)
            )
            by_step = _readings(np.hstack([ramp, shift]), SIZE * reach[:, at], at)
            moved[place].append(np.concatenate([by_load[place], by_step], axis=-1))
    stacked = [np.concatenate(columns, axis=-1) for columns in moved]
    seen = [subtract_baseline(c, zeroed) for c in stacked]
    return GenericColumns(tuple(terms), tuple(seen))


def _counts(coordinates: int, shifts: int) -> dict[str, int]:
    """Terms of each family for one coordinate, in the order of `_loads` and `_readings`.

    ``shifts``: tests that may have one.
    """
    others = coordinates - 1
    cross = 4 * others + len(list(combinations(range(others), 2)))
    of_load = {OWN: 3 + len(BUMPS), "cross": cross, "neighbour": 2}
    return of_load | {"drift": 1, "shift": shifts}


def _loads(u: Array, at: int, coordinates: Sequence[str]) -> Array:
    """(T, J, K) terms of relative motion u (T, J, 6) that load one coordinate."""
    own = u[..., at]
    found = [own**2, own**3, own * np.abs(own)]
    found += [np.exp(-(((own - b) / BUMP_WIDTH) ** 2)) for b in BUMPS]
    others = [COORDINATES.index(n) for n in coordinates if COORDINATES.index(n) != at]
    for other in others:
        x = u[..., other]
        found += [x, x**2, x * own, x**2 * own]
    found += [u[..., a] * u[..., b] for a, b in combinations(others, 2)]
    # motion of the neighbours, nothing beyond the ends of the chain
    above, below = np.zeros_like(own), np.zeros_like(own)
    above[:, :-1], below[:, 1:] = own[:, 1:], own[:, :-1]
    return np.stack([*found, above, below], axis=-1)


def _readings(by_step: Array, size: Array, at: int) -> Array:
    """(T, J, 6, K x J) readings that follow the steps as in (T, K), a joint each, terms first."""
    steps, count = by_step.shape
    joints = len(size)
    found = np.zeros((steps, joints, 6, count, joints))
    for joint in range(joints):
        found[:, joint, at, :, joint] = by_step * size[joint]
    return found.reshape(steps, joints, 6, count * joints)


SPREADS = (PlaceSpread.SHARED, PlaceSpread.BY_JOINT, PlaceSpread.EACH)


@dataclass(frozen=True)
class LackOfFitTest:
    """What speaks for some terms of the generic basis; averaged over families and ways to differ.

    Attributes
    ----------
    family, coordinate, spread : where most is explained. explained : drop of chi2 there.
    by_family : of each family alone, with its share of the whole taken off.
    """

    log_evidence: float
    family: str
    coordinate: str
    spread: PlaceSpread
    explained: float
    by_family: Mapping[str, float]

    @property
    def shape(self) -> str:
        """What is missing looks like, in words."""
        words = FAMILIES[self.family].format(coordinate=self.coordinate.replace("_", " "))
        return f"{words}, {self.spread.value}"


@dataclass(frozen=True)
class LackOfFit(LackOfFitTest):
    """The generic basis against what the fit leaves, as a whole and ``at`` each coordinate."""

    at: Mapping[str, LackOfFitTest]


@dataclass(frozen=True)
class _FamilyEvidence:
    """Of one family at one coordinate: log evidence, drop of chi2."""

    family: str
    coordinate: str
    spread: PlaceSpread
    log_evidence: float
    explained: float


def lack_of_fit(baseline: BaselineFit, coordinates: Sequence[str]) -> LackOfFit:
    """Evidence of the generic basis beside the baseline's fit."""
    terms, problem = _problem(baseline, coordinates)
    spreads = [s for s in SPREADS if not (s is PlaceSpread.EACH and len(baseline.readings) == 1)]
    families = list(dict.fromkeys(term.family for term in terms))
    parts = {
        coordinate: [
            _part(problem, terms, family, coordinate, spread)
            for family in families
            for spread in spreads
        ]
        for coordinate in coordinates
    }
    at = {coordinate: _lack(of_coordinate) for coordinate, of_coordinate in parts.items()}
    whole = _lack([part for of_coordinate in parts.values() for part in of_coordinate])
    return LackOfFit(**vars(whole), at=at)


def _lack(parts: Sequence[_FamilyEvidence]) -> LackOfFitTest:
    def averaged(some: Sequence[_FamilyEvidence]) -> float:
        return float(logsumexp([part.log_evidence for part in some]) - np.log(len(parts)))

    best = max(parts, key=lambda part: part.log_evidence)
    by_family = {
        family: averaged([part for part in parts if part.family == family])
        for family in dict.fromkeys(part.family for part in parts)
    }
    where = (best.family, best.coordinate, best.spread)
    return LackOfFitTest(averaged(parts), *where, best.explained, by_family)


def _problem(
    baseline: BaselineFit, coordinates: Sequence[str]
) -> tuple[tuple[Term, ...], Linearised]:
    parts: dict[str, Products] = {}
    terms: tuple[Term, ...] = ()
    taken = taken_out(baseline.fit)
    for name, one in baseline.readings.items():
        model = baseline.fit.models[name]
        zeroed = baseline.noise.zeroed
        shifted = () if zeroed else baseline.tests  # counted from step 0 there is none
        found = generic_columns(model, one.cases, zeroed, coordinates, shifted=shifted)
        plain = baseline.plain[name].noise_only(found.moved)
        white = baseline.setting.whitenings[name].shortened(plain)
        parts[name] = products(taken[name], white, np.sum(plain**2, axis=0))
        terms = found.terms
    return terms, linearised(parts)


def _part(
    problem: Linearised, terms: Sequence[Term], family: str, coordinate: str, spread: PlaceSpread
) -> _FamilyEvidence:
    # columns of one strength each, or of a term at all joints summed: F S' with S = onto
    chosen = [
        number
        for number, term in enumerate(terms)
        if (term.family, term.coordinate) == (family, coordinate)
    ]
    keys = [
        (terms[n].number, terms[n].joint if spread is not PlaceSpread.SHARED else 0) for n in chosen
    ]
    order = {key: number for number, key in enumerate(dict.fromkeys(keys))}
    onto = summation([order[key] for key in keys], len(order))
    grams, moments = [], []
    for part in problem.of.values():
        grams.append(onto @ part.gram[np.ix_(chosen, chosen)] @ onto.T)
        moments.append(onto @ part.moments[chosen])
    coupled = [onto @ part.shared[chosen] for part in problem.of.values()]
    # strengths of each specimen stand side by side, those of all are sums over specimens
    if spread is PlaceSpread.EACH:
        gram, moment, shared = block_diag(*grams), np.concatenate(moments), np.concatenate(coupled)
    else:
        gram, moment, shared = (np.sum(parts, axis=0) for parts in (grams, moments, coupled))
    gram, moment = problem.without_shared(gram, moment, shared)
    group = Group.of(gram, np.zeros(len(gram)))
    estimate = group.estimate(moment)
    explained = float(2.0 * estimate @ moment - estimate @ gram @ estimate)
    log_evidence = float(group.log_evidence(moment))
    return _FamilyEvidence(family, coordinate, spread, log_evidence, explained)
