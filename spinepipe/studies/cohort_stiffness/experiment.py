"""Job: what laboratories report of the tests of a specimen, measured and simulated.

Each curve is a loop of moment and motion; tests to opposite sides are joined to one.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy import stats

from spinepipe.calibration import Evaluator, Problem
from spinepipe.calibration.solvers import AtRest
from spinepipe.calibration.uncertainty import uncertainty
from spinepipe.cohort import Cohort
from spinepipe.cohort.load_tests import DRIVEN, moments
from spinepipe.cohort.measured import MeasuredCycle
from spinepipe.decomposition import eigh
from spinepipe.effects.contract import Array
from spinepipe.experiment.loop import Loop, RotationErrors, reading_noise
from spinepipe.jobs.digest import mark_of
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.model import RefusedModel, ScopedEffect
from spinepipe.status import NOT_FITTED, USABLE, Status, joined
from spinepipe.studies.cohort_stiffness.loop_rows import (
    TWO_ZEROS,
    LoopReading,
    axis_row,
    displacement_row,
    empty,
)
from spinepipe.studies.cohort_stiffness.predict import predict_motion
from spinepipe.studies.cohort_stiffness.problem import (
    SpecimenTests,
    base_effects,
    base_of,
    calibration_problem,
    origin,
    specimen_tests,
    start_stiffness,
)
from spinepipe.studies.cohort_stiffness.representations import finest
from spinepipe.studies.cohort_stiffness.settings import (
    CohortStiffness,
    representations_of,
    zone_formula,
)
from spinepipe.studies.cohort_stiffness.tables import (
    HELICAL_AXES,
    LOAD_DISPLACEMENT,
    MEASURED,
    NO_POSE,
    NOT_READ,
    NOWHERE,
    SIMULATED,
)
from spinepipe.tables import from_rows, read_frame, write
from spinepipe.units import COORDINATES, DEG_PER_RAD, subtract_baseline, to_si

Row = dict[str, Any]

AND = "+"
"""Between the names of two tests that are one loop."""

NO_MOMENT = "no moment drives a rotation that was read: there is no curve of moment and rotation"
ONE_READING = "fewer than two load steps were read"
NO_FIT = "no stiffness was fitted specimen by specimen: nothing to simulate with"
NO_SD = "no measurement_sd is declared: no interval"


@dataclass(frozen=True)
class LoadingLoop:
    """One cycle of a test, or of two tests to opposite sides one behind the other.

    Attributes
    ----------
    coordinate : rotation that the moment drives; None where no moment drives what was read.
    places : of its recordings among the cycles of the specimen. recordings : these.
    """

    test: str
    number: int
    coordinate: str | None
    places: tuple[int, ...]
    recordings: tuple[MeasuredCycle, ...]

    @cached_property
    def load(self) -> Array:
        """(T,) N m, the moment that drives the coordinate."""
        axis = DRIVEN.index(self.coordinate or DRIVEN[0])
        return np.concatenate([moments(one.case)[:, axis] for one in self.recordings])

    @cached_property
    def measured(self) -> Array:
        """(T, J, 6) m and rad, NaN where not read; where zeroed step 0 is zero as it is told."""
        parts = []
        for one in self.recordings:
            motion = one.measured.copy()
            if one.zeroed and len(motion):
                read = np.isfinite(one.readings).any(axis=0)
                motion[0] = np.where(read, 0.0, motion[0])
            parts.append(motion)
        return np.concatenate(parts)

    @property
    def parts(self) -> tuple[int, ...]:
        """Load steps of each recording."""
        return tuple(len(one.measured) for one in self.recordings)

    def of(self, each: Sequence[Array]) -> Array:
        """(T, ...) what is known step by step of all cycles of the specimen, of this loop."""
        return np.concatenate([each[place] for place in self.places])


def loading_loops(tested: Sequence[MeasuredCycle]) -> list[LoadingLoop]:
    """The cycles of a specimen in their order, two tests to opposite sides joined to one.

    Joined are tests that drive one rotation, each to its own side alone and the only one to it;
    their cycles of one number make a loop, others stay by themselves.
    """
    alone = []
    for place, one in enumerate(tested):
        # A moment that drives no rotation that was read makes no curve.
        driven = one.loaded if one.loaded in DRIVEN else None
        alone.append(LoadingLoop(one.case.test, one.case.cycle, driven, (place,), (one,)))
    partner = dict(_opposite(alone))
    found = {(loop.test, loop.number): loop for loop in alone}
    loops: list[LoadingLoop] = []
    for loop in alone:
        other = found.get((partner.get(loop.test, ""), loop.number))
        if other is None:
            loops.append(loop)
        elif loop.places < other.places:
            both = replace(
                loop,
                test=f"{loop.test}{AND}{other.test}",
                places=loop.places + other.places,
                recordings=loop.recordings + other.recordings,
            )
            loops.append(both)
    return loops


def _opposite(cycles: Sequence[LoadingLoop]) -> Iterator[tuple[str, str]]:
    """Each test with the one to the other side, where there is exactly one for each side."""
    sides: dict[tuple[str | None, int], set[str]] = {}
    for one in cycles:
        # 1 or -1 where only that side is loaded, else 0
        curve = Loop(one.load, one.load)
        reached = [side for side in (1, -1) if one.coordinate and curve.reached(side)]
        side = reached[0] if len(reached) == 1 else 0
        sides.setdefault((one.coordinate, side), set()).add(one.test)
    for coordinate in DRIVEN:
        here, there = (sides.get((coordinate, side), set()) for side in (1, -1))
        if len(here) == len(there) == 1 and not here & there:
            positive, negative = min(here), min(there)
            yield from ((positive, negative), (negative, positive))


@dataclass(frozen=True)
class Simulation:
    """Motion of a fitted model, and how it hangs on the fitted stiffness.

    Attributes
    ----------
    motion : (T, J, 6) m and rad of each cycle, or the status and message of one without.
    slopes : (T, J, 6, m) of each cycle, by the logarithms of the unknowns; None without a pose.
    root : (m, k), root @ root.T is the covariance of the unknowns that the data hold.
    held : (m,) which these are. reach : SDs to the ends of a 95 % interval.
    """

    representation: str
    motion: Sequence[tuple[Array | None, Status, str]]
    slopes: Sequence[Array] | None
    root: Array
    held: NDArray[np.bool_]
    reach: float


def run(
    root: str,
    study: str,
    fitted: list[str],
    specimen: str,
    load_displacement: str,
    helical_axes: str,
) -> None:
    """Write the tables of one specimen; ``fitted`` is the file of its own stiffness, if any."""
    settings, cohort = study_of_kind(CohortStiffness, root, study)
    tests = specimen_tests(settings, cohort, specimen)
    others = base_effects(base_of(root, settings), cohort, specimen)
    name = finest(representations_of(settings, cohort.joint_names))
    frame = read_frame(fitted[0]) if fitted else None
    model, why = _simulation(settings, cohort, specimen, tests, others, name, frame)
    definition = {
        "neutral_zone_definition": settings.neutral_zone,
        "neutral_zone_formula": zone_formula(settings),
    }
    # Rows of each curve and, where the joint turns, of its axis: measured first, then simulated.
    curves: list[Row] = []
    axes: list[Row] = []
    for cycle in loading_loops(tests.tested):
        for joint, label in enumerate(cohort.joint_names):
            key = {"joint": label, "test": cycle.test, "cycle": cycle.number}
            for curve, axis in _of_joint(settings, cycle, joint, cohort, model, why):
                curves.append({**curve, **key, **definition})
                axes += [{**axis, **key}] if axis else []
    made = origin("experiment", root, settings, cohort, [specimen], [mark_of(p) for p in fitted])
    write(from_rows(LOAD_DISPLACEMENT, curves, specimen=specimen), load_displacement, made)
    write(from_rows(HELICAL_AXES, axes, specimen=specimen), helical_axes, made)


def _simulation(
    settings: CohortStiffness,
    cohort: Cohort,
    specimen: str,
    tests: SpecimenTests,
    others: tuple[ScopedEffect, ...],
    representation: str | None,
    frame: pd.DataFrame | None,
) -> tuple[Simulation | None, str]:
    """The fitted model under all tests, or why there is none."""
    if representation is None or frame is None or not tests.tested:
        return None, NO_FIT
    if not frame["status"].isin([*USABLE, NOT_FITTED]).all() or frame["stiffness"].isna().all():
        return None, joined("the fit has no stiffness", str(frame["message"].iloc[0]))
    frame = frame[frame["stiffness"].notna()]  # others keep the value that fits start from
    start = start_stiffness(settings, cohort, representation)
    k, bound = _fitted(cohort, start, frame)
    motion = predict_motion(cohort, specimen, tests.frames, tests.tested, k, others)
    try:
        problem = calibration_problem(
            settings, cohort, specimen, representation, tests.frames, tests.tested, others
        )
        at = [(unknown.rows[0], unknown.column) for unknown in problem.free]
        # Unknowns are logarithms, so the fit is found again from its table: log of fitted / start.
        x = np.array([np.log(k[one] / start[one]) for one in at])
        at_bound = np.array([bound[one] for one in at])
        cases = [one.case for one in tests.tested]
        (seen,) = AtRest(problem.model, cases, problem.free, problem.scale).solve([(0, x)])
        # by the logarithms of the unknowns; without a pose there are words in their place
        slopes = None
        if not isinstance(seen, str):
            slopes = [subtract_baseline(one, cohort.zeroed_at_step_0) for one in seen.by_x]
        root, held, reach = _covariance(settings, problem, x, at_bound)
    except RefusedModel as error:
        return None, str(error)
    return Simulation(representation, motion, slopes, root, held, reach), ""


def _fitted(cohort: Cohort, start: Array, frame: pd.DataFrame) -> tuple[Array, NDArray[np.int64]]:
    """(J, 6) fitted stiffness, SI, and (J, 6) which is at a bound: -1 lower, 1 upper."""
    k, bound = start.copy(), np.zeros(start.shape, dtype=np.int64)
    sides = {"lower": -1, "no": 0, "upper": 1}
    for row in frame.to_dict("records"):
        at = cohort.joint_names.index(row["joint"]), COORDINATES.index(row["coordinate"])
        k[at], bound[at] = row["stiffness"], sides[row["at_bound"]]
    return k, bound


def _covariance(
    settings: CohortStiffness, problem: Problem, x: Array, at_bound: Array
) -> tuple[Array, NDArray[np.bool_], float]:
    """Root of the covariance of the unknowns that the data hold, which these are, and the reach."""
    evaluator = Evaluator(problem)
    found = uncertainty(
        evaluator.problem, evaluator.at(x), at_bound, settings.identifiable_below, None
    )
    held = found.identifiable
    # root @ root.T is the covariance; rounding may leave eigenvalues below 0
    values, vectors = eigh(found.covariance[np.ix_(held, held)]) if held.any() else (None, None)
    if values is None or vectors is None:
        return np.zeros((0, 0)), held, 0.0
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    return root, held, float(stats.t.ppf(0.975, found.degrees_of_freedom))


def _of_joint(
    settings: CohortStiffness,
    cycle: LoadingLoop,
    joint: int,
    cohort: Cohort,
    model: Simulation | None,
    why: str,
) -> Iterator[tuple[Row, Row | None]]:
    """Rows of the curve and of the axis, measured and simulated, of a joint that was read."""
    sd, zeroed = cohort.reading_sd(settings.measurement_sd), cohort.zeroed_at_step_0
    measured = cycle.measured[:, joint]
    if cycle.coordinate is None:
        if np.isfinite(measured).any():
            yield _refused(MEASURED, "", None, NO_MOMENT, Status.REFUSED), None
        return
    place = COORDINATES.index(cycle.coordinate)
    known = np.isfinite(measured[:, place])
    if not known.any():
        return
    told = TWO_ZEROS if zeroed and len(cycle.recordings) > 1 else ""
    if known.sum() < 2:
        told = joined(told, ONE_READING)
        yield _refused(MEASURED, "", cycle.coordinate, told, Status.REFUSED), None
        return
    noise = None if sd is None else reading_noise(cycle.parts, 1.0, zeroed)
    read = _Read(cycle, place, known, None if sd is None else float(to_si(sd)[place]), settings)
    spread = None
    if noise is not None and read.sd is not None:
        spread = replace(noise, root=read.sd * noise.root).at(known)
    row = read.curve(measured, spread) | {"source": MEASURED, "representation": ""}
    row["message"] = joined(row["message"], told, NO_SD if sd is None else "")
    first, last = read.ends
    root = None
    if sd is not None and noise is not None:
        # (12, 6 k) noise of the two end poses, whose steps share the unit errors of ``noise.root``
        ends = np.kron(noise.root[[first, last]], np.diag(to_si(sd)))
        root = np.asarray(ends, dtype=np.float64)
    yield row, read.axis(measured, root, np.zeros((12, 0)), MEASURED, "")
    yield _simulated(read, joint, model, why)


def _refused(
    source: str, representation: str, coordinate: str | None, why: str, status: Status
) -> Row:
    """A row of a curve without numbers."""
    return empty(LOAD_DISPLACEMENT) | {
        "source": source,
        "representation": representation,
        "coordinate": coordinate,
        "readings": 0,
        "neutral_zone": NOT_READ,
        "elastic_zone": NOWHERE,
        "status": status.value,
        "message": why,
    }


@dataclass(frozen=True)
class _Read:
    """Which steps of a cycle were read of one coordinate of a joint.

    Attributes
    ----------
    place : of the coordinate. known : (T,). sd : rad, of one reading, if it is declared.
    settings : for the definition of the neutral zone.
    """

    cycle: LoadingLoop
    place: int
    known: NDArray[np.bool_]
    sd: float | None
    settings: CohortStiffness

    def loop(self, motion: Array) -> Loop:
        """Moment and rotation of motion (T, 6) at the steps that were read."""
        return Loop(self.cycle.load[self.known], motion[self.known, self.place])

    @property
    def ends(self) -> tuple[int, int]:
        """Steps of the least and of the largest moment that were read."""
        steps, load = np.flatnonzero(self.known), self.cycle.load[self.known]
        return int(steps[np.argmin(load)]), int(steps[np.argmax(load)])

    def curve(self, motion: Array, spread: RotationErrors | None) -> Row:
        """Row of the curve of motion (T, 6), without its source."""
        name, below = self.settings.neutral_zone, self.settings.neutral_zone_below_nm_per_deg
        below = None if below is None else below * DEG_PER_RAD
        row = displacement_row(LoopReading(self.loop(motion), spread, self.sd, name, below))
        return row | {"coordinate": self.cycle.coordinate}

    def axis(
        self, motion: Array, root: Array | None, free: Array | None, source: str, name: str
    ) -> Row:
        """Row of the axis of motion (T, 6)."""
        first, last = self.ends
        row = axis_row(motion[first], motion[last], root, free)
        loads = {"from_nm": float(self.cycle.load[first]), "to_nm": float(self.cycle.load[last])}
        return row | loads | {"source": source, "representation": name}


def _simulated(
    read: _Read, joint: int, model: Simulation | None, why: str
) -> tuple[Row, Row | None]:
    """Rows of the model under the loads of the cycle, at the steps that were read."""
    cycle = read.cycle
    name = "" if model is None else model.representation
    lost = Status.REFUSED, why
    if model is not None:
        ended = [model.motion[place] for place in cycle.places]
        lost = next(((s, told) for one, s, told in ended if one is None), (Status.CONVERGED, ""))
    if model is None or not lost[0].usable:
        first, last = read.ends
        nothing = empty(HELICAL_AXES) | {
            "from_nm": float(cycle.load[first]),
            "to_nm": float(cycle.load[last]),
            "source": SIMULATED,
            "representation": name,
            "status": NO_POSE,
            "message": lost[1],
        }
        return _refused(SIMULATED, name, cycle.coordinate, lost[1], lost[0]), nothing
    motion = np.concatenate([one[:, joint] for one, _, _ in ended if one is not None])
    if model.slopes is None:
        row, axis = read.curve(motion, None), read.axis(motion, None, None, SIMULATED, name)
    else:
        by = cycle.of(model.slopes)[:, joint]
        # What the data hold of the stiffness spreads; what they do not leaves ends open.
        held, loose = by[..., model.held] @ model.root, by[..., ~model.held]
        spread = RotationErrors(held[:, read.place], loose[:, read.place], model.reach).at(
            read.known
        )
        row = read.curve(motion, spread)
        both = list(read.ends)
        flat = (held[both].reshape(12, -1), loose[both].reshape(12, -1))
        axis = read.axis(motion, *flat, SIMULATED, name)
    return row | {"source": SIMULATED, "representation": name}, axis
