"""Before the experiment: which effects planned tests could name, and which further run gains most.

The base model takes its tests without error, read as often as planned; what its readings would tell
of an effect that makes a stated misfit is known to first order. The effect leads over its nearest
rival, nothing among them, by an expected log evidence m, which noise scatters by the root of 2 m:
it is named with the probability that more than `LEAD` of it is left.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import norm

from spinepipe.cohort import Cohort
from spinepipe.cohort.measured import measured_specimen
from spinepipe.effects.contract import Array
from spinepipe.model.file import ModelFile
from spinepipe.problems import InputError, InputProblem
from spinepipe.studies.discrepancy.design.distinguishability import Target, targets
from spinepipe.studies.discrepancy.design.information import Bench
from spinepipe.studies.discrepancy.design.signatures import (
    cohort_signatures,
    with_each_run,
)
from spinepipe.studies.discrepancy.design.testable import (
    LEAD,
    Typical,
    best_spread,
    judgements,
    typical_form,
)
from spinepipe.studies.discrepancy.search.baseline import BaselineFit, base_model
from spinepipe.studies.discrepancy.search.hypothesis import trials
from spinepipe.studies.discrepancy.search.investigation import Prepared, fit_base
from spinepipe.studies.discrepancy.search.noise import USUAL_ACCURACY, Noise
from spinepipe.studies.discrepancy.search.prediction import Simulated
from spinepipe.studies.discrepancy.search.readings import Repeats, SpecimenReadings
from spinepipe.studies.discrepancy.search.search_state import needed_of
from spinepipe.studies.discrepancy.settings import Discrepancy
from spinepipe.studies.discrepancy.store import at_once
from spinepipe.studies.discrepancy.verdict import REPEATS
from spinepipe.units import COORDINATES, ROTATIONS, to_si, without_step_0

LARGEST = 10.0
"""Times the typical strength: forms that make a misfit only beyond it are left out."""


@dataclass(frozen=True)
class Prospect:
    """What planned tests could tell of an effect of one size.

    Attributes
    ----------
    gap : misfit that it makes, in SD of one reading.
    lead : expected log evidence over ``rival``, the nearest to the form that is hardest to tell;
        the rival is empty where that is the base alone. times : how many times as strong as usual
        that form then is; None where these tests cannot show the effect.
    probability : that it is named, mean over its forms.
    further_run, with_run : the run of the menu, one cycle on each specimen, that makes this most
        probable, and to how much. why : it cannot be shown.
    """

    effect: str
    gap: float
    times: float | None
    lead: float
    rival: str
    probability: float
    further_run: str
    with_run: float
    why: str


@dataclass(frozen=True)
class PlannedExperiment:
    """All prospects, and of each further run the mean of all probabilities with it, best first."""

    prospects: tuple[Prospect, ...]
    runs: tuple[tuple[str, float], ...]


def planned_experiment(
    study: Discrepancy, cohort: Cohort, file: ModelFile | None, cycles: int, gaps: Sequence[float]
) -> PlannedExperiment:
    """What tests of which only the loads are known could tell of each effect.

    Parameters
    ----------
    file : the model that the study starts from, where it is a file. cycles : of each test.
    gaps : misfits, in SD of one reading.

    Raises
    ------
    InputError
        Where the cohort has no loads, or nothing says how large errors of readings are.
    """
    ready = as_planned(study, cohort, file, cycles)
    grounds = fit_base(ready, at_once)
    names = sorted(cohort.specimen_names)
    tried = trials(study.effects, ready.coordinates, names, len(cohort.joint_names))
    needed = needed_of(len(tried)) + LEAD
    design = cohort_signatures(grounds, tried)
    judged = judgements(design, needed)
    # forms of each effect, one a variant, with the strengths that make the gaps; as usual in its
    # best form where these tests do not show it
    one_reading = cohort_signatures(_read_once(ready), tried)
    chosen: list[tuple[int, Typical]] = []
    times: list[Array] = []
    for number, one in enumerate(judged):
        for variant in tried[number].variants if one.testable else ():
            form = best_spread(design, number, variant)
            alone = typical_form(one_reading, number, form.form)
            made = np.sqrt(alone.squared(alone.refitted) / one_reading.freedom)
            if LARGEST * made >= min(gaps):
                chosen.append((number, form))
                times.append(np.array(gaps) / made)
        if not one.testable:
            chosen.append((number, one.best))
            times.append(np.ones(len(gaps)))
    now = targets(design, judged, chosen, times)
    told = _probabilities(now, len(tried), len(gaps))
    told[[not one.testable for one in judged]] = 0.0
    with_runs: list[tuple[str, Array]] = []
    for run, more in with_each_run(Bench.of(grounds, ready.declared), tried):
        again = [(number, typical_form(more, number, one.form)) for number, one in chosen]
        found = targets(more, judgements(more, needed), again, times)
        with_runs.append((run.words, _probabilities(found, len(tried), len(gaps))))
    prospects = []
    for k, gap in enumerate(gaps):
        for number, one in enumerate(judged):
            own = [(target.leads()[k], target) for target in now if target.number == number]
            (lead, rival), hardest = min(own, key=lambda pair: pair[0], default=((0.0, ""), None))
            best = max(with_runs, key=lambda pair: pair[1][number, k], default=("", told))
            gains = best[1][number, k] > told[number, k]
            prospects.append(
                Prospect(
                    effect=one.effect,
                    gap=gap,
                    times=float(hardest.times[k]) if hardest and one.testable else None,
                    lead=lead,
                    rival=rival,
                    probability=float(told[number, k]),
                    further_run=best[0] if gains else "",
                    with_run=float(best[1][number, k] if gains else told[number, k]),
                    why=one.why if hardest else f"it would be {LARGEST:g} times as strong as usual",
                )
            )
    means = [(words, float(np.mean(one))) for words, one in with_runs]
    return PlannedExperiment(tuple(prospects), tuple(sorted(means, key=lambda one: -one[1])))


def named_with(lead: float) -> float:
    """Probability that noise leaves more than `LEAD` of an expected lead."""
    return float(norm.cdf((lead - LEAD) / np.sqrt(2.0 * lead))) if lead > 0.0 else 0.0


def _probabilities(found: Sequence[Target], effects: int, gaps: int) -> Array:
    """(E, G) probability that each effect is named, mean over its forms."""
    sums, counts = np.zeros((effects, gaps)), np.zeros((effects, 1))
    for one in found:
        sums[one.number] += [named_with(lead) for lead, _ in one.leads()]
        counts[one.number] += 1.0
    result: Array = sums / np.maximum(counts, 1.0)
    return result


def _read_once(ready: Prepared) -> BaselineFit:
    """The base as one cycle of readings by an exact instrument tells it."""
    readings = tuple(
        replace(one, tests=tuple(replace(t, cycles=t.cycles[:1]) for t in one.tests))
        for one in ready.readings
    )
    exact = replace(ready.noise, accuracy=np.zeros(6))
    return fit_base(replace(ready, readings=readings, noise=exact), at_once)


def as_planned(study: Discrepancy, cohort: Cohort, file: ModelFile | None, cycles: int) -> Prepared:
    """The study as if its base had been read in each test of the cohort, without error.

    Rotations are read unless the study names other coordinates.
    """
    sd = cohort.reading_sd(study.measurement_sd)
    if sd is None or cohort.loads is None:
        found = "no loads.csv" if cohort.loads is None else "no SD of one reading"
        allowed = "loads of each planned test, and measurement_sd or accuracy of the instrument"
        remedy = "add them to the cohort"
        raise InputError([InputProblem(str(cohort.folder), None, None, found, allowed, remedy)])
    coordinates = tuple(name for name in COORDINATES if name in (study.coordinates or ROTATIONS))
    unread = [k for k, name in enumerate(COORDINATES) if name not in coordinates]
    start = np.array(study.stiffness.in_order(), dtype=float)
    zeroed = cohort.zeroed_at_step_0
    readings = []
    for name in sorted(cohort.specimen_names):
        one = measured_specimen(cohort, name, sorted(study.tests or cohort.tests))
        cases = {case.test: case for case in reversed(one.cases)}
        given = SpecimenReadings(name, one.frames, ())
        model = base_model(cohort, given, start, file)
        tests = []
        every = list(cases.values())
        moved = Simulated(model, every, zeroed, ()).at(np.zeros(0)).readings
        for case, q in zip(every, moved, strict=True):
            seen: Array = np.where(np.isin(np.arange(6), unread), np.nan, q)
            seen = without_step_0(seen, zeroed)
            tests.append(Repeats(case, np.repeat(seen[None], cycles, axis=0)))
        readings.append(replace(given, tests=tuple(tests)))
    declared, told = to_si(sd), to_si(cohort.accuracy_sd)
    noise = Noise(
        sd=np.where(np.isin(np.arange(6), unread), np.nan, declared),
        correlation=0.0,
        source=REPEATS,
        differences=np.zeros(6, dtype=np.int64),
        outliers=0,
        zeroed=zeroed,
        accuracy=np.where(np.isnan(told), USUAL_ACCURACY, told),
        assumed=bool(np.isnan(told).any()),
    )
    every_one = tuple(readings)
    return Prepared(study, cohort, file, coordinates, every_one, every_one, noise, declared)
