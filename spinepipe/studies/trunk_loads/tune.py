"""Job: computed beside measured pressures, untuned, tuned, and tuned with each task left out."""

import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from math import atanh, inf, sqrt, tanh

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t

from spinepipe.calibration import loss
from spinepipe.calibration.descent import DescentTolerances, Point, descend, once
from spinepipe.calibration.profile import LEVEL, Best, Profile, profile_in_turn
from spinepipe.cohort import Cohort
from spinepipe.effects.contract import Array
from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.muscles.measured_pressures import PairedPressure, pair_with_tasks
from spinepipe.muscles.task import Task
from spinepipe.muscles.trunk import Trunk
from spinepipe.progress import Progress
from spinepipe.status import HELD
from spinepipe.studies.subjects import subject_of
from spinepipe.studies.trunk_loads.persons import (
    UprightPerson,
    extra_inputs,
    regressions_of,
    solver_options,
    source_of,
    vary_task,
)
from spinepipe.studies.trunk_loads.postures import read_tasks
from spinepipe.studies.trunk_loads.rows import Row, outcome_of
from spinepipe.studies.trunk_loads.settings import FACTOR_UNITS, NOMINAL, TrunkLoads
from spinepipe.studies.trunk_loads.tables import AGREEMENT, PRESSURES, REGION, TUNING
from spinepipe.tables import from_rows, write

RANGE = {
    "disc_area": (0.5, 2.0, 0.2),
    "pcsa": (0.5, 2.0, 0.2),
    "passive_rotation": (0.1, 3.0, 0.3),
    "passive_muscle": (0.0, 5.0, 0.5),
    "trunk_mass_ahead": (0.0, 2.0, 0.3),
    "hand_anterior_mm": (-150.0, 150.0, 30.0),
    "pelvis_extension_deg": (-10.0, 10.0, 3.0),
    "trunk_extension_deg": (-10.0, 10.0, 3.0),
    "height_cm": (-5.0, 5.0, 2.0),
    "bmi": (-3.0, 3.0, 1.0),
    "age_years": (-10.0, 10.0, 5.0),
    "pressure_kpa": (0.0, 10.0, 2.0),
    "largest_stress_mpa": (-0.2, 0.6, 0.1),
}
"""What each number may be: lowest, highest, size of a first step."""

SETTLED = DescentTolerances(cost=1e-3, step=3e-3, slope=1e-8, evaluations=25)
_DIFFERENCE = 0.02
"""Share of a first step by which slopes are taken."""

GOALS_MPA = {"untuned": 0.25, "tuned": 0.14, "left_out": 0.18}
LEAST_FOR_R, LEAST_FOR_INTERVAL = 3, 4
_Z = 1.959963984540054
"""97.5 % quantile of the normal distribution."""


def run(root: str, study: str, pressures: str, tuning: str, agreement: str) -> None:
    """Write the three tables."""
    settings, cohort = study_of_kind(TrunkLoads, root, study)
    progress = Progress(lambda line: print(f"{study}: {line}", file=sys.stderr, flush=True))
    who = volunteer_of(settings, cohort, source_of(settings, cohort).trunk)
    rows = rows_of(who, progress)
    made_by = provenance("tune", settings, cohort, None, extra_inputs(settings, cohort))
    for table, path in ((PRESSURES, pressures), (TUNING, tuning), (AGREEMENT, agreement)):
        write(from_rows(table, rows[table.name]), path, made_by)


Computed = tuple[float | None, str]
"""Pressure, MPa, and how finding the forces ended."""


@dataclass
class Volunteer:
    """The person whose pressures were measured, and what was computed already.

    Attributes
    ----------
    specimen : who stands for them. tasks : all tasks, by name. beside : measured pressures.
    """

    specimen: str
    stands: UprightPerson
    tasks: Mapping[str, Task]
    beside: tuple[PairedPressure, ...]
    _known: dict[tuple[float, ...], dict[str, Computed]] = field(default_factory=dict)

    def computed(
        self, values: Mapping[str, float], wanted: Sequence[PairedPressure] | None = None
    ) -> dict[str, Computed]:
        """Pressures of the wanted tasks, by default of all beside which one was measured."""
        asked = [one.task for one in (self.beside if wanted is None else wanted)]
        key = tuple(values.get(name, NOMINAL[name]) for name in RANGE)
        known = self._known.setdefault(key, {})
        if missing := [task for task in asked if task not in known]:
            known.update(self._compute(values, missing))
        return {task: known[task] for task in asked}

    def misfit(self, values: Mapping[str, float], wanted: Sequence[PairedPressure]) -> float:
        """MPa^2, sum of the squares of errors; infinite where there are none."""
        off = self.errors(values, wanted)
        return inf if off is None else float(off @ off)

    def errors(self, values: Mapping[str, float], wanted: Sequence[PairedPressure]) -> Array | None:
        """Errors, MPa; None where a task has no pressure, or is held nominally and is no more.

        Values that leave the muscles without an answer do not agree with anybody's pressures.
        """
        found, usual = self.computed(values, wanted), self.computed({}, wanted)
        off = []
        for one in wanted:
            (mpa, ended), (_, usually) = found[one.task], usual[one.task]
            if mpa is None or (usually in HELD and ended not in HELD):
                return None
            off.append(mpa - one.mpa)
        return np.array(off)

    def _compute(
        self, values: Mapping[str, float], names: Sequence[str]
    ) -> Iterator[tuple[str, Computed]]:
        """Pressures of tasks with the person and the tasks varied."""
        person, options = self.stands.varied(values), solver_options(self.stands.settings)
        for name in names:
            outcome = outcome_of(person, vary_task(self.tasks[name], values), options)
            pressure = outcome.pressure
            mpa = None if pressure is None else 1e-6 * float(pressure.pa)
            yield name, (mpa, outcome.status.value)


def volunteer_of(settings: TrunkLoads, cohort: Cohort, source: Trunk) -> Volunteer:
    """The volunteer of a study, before anything is computed.

    Parameters
    ----------
    source : trunk of the reference person.
    """
    assert settings.volunteer is not None
    specimen, tasks = settings.volunteer.specimen, read_tasks(cohort, settings.trunk_angle)
    subject, regressions = subject_of(cohort, specimen), regressions_of(settings, cohort.folder)
    stands = UprightPerson.of(settings, source, subject, regressions)
    return Volunteer(specimen, stands, tasks, pair_with_tasks(tasks))


def rows_of(who: Volunteer, progress: Progress) -> dict[str, list[Row]]:
    """Rows of each table, by its name."""
    assert who.stands.settings.volunteer is not None
    tuned = who.stands.settings.volunteer.tuned
    counted = [one for one in who.beside if one.counted]
    progress.round("fitting all counted tasks")
    best, bound = fit_from_corners(who, tuned, counted)
    tiers = {"untuned": who.computed({}), "tuned": who.computed(_named(tuned, best))}
    progress.round("how far each number may go")
    region = regions(who, tuned, counted, best)
    of_all: Row = {"tier": "tuned", "left_out": ""}
    tuning = [of_all | row for row in _tuning(tuned, best, bound, region)]
    without: dict[str, Computed] = {}
    for one in progress.through(counted, "tasks left out"):
        rest = [other for other in counted if other is not one]
        left, at_bound = fit(who, tuned, rest, best)
        without |= who.computed(_named(tuned, left), [one])
        of_rest: Row = {"tier": "left_out", "left_out": one.task}
        tuning += [of_rest | row for row in _tuning(tuned, left, at_bound, None)]
    tiers["left_out"] = without
    known: Row = {"specimen": who.specimen}
    pressures = [
        known | {"tier": tier} | row for tier, found in tiers.items() for row in _rows(who, found)
    ]
    return {
        PRESSURES.name: pressures,
        TUNING.name: [known | row for row in tuning],
        AGREEMENT.name: [known | agreement(tier, pressures) for tier in tiers],
    }


def fit_from_corners(
    who: Volunteer, names: Sequence[str], counted: Sequence[PairedPressure]
) -> tuple[Array, NDArray[np.bool_]]:
    """As `fit`, from what is nominal and from a step off it in all directions.

    Pressures jump where a muscle comes to its end and others take over: one descent stops there.
    """
    nominal = np.array([NOMINAL[name] for name in names])
    corners = np.array(list(product(*([-RANGE[name][2], RANGE[name][2]] for name in names))))
    found = [
        fit(who, names, counted, start)
        for start in (nominal, *(nominal + corner for corner in corners if len(names)))
    ]
    return min(found, key=lambda one: who.misfit(_named(names, one[0]), counted))


def fit(
    who: Volunteer, names: Sequence[str], counted: Sequence[PairedPressure], start: Array
) -> tuple[Array, NDArray[np.bool_]]:
    """Values (P,) of the named numbers with the least squares of errors, and whether at a bound."""
    low, high, step = _ranges(names)
    start = np.clip(start, low, high)
    if not len(counted) or who.errors(_named(names, start), counted) is None:
        return start, np.zeros(len(names), dtype=bool)
    point = once(_errors(who, names, counted))
    found = descend(point, start, (low, high), step, len(counted), SETTLED).x
    return found, (found - low < 1e-3 * step) | (high - found < 1e-3 * step)


def regions(
    who: Volunteer, names: Sequence[str], counted: Sequence[PairedPressure], best: Array
) -> Profile | None:
    """How far each fitted number may go by what the others leave, with one scatter of all errors.

    None where errors tell no scatter: no task is left over, or all are met.
    """
    errors = _errors(who, names, counted)
    found = errors(best) if len(names) else None
    freedom = len(counted) - len(names)
    if found is None or freedom <= 0 or not found[0].any():
        return None
    scatter = sqrt(float(found[0] @ found[0]) / freedom)

    def point(x: Array) -> tuple[Array, Array] | None:
        here = errors(x)
        return None if here is None else (here[0] / scatter, here[1] / scatter)

    low, high, step = _ranges(names)
    straight = np.zeros(len(names), dtype=bool)
    at = Best(best, found[0] / scatter, found[1] / scatter, low, high, step, straight, SETTLED)
    limit = float(t.ppf(0.5 + 0.5 * LEVEL, freedom))
    return profile_in_turn(at, once(point), range(len(names)), limit)


def _ranges(names: Sequence[str]) -> tuple[Array, Array, Array]:
    """(P,) each: lowest, highest, size of a first step."""
    low, high, step = (np.array([RANGE[name][k] for name in names]) for k in range(3))
    return low, high, step


def _errors(who: Volunteer, names: Sequence[str], counted: Sequence[PairedPressure]) -> Point:
    """Errors of the counted tasks, MPa, and their slopes by the named numbers."""
    _, high, step = _ranges(names)

    def errors(x: Array) -> Array | None:
        found = who.errors(_named(names, x), counted)
        return None if found is None else loss.counted(found)[0]

    def point(x: Array) -> tuple[Array, Array] | None:
        here = errors(x)
        if here is None:
            return None
        columns = []
        for k, size in enumerate(_DIFFERENCE * step):
            moved = x.copy()
            moved[k] += size if x[k] + size <= high[k] else -size
            there = errors(moved)
            columns.append(
                np.zeros_like(here) if there is None else (there - here) / (moved - x)[k]
            )
        return here, np.stack(columns, axis=1)

    return point


def _named(names: Sequence[str], x: Array) -> dict[str, float]:
    return dict(zip(names, x.tolist(), strict=True))


def _tuning(
    names: Sequence[str], x: Array, bound: NDArray[np.bool_], region: Profile | None
) -> Iterator[Row]:
    """Fitted values with their regions; an open end is none."""
    for k, (name, value) in enumerate(zip(names, x.tolist(), strict=True)):
        cells: Row = dict.fromkeys(REGION)
        if region is not None:
            below, above = bool(region.open_below[k]), bool(region.open_above[k])
            low = None if below else float(region.low[k])
            high = None if above else float(region.high[k])
            cells = dict(
                zip(REGION, (low, high, below, above, bool(region.closed[k])), strict=True)
            )
        yield {
            "parameter": name,
            "value": value,
            "default": NOMINAL[name],
            "unit": FACTOR_UNITS[name],
            "at_bound": bool(bound[k]),
            **cells,
        }


def _rows(who: Volunteer, found: Mapping[str, Computed]) -> Iterator[Row]:
    """Computed beside measured pressures of the tasks that were computed."""
    for one in who.beside:
        if one.task in found:
            computed, status = found[one.task]
            yield {
                "task": one.task,
                "measured_mpa": one.mpa,
                "measured_status": one.status,
                "measured_source": one.source,
                "counted": one.counted,
                "computed_mpa": computed,
                "status": status,
            }


def agreement(tier: str, pressures: Sequence[Row]) -> Row:
    """Correlation with its interval (Fisher's z), and errors, over the counted tasks of a tier."""
    rows = [row for row in pressures if row["tier"] == tier and row["counted"]]
    rows = [row for row in rows if row["computed_mpa"] is not None]
    measured = np.array([row["measured_mpa"] for row in rows])
    computed = np.array([row["computed_mpa"] for row in rows])
    off, n = computed - measured, len(rows)
    not_held = sum(row["status"] not in HELD for row in rows)
    r = float(np.corrcoef(measured, computed)[0, 1]) if n >= LEAST_FOR_R else None
    low = high = None
    if r is not None and n >= LEAST_FOR_INTERVAL and abs(r) < 1.0:
        z, reach = atanh(r), _Z / sqrt(n - 3)
        low, high = tanh(z - reach), tanh(z + reach)
    rmse = float(np.sqrt(np.mean(off**2))) if n else None
    return {
        "tier": tier,
        "n_tasks": n,
        "r": r,
        "r_low": low,
        "r_high": high,
        "rmse_mpa": rmse,
        "mean_error_mpa": float(off.mean()) if n else None,
        "n_not_held": not_held,
        "goal_rmse_mpa": GOALS_MPA[tier],
        "reached": None if rmse is None else rmse <= GOALS_MPA[tier] and not not_held,
    }
