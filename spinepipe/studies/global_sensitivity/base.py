"""Job: the spine of one specimen from which the factors start, and how it moves beside it.

Its stiffness is what the study gives, or is fitted to the specimen's measured motion. Either way
its motion is held against what was measured: indices speak of the spine that they were taken at.
"""

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from spinepipe.calibration import Fit, fit
from spinepipe.cohort import Cohort
from spinepipe.cohort.measured import measured_cycles
from spinepipe.designs import specimen_seed
from spinepipe.effects.contract import Array
from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.model import RefusedModel, SpineModel
from spinepipe.statics.batched import Cases, Spines, solve_many
from spinepipe.status import Status
from spinepipe.studies.global_sensitivity.largest_moment import largest_moment
from spinepipe.studies.global_sensitivity.settings import GlobalSensitivity
from spinepipe.studies.global_sensitivity.start import (
    DescribedSpecimen,
    asked_tests,
    problem_of,
    start_of,
)
from spinepipe.studies.global_sensitivity.tables import BASE_MOTION, BASE_STIFFNESS, EVERY
from spinepipe.studies.parts import stiffness_of_joints
from spinepipe.studies.selected_tests import SelectedTest
from spinepipe.tables import from_rows, write
from spinepipe.units import (
    COORDINATE_UNITS,
    COORDINATES,
    STIFFNESS_UNITS,
    from_si,
    subtract_baseline,
)

Rows = list[dict[str, Any]]

STARTS = 4
"""Of the fit: the start itself, and points around it."""

WITHIN = 2.0
"""Factor within which the base moves like the specimen."""

NOISES = 2.0
"""SDs of the measured number by which it may be wrong."""


def run(root: str, study: str, specimen: str, base_stiffness: str, base_motion: str) -> None:
    """Write the stiffness of one specimen, and its motion beside the measured one."""
    settings, cohort = study_of_kind(GlobalSensitivity, root, study)
    rows, moved = base(settings, cohort, specimen)
    made_by = provenance("base", settings, cohort, [specimen])
    for table, found, path in (
        (BASE_STIFFNESS, rows, base_stiffness),
        (BASE_MOTION, moved, base_motion),
    ):
        write(from_rows(table, found, specimen=specimen), path, made_by)


def base(settings: GlobalSensitivity, cohort: Cohort, specimen: str) -> tuple[Rows, Rows]:
    """Rows of the tables ``base_stiffness`` and ``base_motion`` of one specimen."""
    given = stiffness_of_joints(cohort, settings.start_stiffness, settings.level_stiffness)
    damping = np.array(settings.damping.in_order())
    tests = settings.chosen_tests(cohort)
    start = start_of(cohort, specimen, given, damping, tests, all_steps=True)
    rows = _fitted(settings, cohort, start) if settings.is_fitted else _given(settings, given)
    stiffness = given.copy()
    if settings.is_fitted:
        stiffness[:] = [row["stiffness"] for row in rows]
    model = start_of(cohort, specimen, stiffness, damping, tests, all_steps=False).model
    return rows, list(_beside_measured(cohort, model, tests))


def stiffness_of(rows: Rows) -> Array:
    """(6,) N/m and N m/rad of all joints, from rows of ``base_stiffness``."""
    return np.array([row["stiffness"] for row in rows if row["joint"] == EVERY])


def _stiffness_row(coordinate: str, start: float) -> dict[str, Any]:
    """A stiffness that nothing has changed."""
    nothing = dict.fromkeys(("low", "high", "open_below", "open_above", "identifiable"))
    return {
        "joint": EVERY,
        "coordinate": coordinate,
        "unit": STIFFNESS_UNITS[coordinate],
        "source": "given",
        "start": start,
        "stiffness": start,
        **nothing,
        "status": Status.CONVERGED.value,
        "message": "",
    }


def _given(settings: GlobalSensitivity, values: Array) -> Rows:
    """The study file's stiffness; levels of their own have rows of their own."""
    every = settings.start_stiffness.in_order()
    rows = [_stiffness_row(*one) for one in zip(COORDINATES, every, strict=True)]
    for joint, level in settings.level_stiffness.items():
        own = zip(COORDINATES[3:], level.in_order(), strict=True)
        rows += [{**_stiffness_row(*one), "joint": joint} for one in own]
    return rows


def _fitted(settings: GlobalSensitivity, cohort: Cohort, start: DescribedSpecimen) -> Rows:
    """One stiffness of all joints, fitted; what runs to a bound goes back to its start.

    A spring at its bound has left the data: it would carry factors beyond any stiffness that a
    model may have. The others are then fitted anew without it.
    """
    free: list[str] = list(settings.calibration.free)
    bounded: list[str] = []
    found, why = _fit(settings, cohort, start, free)
    # each round frees fewer coordinates, so it ends
    while found is not None and found.status.usable and found.at_bound.any() and free:
        at = [name for name, side in zip(free, found.at_bound, strict=True) if side]
        free, bounded = [name for name in free if name not in at], bounded + at
        if free:
            found, why = _fit(settings, cohort, start, free)
        else:
            found, why = None, "every stiffness ran to a bound"
    return [
        _fitted_row(settings, name, value, found, why, free, bounded)
        for name, value in zip(COORDINATES, settings.start_stiffness.in_order(), strict=True)
    ]


def _fit(
    settings: GlobalSensitivity, cohort: Cohort, start: DescribedSpecimen, free: Sequence[str]
) -> tuple[Fit | None, str]:
    """The fit, or None and why there is none."""
    options, specimen = settings.calibration, start.model.specimen
    cases = [test.case for test in start.tests]
    try:
        problem = problem_of(options, cohort, start, start.model, cases, free)
        seed = specimen_seed(settings.seed, specimen)
        found = fit(problem, STARTS, seed, options.identifiable_below, profiled=True)
    except RefusedModel as error:
        return None, str(error)
    more = f"{found.n_optima} optima: the answer depends on the start"
    notes = [found.message, more if found.n_optima > 1 else ""]
    return found, "; ".join(note for note in notes if note)


def _fitted_row(
    settings: GlobalSensitivity,
    name: str,
    start: float,
    found: Fit | None,
    why: str,
    free: Sequence[str],
    bounded: Sequence[str],
) -> dict[str, Any]:
    solved = found is not None and found.status.usable
    ended = Status.REFUSED if found is None else found.status
    row = {**_stiffness_row(name, start), "status": ended.value, "message": why}
    if name in bounded:
        return {**row, "source": "at_bound"}
    if name not in settings.calibration.free:
        return {**row, "source": "not_free"}
    if not solved:
        return {**row, "source": "no_fit"}
    assert found is not None
    at = list(free).index(name)
    value = float(found.values[at])
    reach = found.reach(at, value)
    assert reach is not None  # of every fit that has a stiffness
    fitted = {"stiffness": value, **asdict(reach), "identifiable": found.identifiable(at)}
    return {**row, "source": "fitted", **fitted}


def _beside_measured(
    cohort: Cohort, model: SpineModel, tests: Sequence[str]
) -> Iterator[dict[str, Any]]:
    """Rows of each test at its largest load, joint by joint and of all measured joints."""
    whole = asked_tests(cohort, model.specimen, tests, all_steps=True)
    tested = measured_cycles(cohort, model.specimen, [test.case for test in whole])
    peaks = asked_tests(cohort, model.specimen, tests, all_steps=False)
    for test, one in zip(peaks, tested, strict=True):
        place = [step.step for step in one.case.steps].index(test.largest)
        measured = from_si(one.readings[place])
        noise = _noise(cohort, one.zeroed)
        yield from _rows_of_test(cohort, model, test, measured, noise)


def _rows_of_test(
    cohort: Cohort, model: SpineModel, test: SelectedTest, measured: Array, noise: Array
) -> Iterator[dict[str, Any]]:
    """Rows of one test; measured (J, 6) and noise (6,) in mm and deg."""
    solved = solve_many(Spines.of(model, 1), Cases.of(test.case, 1))
    predicted = from_si(subtract_baseline(solved.q[0], test.from_first))[-1]
    last = len(test.case.steps) - 1
    driven = largest_moment(cohort, test.case.test, model.specimen)
    for column, coordinate in enumerate(COORDINATES):
        common = {
            "test": test.case.test,
            "step": test.largest,
            "coordinate": coordinate,
            "unit": COORDINATE_UNITS[coordinate],
            "loaded": driven is not None and driven[0] == coordinate,
            "status": str(solved.status[0, last]),
            "message": solved.messages.get((0, last), ""),
        }
        ours, theirs = predicted[:, column], measured[:, column]
        read = np.isfinite(theirs)
        if read.any():
            mean = float(ours[read].mean()), float(theirs[read].mean())
            # readings of joints err independently of each other
            spread = float(noise[column]) / np.sqrt(read.sum())
            yield {**common, "joint": EVERY, **compared(*mean, spread)}
        for joint, own, their in zip(model.joints, ours, theirs, strict=True):
            yield {
                **common,
                "joint": joint,
                **compared(float(own), float(their), float(noise[column])),
            }


def compared(predicted: float, measured: float, noise: float) -> dict[str, Any]:
    """The numbers, their ratio, and whether the base moves like the specimen.

    Near is between half and twice the measured number, with 2 noise more on either side, so that
    what is within its noise of 0 asks for a small prediction, not for a ratio.

    Parameters
    ----------
    predicted, measured : mm or deg; NaN without an equilibrium, or where not measured.
    noise : SD of the measured number.
    """
    stands, read = bool(np.isfinite(predicted)), bool(np.isfinite(measured))
    row: dict[str, Any] = {
        "predicted": predicted if stands else None,
        "measured": measured if read else None,
        "noise": noise,
        "ratio": None,
    }
    if not stands:
        return {**row, "verdict": "no_equilibrium"}
    if not read:
        return {**row, "verdict": "not_measured"}
    size, slack = abs(measured), NOISES * noise
    along = predicted * (1.0 if measured >= 0.0 else -1.0)
    if size > slack:
        row["ratio"] = predicted / measured
    near = size / WITHIN - slack <= along <= size * WITHIN + slack
    return {**row, "verdict": "near" if near else "far"}


def _noise(cohort: Cohort, zeroed: bool) -> Array:
    """(6,) mm and deg, SD of one number of ``motion.csv``; zeroing adds the error of step 0."""
    once = cohort.reading_sd()
    return np.zeros(6) if once is None else once * (np.sqrt(2.0) if zeroed else 1.0)
