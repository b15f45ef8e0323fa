"""Lack of fit: does the generic basis explain what the model leaves, and where most."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag
from scipy.special import logsumexp

from spinepipe.discrepancy.evidence import Group
from spinepipe.discrepancy.generic import FAMILIES, Term, generic_columns
from spinepipe.discrepancy.grounds import Grounds
from spinepipe.discrepancy.projected import (
    Linearised,
    Products,
    drawn,
    linearised,
    products,
    taken_out,
)
from spinepipe.effects import Spread
from spinepipe.effects.contract import Array
from spinepipe.units import ROTATIONS

SPREADS = (Spread.SHARED, Spread.BY_JOINT, Spread.EACH)


@dataclass(frozen=True)
class LackOfFit:
    """The generic basis against what the fit leaves.

    Attributes
    ----------
    log_evidence : averaged over families, coordinates and ways to differ. null : of each draw.
    family, coordinate, spread : where most is explained. explained : drop of chi2 there.
    """

    log_evidence: float
    null: Array
    family: str
    coordinate: str
    spread: Spread
    explained: float

    @property
    def shape(self) -> str:
        """What is missing looks like, in words."""
        words = FAMILIES[self.family].format(coordinate=self.coordinate.replace("_", " "))
        return f"{words}, {self.spread.value}"


@dataclass(frozen=True)
class _Part:
    family: str
    coordinate: str
    spread: Spread
    logs: Array
    explained: float


def lack_of_fit(grounds: Grounds, coordinates: Sequence[str], draws: int, seed: int) -> LackOfFit:
    """Evidence of the generic basis beside the grounds' fit."""
    terms, problem = _problem(grounds, coordinates, draws, seed)
    parts = [
        _part(problem, terms, family, coordinate, spread)
        for coordinate in ROTATIONS
        if coordinate in coordinates
        for family in FAMILIES
        for spread in SPREADS
        if not (spread is Spread.EACH and len(grounds.readings) == 1)
    ]
    logs = logsumexp(np.stack([part.logs for part in parts]), axis=0) - np.log(len(parts))
    best = max(parts, key=lambda part: part.logs[0])
    return LackOfFit(
        float(logs[0]), logs[1:], best.family, best.coordinate, best.spread, best.explained
    )


def _problem(
    grounds: Grounds, coordinates: Sequence[str], draws: int, seed: int
) -> tuple[tuple[Term, ...], Linearised]:
    parts: dict[str, Products] = {}
    terms: tuple[Term, ...] = ()
    taken = taken_out(grounds.fit)
    for number, (name, one) in enumerate(grounds.readings.items()):
        model = grounds.fit.models[name]
        found = generic_columns(model, one.cases, grounds.noise.zeroed, coordinates)
        plain = grounds.plain[name].noise_only(found.moved)
        white = grounds.setting.whitenings[name].shortened(plain)
        errors = drawn(taken[name], draws, np.random.default_rng([seed, number]))
        parts[name] = products(taken[name], white, np.sum(plain**2, axis=0), errors)
        terms = found.terms
    return terms, linearised(parts)


def _part(
    problem: Linearised, terms: Sequence[Term], family: str, coordinate: str, spread: Spread
) -> _Part:
    chosen = [
        number for number, term in enumerate(terms)
        if (term.family, term.coordinate) == (family, coordinate)
    ]  # fmt: skip
    keys = [(terms[n].number, terms[n].joint if spread is not Spread.SHARED else 0) for n in chosen]
    order = {key: number for number, key in enumerate(dict.fromkeys(keys))}
    onto = np.zeros((len(order), len(chosen)))
    onto[[order[key] for key in keys], np.arange(len(chosen))] = 1.0
    grams, moments = [], []
    for part in problem.of.values():
        grams.append(onto @ part.gram[np.ix_(chosen, chosen)] @ onto.T)
        moments.append(onto @ part.moments[chosen])
    coupled = [onto @ part.shared[chosen] for part in problem.of.values()]
    if spread is Spread.EACH:
        gram, moment, shared = block_diag(*grams), np.concatenate(moments), np.concatenate(coupled)
    else:
        gram, moment, shared = _added(grams), _added(moments), _added(coupled)
    gram, moment = problem.without_shared(gram, moment, shared)
    group = Group.of(gram, np.zeros(len(gram)))
    estimate = group.estimate(moment[:, 0])
    explained = float(2.0 * estimate @ moment[:, 0] - estimate @ gram @ estimate)
    return _Part(family, coordinate, spread, group.log_evidence(moment), explained)


def _added(arrays: Sequence[Array]) -> Array:
    total: Array = np.sum(arrays, axis=0)
    return total
