"""Tangents of all segments fitted at once to both bending films, through the simulator.

The unknowns of a patient are the logarithms of `population`. A pose is found where the film has the
uppermost vertebra, places and tilts of its vertebrae are compared with the film's, and its exact
answer to each unknown is taken from the equations of equilibrium. What the films leave open stays
as the population has it; the spread of what is left is the curvature at the optimum (Laplace).

The uppermost vertebra, too, is read with error, and what holds it would pass the error on to the
segment below: where it was on each film is fitted along, near where it was read.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import norm

from spinepipe.calibrate.descent import Settled, descend, once
from spinepipe.effects.bounded_tangent import BoundedTangent, argument
from spinepipe.effects.contract import Array
from spinepipe.model import SpineModel
from spinepipe.statics.prescribed import Ask, Held, alone
from spinepipe.status import Ended
from spinepipe.studies.scoliosis.films import LEFT, RIGHT
from spinepipe.studies.scoliosis.held_spine import BENDING, with_laws
from spinepipe.studies.scoliosis.personal import Patient, Personal
from spinepipe.studies.scoliosis.population import Known, Population, assumed
from spinepipe.studies.scoliosis.tangent_laws import SMALLEST_END, Ends
from spinepipe.units import DEG_PER_RAD, MM_PER_M

FARTHEST = 5.0
"""Numbers stay within so many SD of the population's mean."""

BEYOND_THE_FILM = (1.3, 2.0, 4.0)
"""A fit begins with ends at least so many times as far as the rotations of the films: the first of
these at which the chain has a pose."""

SETTLED = Settled(cost=1e-4, step=1e-4, slope=1e-8, evaluations=100)
"""A ten-thousandth of a number's logarithm is far within its spread."""

LEVEL = 0.95
"""Of the intervals of ratios."""

TOPS = 6
"""Place and tilt of the uppermost vertebra on two films."""

READINGS_OF_A_CHANGE = 2
"""On the film and on the erect one."""

NO_POSE = "in no first guess does a stable pose have the uppermost vertebra where the films have it"


class NoFit(Exception):
    """The films cannot be fitted; the message says why."""


@dataclass(frozen=True)
class Told:
    """What the films say of the numbers near a fit, apart from any population.

    Attributes
    ----------
    matrix : (3 S, 3 S) and vector : (3 S,), of half the sum of squares x matrix x / 2 - vector x.
    """

    matrix: Array
    vector: Array

    def known(self, population: Population) -> Known:
        """The numbers, where the patient is of a population."""
        covariance = np.linalg.inv(self.matrix + population.precision)
        mean = covariance @ (self.vector + population.precision @ population.mean)
        return Known(mean.astype(float, copy=False), covariance.astype(float, copy=False))


@dataclass(frozen=True)
class Fitted:
    """The end of a fit.

    Attributes
    ----------
    unknowns : (3 S + 6,), the likeliest: the numbers, then by how many SD the uppermost vertebra
        lay off where the right and the left film have it.
    known : the numbers and their covariance.
    poses : by position, those of the films.
    decided : of how many the films, not the population, decided.
    """

    unknowns: Array
    told: Told
    known: Known
    arrived: bool
    poses: Mapping[str, Held]

    @property
    def decided(self) -> float:
        """Sum over numbers of the films' share of what is known of them."""
        return float(np.trace(self.known.covariance @ self.told.matrix))


def _told(errors: Array, slopes: Array, at: Array) -> Told:
    """What errors and their slopes at a point say of the numbers, wherever the top was."""
    matrix = slopes.T @ slopes + np.diag(np.arange(len(at)) >= len(at) - TOPS)
    vector = matrix @ at - slopes.T @ errors
    vector[-TOPS:] -= at[-TOPS:]
    of_top = np.linalg.solve(
        matrix[-TOPS:, -TOPS:], np.column_stack([matrix[-TOPS:], vector[-TOPS:]])
    )
    whole = np.column_stack([matrix, vector])[:-TOPS] - matrix[:-TOPS, -TOPS:] @ of_top
    return Told(whole[:, : len(at) - TOPS], whole[:, -1])


def ends_of(numbers: Array) -> tuple[Array, Array]:
    """(S,) rad each: lower and upper ends."""
    _, lower, upper = numbers.reshape(3, -1)
    return -np.exp(lower), np.exp(upper)


def laws_of(numbers: Array, size: float) -> Array:
    """(S, 3) stretch (N m) and ends (rad) of the tangents whose mean at rest is a size, N m/rad."""
    lower, upper = ends_of(numbers)
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
        b_by_end = sign * b**2 / np.pi
        c_by_end = -0.5 * (b_by_end * (lower + upper) + b)
        found[:, 0, column] = -stretch * (b_by_end / b + 2.0 * np.tan(c) * c_by_end) * end
        found[:, column, column] = end
    return found


class FilmFit:
    """The films of one patient as a least squares problem."""

    def __init__(self, patient: Patient, sd: Array, ask: Ask = alone) -> None:
        """A problem without a first guess.

        Parameters
        ----------
        sd : (3,) m, m and rad, of a vertebra's place and tilt on a film less the model's.
        ask : who answers the questions of Newton's method.
        """
        self.patient, self.size, self.sd = patient, patient.size, sd
        self.segments = patient.chain.n_joints
        model = self._model(next(self._guesses(assumed(self.segments)))[:-TOPS])
        self.spine = replace(patient.held(model), ask=ask)
        self.near: dict[str, Held] = {}

    def fit(self, population: Population, start: Fitted | None = None) -> Fitted:
        """The likeliest numbers, and what is known of them; from a fit near by, if there is one.

        Raises
        ------
        NoFit : where no pose begins the fit.
        """
        root, tops = population.root, np.zeros(TOPS)
        middle = np.concatenate([population.mean, tops])
        scale = np.concatenate([population.sd, tops + 1.0])
        low, high = middle - FARTHEST * scale, middle + FARTHEST * scale
        drawn = np.eye(len(middle))
        drawn[: len(root), : len(root)] = root
        self.near = {} if start is None else dict(start.poses)

        @once
        def point(unknowns: Array) -> tuple[Array, Array] | None:
            found = self.missed(unknowns)
            if found is None:
                return None
            away = drawn @ (unknowns - middle)
            return np.append(found[0], away), np.vstack([found[1], drawn])

        guesses = self._guesses(population) if start is None else [start.unknowns]
        within = (np.clip(one, low + 1e-9, high - 1e-9) for one in guesses)
        begin = next((one for one in within if point(one) is not None), None)
        if begin is None:
            raise NoFit(NO_POSE)
        size = 2 * 3 * (self.segments - 1) + len(begin)
        ended = descend(point, begin, (low, high), scale, size, SETTLED)
        found = self.missed(ended.x)
        assert found is not None  # a descent ends where there is a pose
        told = _told(*found, ended.x)
        known = replace(told.known(population), mean=ended.x[:-TOPS])
        return Fitted(ended.x, told, known, ended.arrived, self.near)

    def personal(self, fitted: Fitted) -> Personal:
        """The model of a fit."""
        return self._personal(fitted.known, fitted.decided)

    def unfitted(self, population: Population) -> Personal:
        """The model of a patient of whom no film was fitted."""
        nothing = np.zeros((len(population.mean),) * 2)
        known = Told(nothing, nothing[0]).known(population)
        begin = self._beyond_films(known.mean, BEYOND_THE_FILM[-1])
        return self._personal(Known(begin, known.covariance), 0.0)

    def _personal(self, known: Known, decided: float) -> Personal:
        s = self.segments
        centred = np.eye(s) - 1.0 / s
        ratio, spread = centred @ known.mean[:s], centred @ known.covariance[:s, :s] @ centred
        reach = float(norm.ppf(0.5 + 0.5 * LEVEL)) * np.sqrt(np.diag(spread))
        return Personal(
            self._model(known.mean),
            self.size * np.exp(known.mean[:s]),
            Ends(*ends_of(known.mean)),
            np.zeros(s, dtype=bool),
            len(known.mean) - 1,  # their common size is no part of the films' answer
            decided,
            np.exp(np.stack([ratio - reach, ratio + reach])),
        )

    def missed(self, unknowns: Array) -> tuple[Array, Array] | None:
        """Errors of places and tilts between the ends, both films, over their SD; by each unknown.

        Returns
        -------
        (6 (S - 1),) and (6 (S - 1), 3 S + 6), or None where a film has no pose.
        """
        numbers, tops = unknowns[:-TOPS], unknowns[-TOPS:].reshape(2, 3)
        laws, laws_by = laws_of(numbers, self.size), by_numbers(numbers, self.size)
        spine = self.spine.with_values(self.spine.chain.values[0], laws)
        errors, slopes = [], []
        for film_number, position in enumerate((RIGHT, LEFT)):
            film = self.patient.read.films[position]
            top = film.top + self.sd * tops[film_number]
            posed = spine.at(top, self.near.get(position))
            if posed.held.status is not Ended.CONVERGED:
                return None
            self.near[position] = posed.held
            held_by = np.zeros((len(posed.held.q), len(unknowns)))
            held_by[:, :-TOPS] = self._held_by(posed.held.q, laws, laws_by)
            top_by = np.zeros((3, len(unknowns)))
            at = len(numbers) + 3 * film_number
            top_by[:, at : at + 3] = np.diag(self.sd)
            change = posed.answers_to(held_by, top_by)
            off = (posed.film.rows - film.rows)[:, 1:-1] / self.sd[:, None]
            by = posed.film_by[:, :-1] @ change / self.sd[:, None, None]
            errors.append(off.ravel())
            slopes.append(by.reshape(len(errors[-1]), -1))
        return np.concatenate(errors), np.vstack(slopes)

    def _model(self, numbers: Array) -> SpineModel:
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
            yield np.append(self._beyond_films(population.mean, beyond), np.zeros(TOPS))

    def _beyond_films(self, numbers: Array, beyond: float) -> Array:
        """The numbers (3 S,), with ends so many times as far as the rotations of both films."""
        pairs, s = self.patient.pairs, self.segments
        least = -np.minimum(pairs.right, pairs.left)
        most = np.maximum(pairs.right, pairs.left)
        reached = beyond * np.maximum(np.concatenate([least, most]), SMALLEST_END)
        return np.concatenate([numbers[:s], np.maximum(numbers[s:], np.log(reached))])


def weighed_with(reading_mm: float, reading_deg: float, model_mm: float, model_deg: float) -> Array:
    """(3,) m, m and rad: SD of a place and a tilt on a film less the model's, which has the erect
    film's."""
    read = np.sqrt(READINGS_OF_A_CHANGE) * np.array([reading_mm, reading_deg])
    place, tilt = np.hypot(read, [model_mm, model_deg])
    return np.array([place / MM_PER_M, place / MM_PER_M, tilt / DEG_PER_RAD])
