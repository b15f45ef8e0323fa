"""Tangents of all segments fitted at once to both bending films, through the simulator.

The unknowns of a patient are the logarithms of `population`. A pose is found where the film has the
uppermost vertebra, places and tilts of its vertebrae are compared with the film's, and its exact
answer to each unknown is taken from the equations of equilibrium. What the films leave open stays
as the population has it; the spread of what is left is the curvature at the optimum (Laplace).

The uppermost vertebra, too, is read with error, and what holds it would pass the error on to the
segment below: where it was on each film is fitted along, near where it was read. So is the frame of
each film, that of its lowest vertebra, whose error turns all others by as much.

The cost has several optima, so that a fit has several starts (`optima`).
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice

import numpy as np
from scipy.stats import norm, qmc

from spinepipe.calibration.descent import DescentTolerances, Point
from spinepipe.calibration.lockstep import in_lockstep
from spinepipe.calibration.loss import counted
from spinepipe.effects.bounded_tangent import BoundedTangent, argument
from spinepipe.effects.contract import Array
from spinepipe.model import SpineModel
from spinepipe.statics.prescribed import PrescribedResult, alone, answered
from spinepipe.statics.prescribed_chain import Ask
from spinepipe.status import PrescribedStatus, Status
from spinepipe.studies.scoliosis.films import LEFT, RIGHT, Film, FilmSd
from spinepipe.studies.scoliosis.fixed_end_spine import BENDING, with_laws
from spinepipe.studies.scoliosis.optima import FilmOptimum, Limits, best, optimum
from spinepipe.studies.scoliosis.personal import Fitting, Patient, PersonalModel
from spinepipe.studies.scoliosis.population import PatientPrior, Population, usual_population
from spinepipe.studies.scoliosis.tangent_laws import SMALLEST_END, EndRotations

FARTHEST = 5.0
"""Numbers stay within so many SD of the population's mean."""

BEYOND_THE_FILM = (1.3, 2.0, 4.0)
"""A fit begins with ends at least so many times as far as the rotations of the films: the first of
these at which the chain has a pose."""

SETTLED = DescentTolerances(cost=1e-4, step=1e-4, slope=1e-8, evaluations=100)
"""A ten-thousandth of a number's logarithm is far within its spread."""

DRAWN_STARTS = 4
"""Starts drawn from the population, and as many with the two ends of each segment exchanged, so
that a mirrored patient has mirrored starts."""

LEVEL = 0.95
"""Of the intervals of ratios."""

READINGS = 12
"""Frame of a film, then place and tilt of its uppermost vertebra, of two films."""

NO_POSE = "in no first guess does a stable pose have the uppermost vertebra where the films have it"


class NoFit(Exception):
    """The films cannot be fitted; the message says why."""


@dataclass(frozen=True)
class FilmInformation:
    """What the films say of the numbers near a fit, apart from any population.

    Attributes
    ----------
    matrix : (3 S, 3 S) and vector : (3 S,), of half the sum of squares x matrix x / 2 - vector x.
    """

    matrix: Array
    vector: Array

    def known(self, population: Population) -> PatientPrior:
        """The numbers, where the patient is of a population."""
        covariance = np.linalg.inv(self.matrix + population.precision)
        drawn = covariance @ population.precision  # how far a number follows the population's mean
        mean = covariance @ self.vector + drawn @ population.mean
        unsure = drawn * population.unsure
        return PatientPrior(mean.astype(float, copy=False), covariance + unsure @ unsure.T)

    def decided(self, population: Population) -> float:
        """Sum over numbers of the films' share of what is known of them."""
        return float(np.trace(np.linalg.solve(self.matrix + population.precision, self.matrix)))


@dataclass(frozen=True)
class FilmFitResult:
    """The end of a fit.

    Attributes
    ----------
    unknowns : (3 S + 12,), the likeliest: the numbers, then by how many SD frames and uppermost
        vertebrae lay off where the right and the left film have them.
    known : the numbers and their covariance.
    poses : by position, those of the films, as the model takes them from neutral.
    decided : of how many the films, not the population, decided.
    cost : sum of squares of errors and of what the population holds against the numbers, in SDs.
    n_optima : distinct optima found from all starts.
    """

    unknowns: Array
    information: FilmInformation
    known: PatientPrior
    status: Status
    poses: Mapping[str, PrescribedResult]
    cost: float
    n_optima: int
    decided: float


def _information(errors: Array, slopes: Array, at: Array) -> FilmInformation:
    """What errors and their slopes at a point say of the numbers, however the films were read.

    Gauss-Newton's normal equations; the twelve unknowns of reading, each with a prior of SD 1, are
    eliminated by their Schur complement.
    """
    matrix = slopes.T @ slopes + np.diag(np.arange(len(at)) >= len(at) - READINGS)
    vector = matrix @ at - slopes.T @ errors
    vector[-READINGS:] -= at[-READINGS:]
    of_reading = np.linalg.solve(
        matrix[-READINGS:, -READINGS:], np.column_stack([matrix[-READINGS:], vector[-READINGS:]])
    )
    whole = (
        np.column_stack([matrix, vector])[:-READINGS] - matrix[:-READINGS, -READINGS:] @ of_reading
    )
    return FilmInformation(whole[:, : len(at) - READINGS], whole[:, -1])


def ends_of(numbers: Array) -> tuple[Array, Array]:
    """(S,) rad each: lower and upper ends."""
    _, lower, upper = numbers.reshape(3, -1)
    return -np.exp(lower), np.exp(upper)


def laws_of(numbers: Array, size: float) -> Array:
    """(S, 3) stretch (N m) and ends (rad) of the tangents whose mean at rest is a size, N m/rad."""
    lower, upper = ends_of(numbers)
    # moment A (tan(B r + C) - tan C), whose slope at rest is A B (1 + tan(C)^2)
    b, c = argument(lower, upper)
    at_rest = size * np.exp(numbers.reshape(3, -1)[0])
    return np.column_stack([at_rest / (b * (1.0 + np.tan(c) ** 2)), lower, upper])


def by_numbers(numbers: Array, size: float) -> Array:
    """(S, 3, 3) derivative of each segment's law by its own three numbers."""
    stretch, lower, upper = laws_of(numbers, size).T
    b, c = argument(lower, upper)
    found = np.zeros((len(lower), 3, 3))
    found[:, 0, 0] = stretch
    for column, sign, end in ((1, 1.0, lower), (2, -1.0, upper)):
        # B = pi / (upper - lower), C = -B (lower + upper) / 2; unknowns are logarithms of the ends
        b_by_end = sign * b**2 / np.pi
        c_by_end = -0.5 * (b_by_end * (lower + upper) + b)
        found[:, 0, column] = -stretch * (b_by_end / b + 2.0 * np.tan(c) * c_by_end) * end
        found[:, column, column] = end
    return found


def prior(population: Population) -> tuple[Array, Array, Array]:
    """What is known of the n = 3 S + 12 unknowns of a fit before any film.

    Returns
    -------
    (n,) means and (n,) SDs, and (n, n) that makes of unknowns less their means errors of SD 1.
    """
    root = np.eye(len(population.mean) + READINGS)
    root[:-READINGS, :-READINGS] = population.root
    means = np.append(population.mean, np.zeros(READINGS))
    return means, np.append(population.sd, np.ones(READINGS)), root


class FilmFit:
    """The films of one patient as a least squares problem."""

    def __init__(self, patient: Patient, sd: FilmSd, ask: Ask = alone) -> None:
        """A problem without a first guess.

        Parameters
        ----------
        ask : who answers the questions of Newton's method.
        """
        self.patient, self.size, self.sd = patient, patient.size, sd
        self.segments = patient.chain.n_joints
        model = self.model_of(next(self._guesses(usual_population(self.segments)))[:-READINGS])
        self.spine = replace(patient.fixed_end(model), ask=ask)
        self.near: dict[str, PrescribedResult] = {}

    def fit(self, population: Population, start: FilmFitResult | None = None) -> FilmFitResult:
        """The likeliest numbers, and what is known of them; from a fit near by, if there is one.

        Raises
        ------
        NoFit : where no pose begins the fit.
        """
        (found,) = fit_alike([self], population, [start])
        if found is None:
            raise NoFit(NO_POSE)
        return found

    def starts(
        self, population: Population, drawn: int = DRAWN_STARTS, seed: int = 0
    ) -> list[list[Array]]:
        """Where fits begin: each a list of unknowns, of which the first that has poses is taken."""
        s = self.segments
        # ends exchanged: the second third of the numbers, lower ends, with the last one
        draws = qmc.LatinHypercube(3 * s, rng=np.random.default_rng(seed)).random(drawn)
        exchanged = np.concatenate([draws[:, :s], draws[:, 2 * s :], draws[:, s : 2 * s]], axis=1)
        numbers = population.mean + population.sd * norm.ppf(np.vstack([draws, exchanged]))
        further = (self._beyond_films(one, BEYOND_THE_FILM[0]) for one in numbers)
        return [
            list(self._guesses(population)),
            *([np.append(one, np.zeros(READINGS))] for one in further),
        ]

    def point(self, population: Population) -> Point:
        """Errors of the films, and of the numbers in the population, in their SDs."""
        middle, _, root = prior(population)

        def found(unknowns: Array) -> tuple[Array, Array] | None:
            films = self.missed(unknowns)
            if films is None:
                return None
            away = root @ (unknowns - middle)
            return np.append(films[0], away), np.vstack([films[1], root])

        return found

    def personal(self, fitted: FilmFitResult) -> PersonalModel:
        """The model of a fit."""
        found = self._personal(fitted.known, fitted.decided)
        return replace(found, fitting=Fitting(fitted.status, fitted.n_optima))

    def unfitted(self, population: Population) -> PersonalModel:
        """The model of a patient of whom no film was fitted."""
        nothing = np.zeros((len(population.mean),) * 2)
        known = FilmInformation(nothing, nothing[0]).known(population)
        begin = self._beyond_films(known.mean, BEYOND_THE_FILM[-1])
        return self._personal(PatientPrior(begin, known.covariance), 0.0)

    def _personal(self, known: PatientPrior, decided: float) -> PersonalModel:
        # ratios are over the geometric mean: logarithms less their mean
        s = self.segments
        centred = np.eye(s) - 1.0 / s
        ratio, spread = centred @ known.mean[:s], centred @ known.covariance[:s, :s] @ centred
        reach = float(norm.ppf(0.5 + 0.5 * LEVEL)) * np.sqrt(np.diag(spread))
        return PersonalModel(
            self.model_of(known.mean),
            self.size * np.exp(known.mean[:s]),
            EndRotations(*ends_of(known.mean)),
            np.zeros(s, dtype=bool),
            len(known.mean) - 1,  # their common size is no part of the films' answer
            decided,
            np.exp(np.stack([ratio - reach, ratio + reach])),
        )

    def missed(self, unknowns: Array) -> tuple[Array, Array] | None:
        """Errors of places and tilts between the ends, both films, over their SD; by each unknown.

        Returns
        -------
        (6 (S - 1),) and (6 (S - 1), 3 S + 12), or None where a film has no pose.
        """
        numbers = unknowns[:-READINGS]
        laws, laws_by = laws_of(numbers, self.size), by_numbers(numbers, self.size)
        spine = self.spine.with_values(self.spine.chain.values[0], laws)
        errors, slopes = [], []
        for film_number, position in enumerate((RIGHT, LEFT)):
            film = self.patient.read.films[position]
            read, top, read_by, top_by = self._as_it_was(film, unknowns, film_number)
            posed = spine.at(top, self.near.get(position))
            if posed.result.status is not PrescribedStatus.CONVERGED:
                return None
            self.near[position] = posed.result
            # implicit function theorem: how equilibrium moves the pose when an unknown changes what
            # the joints hold, or where the top is
            held_by = np.zeros((len(posed.result.q), len(unknowns)))
            held_by[:, : len(numbers)] = self._held_by(posed.result.q, laws, laws_by)
            change = posed.answers_to(held_by, top_by)
            # the lowest vertebra is fixed and the uppermost held: what lies between is compared
            off = (posed.film.rows - read)[:, 1:-1] / self.sd.vertebra[:, None]
            by = posed.film_by[:, :-1] @ change - read_by[:, 1:-1]
            errors.append(off.ravel())
            slopes.append((by / self.sd.vertebra[:, None, None]).reshape(off.size, -1))
        residuals, by_errors = counted(np.concatenate(errors))
        return residuals, by_errors[:, None] * np.vstack(slopes)

    def _as_it_was(
        self, film: Film, unknowns: Array, film_number: int
    ) -> tuple[Array, Array, Array, Array]:
        """(3, V) a film less the errors of its frame, (3,) its top less its own error too, and by
        each unknown: (3, V, n) and (3, n)."""
        # (6, n) of frame and top, as the unknowns make them
        by = np.zeros((6, len(unknowns)))
        own = len(unknowns) - READINGS + 6 * film_number
        by[:, own : own + 6] = np.diag(np.concatenate([self.sd.frame, self.sd.vertebra]))
        off = by @ unknowns
        cos, sin, (right, up, tilt) = np.cos(off[2]), np.sin(off[2]), film.rows
        turned = np.stack([cos * right + sin * up, cos * up - sin * right, tilt + off[2]])
        read = turned + np.append(off[:2], 0.0)[:, None]
        turning = np.stack([turned[1], -turned[0], np.ones_like(tilt)])
        read_by = turning[..., None] * by[2]
        read_by[:2] += by[:2, None]
        return read, read[:, -1] + off[3:], read_by, read_by[:, -1] + by[3:]

    def model_of(self, numbers: Array) -> SpineModel:
        """The model of numbers (3 S,)."""
        laws = laws_of(numbers, self.size)
        return with_laws(self.patient.chain, self.patient.springs, laws)

    def _held_by(self, q: Array, laws: Array, laws_by: Array) -> Array:
        """(6 S, 3 S) change of what the joints hold with each number."""
        by_law = BoundedTangent().by_parameter(q.reshape(-1, 6), laws, np.empty(0))[:, BENDING]
        each = np.einsum("sp,spn->sn", by_law, laws_by)
        s = self.segments
        found = np.zeros((s, 6, 3, s))
        rows = np.arange(s)
        found[rows, BENDING, :, rows] = each
        return found.reshape(6 * s, 3 * s)

    def _guesses(self, population: Population) -> Iterator[Array]:
        """First unknowns: those of the population, then ever straighter laws."""
        for beyond in BEYOND_THE_FILM:
            yield np.append(self._beyond_films(population.mean, beyond), np.zeros(READINGS))

    def _beyond_films(self, numbers: Array, beyond: float) -> Array:
        """The numbers (3 S,), with ends so many times as far as the rotations of both films."""
        pairs, s = self.patient.pairs, self.segments
        least = -np.minimum(pairs.right, pairs.left)
        most = np.maximum(pairs.right, pairs.left)
        # an end must lie beyond what a segment has turned on either film, in the sense of that end
        reached = beyond * np.maximum(np.concatenate([least, most]), SMALLEST_END)
        return np.concatenate([numbers[:s], np.maximum(numbers[s:], np.log(reached))])


def fit_alike(
    fits: Sequence[FilmFit],
    population: Population,
    before: Sequence[FilmFitResult | None],
    drawn: int = DRAWN_STARTS,
    seed: int = 0,
) -> list[FilmFitResult | None]:
    """Fits of patients with equally many segments, all starts in lockstep; None without a pose.

    Parameters
    ----------
    before : a fit near by of each, from which alone it begins; None for all starts.
    drawn : starts drawn from the population, with that seed; as many more are their mirror image.
    """
    begins: list[list[tuple[Sequence[Array], Mapping[str, PrescribedResult]]]] = [
        [([near.unknowns], near.poses)]
        if near is not None
        else [(one, {}) for one in fit.starts(population, drawn, seed)]
        for fit, near in zip(fits, before, strict=True)
    ]
    searches = [
        partial(_search, fit, population, *begin)
        for fit, each in zip(fits, begins, strict=True)
        for begin in each
    ]
    ends = iter(in_lockstep(searches, answered))
    return [_fitted(list(islice(ends, len(each))), population) for each in begins]


def _search(
    fit: FilmFit,
    population: Population,
    begin: Sequence[Array],
    near: Mapping[str, PrescribedResult],
    ask: Ask = alone,
) -> FilmOptimum | None:
    """The end of a fit from one start."""
    fit = FilmFit(fit.patient, fit.sd, ask)
    return optimum(fit, fit.point(population), begin, near, _limits(population), SETTLED)


def _fitted(ends: Sequence[FilmOptimum | None], population: Population) -> FilmFitResult | None:
    """The best end, and what the films say near it."""
    found, n_optima = best(ends, _limits(population)[2])
    if found is None:
        return None
    films = len(found.residual) - len(found.x)  # the rest is of the population
    information = _information(found.residual[:films], found.jacobian[:films], found.x)
    known = replace(information.known(population), mean=found.x[:-READINGS])
    return FilmFitResult(
        found.x,
        information,
        known,
        found.status,
        found.poses,
        found.cost,
        n_optima,
        information.decided(population),
    )


def _limits(population: Population) -> Limits:
    """(3 S + 12,) each: least and largest unknowns, and their SD in the population."""
    middle, scale, _ = prior(population)
    return middle - FARTHEST * scale, middle + FARTHEST * scale, scale
