"""An investigation from beginning to end: readings, base, search, data errors, proof, verdict."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.cohort.cohort import sd_of_reading
from spinepipe.cohort.supports import motion_read
from spinepipe.effects.contract import Array
from spinepipe.model.file import ModelFile
from spinepipe.progress import Progress
from spinepipe.studies.discrepancy.mistakes.data_errors import suspected_errors
from spinepipe.studies.discrepancy.mistakes.swapped_specimens import swapped_pairs
from spinepipe.studies.discrepancy.proof.held_out import HeldOut, held_out
from spinepipe.studies.discrepancy.search.baseline import (
    PER_SPECIMEN,
    BaselineFit,
    BaselineModels,
    NoBase,
    base_model,
    base_parameters,
    fit_baseline,
)
from spinepipe.studies.discrepancy.search.gaps import gaps_at, whole_gap
from spinepipe.studies.discrepancy.search.hypothesis import trials
from spinepipe.studies.discrepancy.search.joint_fit import JointFit, joint_fit
from spinepipe.studies.discrepancy.search.noise import (
    Noise,
    estimated_noise,
    without_outliers,
)
from spinepipe.studies.discrepancy.search.nuisance import as_si
from spinepipe.studies.discrepancy.search.outcome import (
    MUCH,
    Outcome,
    cannot_be_excluded,
    left_of,
    outcome,
)
from spinepipe.studies.discrepancy.search.prediction import solve_on_record
from spinepipe.studies.discrepancy.search.readings import SpecimenReadings, specimen_readings
from spinepipe.studies.discrepancy.search.search import search
from spinepipe.studies.discrepancy.search.search_state import Rules, SearchResult
from spinepipe.studies.discrepancy.settings import Discrepancy
from spinepipe.studies.discrepancy.store import PieceRunner
from spinepipe.studies.discrepancy.verdict import DECLARED, SuspectedError, VerdictKind
from spinepipe.studies.discrepancy.verdict_unnamed import Reason
from spinepipe.units import COORDINATE_COLUMNS, COORDINATES, to_si

GUESSED_SD = np.array([1e-3] * 3 + [np.deg2rad(1.0)] * 3)
"""For the first fit of a cohort that declares no SD and whose cycles differ in their loads."""


@dataclass(frozen=True, eq=False)
class Prepared:
    """A study and what it takes of its cohort, read once.

    Attributes
    ----------
    file : the model file that the study starts from, if it does.
    coordinates : those with readings, of those that the study uses.
    measured : all readings that the study uses, of specimens that have any.
    readings, noise : the same without outliers, and their noise.
    declared : (6,) m and rad, SD of one reading as the study or the cohort declares it, or None.
    """

    study: Discrepancy
    cohort: Cohort
    file: ModelFile | None
    coordinates: tuple[str, ...]
    measured: tuple[SpecimenReadings, ...]
    readings: tuple[SpecimenReadings, ...]
    noise: Noise
    declared: Array | None


@dataclass(frozen=True)
class Investigation:
    """What was found, what speaks for it, and what it comes to."""

    grounds: BaselineFit
    rules: Rules
    found: SearchResult
    errors: tuple[SuspectedError, ...]
    proof: HeldOut
    ended: Outcome

    def for_verdict(self) -> "Investigation":
        """With the base in the place of a model whose effects the verdict does not stand for."""
        if self.ended.named or self.ended.tied:
            return self
        found = replace(self.found, final=self.found.base, final_gap=self.found.base_gap)
        return replace(self, found=found, proof=self.proof.of_base())


def prepare(study: Discrepancy, cohort: Cohort, file: ModelFile | None) -> Prepared:
    """Readings and noise of a study, before anything is fitted."""
    motion = motion_read(cohort)
    motion = motion[motion["test"].isin(list(study.tests or cohort.tests))]
    coordinates = tuple(
        name
        for name, column in zip(COORDINATES, COORDINATE_COLUMNS, strict=True)
        if name in (study.coordinates or COORDINATES) and motion[column].notna().any()
    )
    sd, stated = cohort.reading_sd(study.measurement_sd), study.measurement_sd
    declared = None if sd is None else to_si(sd)
    # what all cycles of a test share is an error of its own, so the scatter is told without it
    scatter = None if sd is None else to_si(sd_of_reading(stated or cohort.measurement_sd, None))
    accuracy = to_si(cohort.accuracy_sd)
    # in an order of their own: how a cohort lists them says nothing, and changes no verdict
    tests, names = sorted(study.tests or cohort.tests), sorted(cohort.specimen_names)
    every = (specimen_readings(cohort, s, tests, coordinates) for s in names)
    measured = tuple(one for one in every if one.tests)
    readings, outliers = without_outliers(measured)
    noise = estimated_noise(readings, scatter, cohort.zeroed_at_step_0, outliers, accuracy)
    if noise is None:  # cycles of unequal loads may still tell, once the base is fitted
        noise = estimated_noise(readings, GUESSED_SD, cohort.zeroed_at_step_0, outliers, accuracy)
    assert noise is not None
    return Prepared(study, cohort, file, coordinates, measured, readings, noise, declared)


def investigate(
    ready: Prepared,
    run: PieceRunner,
    progress: Progress | None = None,
    until: float | None = None,
) -> Investigation:
    """All that decides the verdict of a study.

    Parameters
    ----------
    until : when the clock ends the search, see `Posterior.explore`.

    Raises
    ------
    NoBase
        When the base has no fit, or nothing tells how large the noise is.
    """
    study, cohort = ready.study, ready.cohort
    specimens, joints = sorted(cohort.specimen_names), len(cohort.joint_names)
    baseline = fit_base(ready, run)
    errors = suspected_errors(baseline, ready.measured)
    rules = Rules(
        trials(study.effects, ready.coordinates, specimens, joints),
        ready.coordinates,
        study.most_effects,
        # data that look wrong are no physics: nothing will be named, and a fit may take for ever
        0 if errors else study.most_fits[study.effort],
    )
    found = search(baseline, rules, run, progress, until)
    on_record([found.base.fit, found.final.fit], baseline.readings, run)
    # a model of the wrong shape says nothing of specimens that changed places
    if not errors and left_of(found) <= MUCH:
        errors = tuple(swapped_pairs(baseline, run, rules.trials, found))
    proof = run(held_out, found.base, found.final)
    # by each standing effect, others that what was recorded cannot exclude, if they are tried
    cases = {name: one.cases for name, one in found.base.readings.items()}
    not_excluded = {
        effect.name: tuple(
            name
            for name in cannot_be_excluded(effect.name, cases)
            if study.effects is None or name in study.effects
        )
        for effect in found.standing
    }
    ended = outcome(found, proof, errors, not_excluded)
    told = Investigation(baseline, rules, found, errors, proof, ended)
    return _with_sure_effects(told, run)


def _with_sure_effects(one: Investigation, run: PieceRunner) -> Investigation:
    """Fitted and held out again without effects that stood and are doubted beside sure ones."""
    # what the verdict stands for, for certain or in a set of names that cannot be told apart
    sure = {id(effect) for effect in one.ended.named}
    kept = [e for e in one.found.standing if e.name in one.ended.tied or id(e) in sure]
    if not kept or len(kept) == len(one.found.standing):
        return one
    final = one.found.final
    fit = run(joint_fit, final.suppose([e.supposed for e in kept]), final.setting, final.fit.poses)
    if not fit.usable:
        return one
    final = final.at(fit)
    gap, at = whole_gap(final, fit), gaps_at(final, fit)
    if gap.rms > MUCH:  # beside so much nothing is certain
        names = " and ".join(dict.fromkeys(e.name for e in kept))
        why = f"{names} would explain a part, but {gap.rms:.1f} noise SD stay"
        ended = Outcome(VerdictKind.UNKNOWN, why, reason=Reason.A_PART_STAYS)
        return replace(one, ended=ended)
    standing = tuple(kept)
    found = replace(one.found, final=final, standing=standing, final_gap=gap, final_at=at)
    on_record([fit], one.grounds.readings, run)
    return replace(one, found=found, proof=run(held_out, found.base, final))


def on_record(
    fits: Sequence[JointFit], readings: Mapping[str, SpecimenReadings], run: PieceRunner
) -> None:
    """Solve all that fits predict by the engine of record, specimen by specimen.

    Raises
    ------
    Disagreement
        Where it differs by more than rounding.
    """
    models = [(name, model) for fit in fits for name, model in fit.models.items()]
    run.map(solve_on_record, [(model, readings[name].cases) for name, model in models])


def fit_base(ready: Prepared, run: PieceRunner) -> BaselineFit:
    """Baseline with the base fitted."""
    study = ready.study
    start = np.array(study.stiffness.in_order(), dtype=float)
    models = {
        one.specimen: base_model(ready.cohort, one, start, ready.file) for one in ready.readings
    }
    grouping = study.base.stiffness or PER_SPECIMEN
    base = {
        name: base_parameters(model, grouping, ready.coordinates) for name, model in models.items()
    }
    begin = BaselineModels(models, base, study.bound_factor)
    baseline = fit_baseline(
        ready.readings, ready.noise, as_si(study.nuisance.model_dump()), begin, run
    )
    if baseline.noise.source == DECLARED and ready.declared is None:
        raise NoBase("too few repeated readings to tell the noise: state measurement_sd")
    return baseline
