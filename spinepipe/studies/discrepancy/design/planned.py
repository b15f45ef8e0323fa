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
    CohortSignatures,
    cohort_signatures,
    with_each_run,
)
from spinepipe.studies.discrepancy.design.testable import (
    LEAD,
    Judgement,
    judgements,
    typical_form,
)
from spinepipe.studies.discrepancy.search.baseline import base_model
from spinepipe.studies.discrepancy.search.hypothesis import Trials, trials
from spinepipe.studies.discrepancy.search.investigation import Prepared, fit_base
from spinepipe.studies.discrepancy.search.noise import USUAL_ACCURACY, Noise
from spinepipe.studies.discrepancy.search.prediction import Simulated
from spinepipe.studies.discrepancy.search.readings import Repeats, SpecimenReadings
from spinepipe.studies.discrepancy.search.search_state import needed_of
from spinepipe.studies.discrepancy.settings import Discrepancy
from spinepipe.studies.discrepancy.store import at_once
from spinepipe.studies.discrepancy.verdict import REPEATS
from spinepipe.units import COORDINATES, ROTATIONS, to_si, without_step_0


@dataclass(frozen=True)
class Prospect:
    """What planned tests could tell of an effect of one size.

    Attributes
    ----------
    gap : misfit that it makes, in SD of one reading. times : its typical strength; None where these
        tests cannot show it. lead : expected log evidence over ``rival``, its nearest; the rival
        is empty where that is the base alone.
    probability : that it is named. further_run, with_run : the run of the menu, one cycle on each
        specimen, that makes this most probable, and to how much. why : it cannot be shown.
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
    made = _gaps_of_one_reading(ready, tried, judged)
    # times its typical strength at each gap; as it is usual for effects that these tests do not show
    strengths = [
        {one.effect: gap / made[one.effect] if one.testable else 1.0 for one in judged}
        for gap in gaps
    ]
    now = targets(design, judged)
    with_runs = [
        (run.words, targets(more, judgements(more, needed)))
        for run, more in with_each_run(Bench.of(grounds, ready.declared), tried)
    ]
    prospects = []
    for gap, times in zip(gaps, strengths, strict=True):
        for one in judged:
            name = one.effect
            lead, rival = now[name].lead(times[name]) if name in now else (0.0, "")
            own = named_with(lead)
            best, words = max(
                ((_named(found, name, times[name]), words) for words, found in with_runs),
                key=lambda pair: pair[0],
                default=(own, ""),
            )
            words = words if best > own else ""
            shown = times[name] if one.testable else None
            prospects.append(
                Prospect(name, gap, shown, lead, rival, own, words, max(own, best), one.why)
            )
    means = [
        (words, float(np.mean([_named(found, name, t[name]) for t in strengths for name in t])))
        for words, found in with_runs
    ]
    return PlannedExperiment(tuple(prospects), tuple(sorted(means, key=lambda one: -one[1])))


def named_with(lead: float) -> float:
    """Probability that noise leaves more than `LEAD` of an expected lead."""
    return float(norm.cdf((lead - LEAD) / np.sqrt(2.0 * lead))) if lead > 0.0 else 0.0


def _named(found: dict[str, Target], name: str, times: float) -> float:
    return named_with(found[name].lead(times)[0]) if name in found else 0.0


def _gaps_of_one_reading(
    ready: Prepared, tried: Sequence[Trials], judged: Sequence[Judgement]
) -> dict[str, float]:
    """Misfit of each typical effect in SD of one reading, with the base refitted to it."""
    readings = tuple(
        replace(one, tests=tuple(replace(t, cycles=t.cycles[:1]) for t in one.tests))
        for one in ready.readings
    )
    exact = replace(ready.noise, accuracy=np.zeros(6))
    grounds = fit_base(replace(ready, readings=readings, noise=exact), at_once)
    design: CohortSignatures = cohort_signatures(grounds, tried)
    found = {}
    for number, one in enumerate(judged):
        form = typical_form(design, number, one.best.form)
        found[one.effect] = float(np.sqrt(form.squared(form.refitted) / design.freedom))
    return found


def as_planned(
    study: Discrepancy, cohort: Cohort, file: ModelFile | None, cycles: int
) -> Prepared:
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
        for case, q in zip(every, Simulated(model, every, zeroed, ()).at(np.zeros(0)).readings):
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
