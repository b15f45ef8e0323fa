"""The base that is asked what it lacks, fitted with noise and nuisances allowed for.

Its joints are linear, alike at all levels or not, or those of a model file.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.cohort.specimen import spine_model
from spinepipe.effects import create
from spinepipe.effects.contract import Array
from spinepipe.model import ScopedEffect, SpineModel
from spinepipe.model.file import ModelFile, effects_for
from spinepipe.statics import FreeParameter, free_parameters
from spinepipe.studies.discrepancy.search.hypothesis import ActiveTerm, Hypothesis, hypothesis
from spinepipe.studies.discrepancy.search.joint_fit import JointFit, Near, Setting, joint_fit
from spinepipe.studies.discrepancy.search.noise import Noise, noise_of_residuals
from spinepipe.studies.discrepancy.search.nuisance import NuisancePriors, nuisance_signatures
from spinepipe.studies.discrepancy.search.prediction import BUSHING, NoEquilibrium, SolvedSpecimen
from spinepipe.studies.discrepancy.search.readings import SpecimenReadings
from spinepipe.studies.discrepancy.search.whitening import Whitening, whitening, with_nuisances
from spinepipe.studies.discrepancy.store import PieceRunner
from spinepipe.studies.discrepancy.verdict import REPEATS
from spinepipe.units import COORDINATES, STIFFNESS_COLUMNS

PER_SPECIMEN = "per_specimen"
DAMPING = np.array([2000.0] * 3 + [10.0] * 3)
"""N s/m and N m s/rad; poses at rest do not hang on it, only the verdict that they are stable."""


def base_model(
    cohort: Cohort,
    readings: SpecimenReadings,
    stiffness: Array,
    file: ModelFile | None,
) -> SpineModel:
    """The model of a specimen where its fit starts: (6,) SI for all joints, or as in the file."""
    joints = cohort.joint_names
    if file is not None:
        effects = effects_for(file, readings.specimen, joints)
    else:
        values = np.tile(stiffness, (len(joints), 1))
        effects = (ScopedEffect(create(BUSHING), tuple(range(len(joints))), values),)
    return spine_model(cohort, readings.specimen, readings.frames, effects, DAMPING)


def base_parameters(
    model: SpineModel, grouping: str, coordinates: Sequence[str]
) -> tuple[FreeParameter, ...]:
    """The stiffnesses that are fitted along with everything: of the coordinates that are read.

    A model file's bushings keep the ratios of their joints: ``per_specimen`` moves them together.
    """
    names = [STIFFNESS_COLUMNS[COORDINATES.index(name)] for name in coordinates]
    bushings = [
        index for index, scoped in enumerate(model.effects) if scoped.effect.name == BUSHING
    ]
    return tuple(
        parameter
        for index in bushings
        for parameter in free_parameters(model, index, names, grouping)
    )


@dataclass(frozen=True)
class BaselineModels:
    """Models where fits start, their free base parameters, and the factor they may move by."""

    models: Mapping[str, SpineModel]
    base: Mapping[str, tuple[FreeParameter, ...]]
    bound: float


@dataclass(frozen=True)
class BaselineFit:
    """What every round of a search shares.

    Attributes
    ----------
    plain : whitening without nuisances. setting : with them, linearised at the base fit before.
    fit : the base, and effects named so far, in that setting.
    """

    readings: Mapping[str, SpecimenReadings]
    noise: Noise
    priors: NuisancePriors
    start: BaselineModels
    tests: tuple[str, ...]
    plain: Mapping[str, Whitening]
    setting: Setting
    fit: JointFit

    def suppose(self, supposed: Sequence[ActiveTerm]) -> Hypothesis:
        """The base as started from, with these effects."""
        start = self.start
        return hypothesis(start.models, start.base, supposed, self.tests, start.bound)

    def at(self, fit: JointFit) -> "BaselineFit":
        """The same where another fit stands; nuisances stay as they move the base's readings.

        Further fits start from the base as it is there: a load that was named may tip over a
        spine as soft as the base was without it.
        """
        models = {
            name: model.with_effects(model.effects[: len(self.start.models[name].effects)])
            for name, model in fit.models.items()
        }
        return replace(self, fit=fit, start=replace(self.start, models=models))


ARRIVED = 0.1
"""Of the logarithm of stiffness: nuisances taken so near to the base need not be taken again."""

MOST_NUISANCES = 5
"""Times that they are taken."""

MOST_BASE_FITS = 5
"""Fits in a row, each from where the last one ended, until the base has arrived."""


class NoBase(RuntimeError):
    """The base model cannot be fitted: nothing can be said of what it lacks."""


def fit_baseline(
    readings: Sequence[SpecimenReadings],
    noise: Noise,
    priors: NuisancePriors,
    start: BaselineModels,
    run: PieceRunner,
) -> BaselineFit:
    """Fit the base, first with noise alone, then with nuisances where the last fit stands.

    Nuisances move a spine as soft as the base says it is, and the base says so with nuisances
    allowed for: fits go on until one has the base where its nuisances were taken.

    Where cycles of a test differ in their loads, the noise is what their residuals differ by.

    Raises
    ------
    NoBase
        When the base has no fit.
    """
    by_name = {one.specimen: one for one in readings}
    tests = tuple(dict.fromkeys(case.test for one in readings for case in one.cases))
    plain = _plain(by_name, noise)
    models = hypothesis(start.models, start.base, (), tests, start.bound)
    # with noise alone; its residuals may say better how large the noise is
    first = _base_fit(models, Setting(by_name, plain, noise.zeroed), run)
    if noise.source != REPEATS:
        by_name, noise = noise_of_residuals(by_name, first.predicted, noise)
        plain = _plain(by_name, noise)
    # a fixed point: nuisances linearised at a fit, the fit with them, until it stays where it is
    fit = first
    for _ in range(MOST_NUISANCES):
        before, whitenings = fit, {}
        for name, one in by_name.items():
            solved = SolvedSpecimen(before.models[name], one.cases, noise.zeroed)
            moved = nuisance_signatures(solved, priors, one.coordinates)
            whitenings[name] = with_nuisances(plain[name], moved)
        setting = Setting(by_name, whitenings, noise.zeroed)
        again = hypothesis(before.models, start.base, (), tests, start.bound)
        fit = _base_fit(again, setting, run)
        if np.abs(fit.x).max(initial=0.0) < ARRIVED:
            break
    start = replace(start, models=fit.models)
    return BaselineFit(by_name, noise, priors, start, tests, plain, setting, fit)


def _plain(readings: Mapping[str, SpecimenReadings], noise: Noise) -> dict[str, Whitening]:
    return {name: whitening(one.tests, noise) for name, one in readings.items()}


def _base_fit(models: Hypothesis, setting: Setting, run: PieceRunner) -> JointFit:
    near: Near = None
    for _ in range(MOST_BASE_FITS):
        fit = run(joint_fit, models, setting, near)
        if not fit.usable:
            # why the models do not stand where their fit starts, if they do not
            for name, member in models.members.items():
                try:
                    SolvedSpecimen(member.model, setting.readings[name].cases, setting.zeroed)
                except NoEquilibrium as trouble:
                    raise NoBase(str(trouble) or fit.status) from None
            raise NoBase(fit.status)
        if not fit.status:
            return fit
        members = {
            name: replace(member, model=fit.models[name]) for name, member in models.members.items()
        }
        models, near = replace(models, members=members), fit.poses
    raise NoBase(fit.status)
