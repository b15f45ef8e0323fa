"""Small spines without weight, in pure moments, whose readings the base makes without error."""

import numpy as np
from scipy.spatial.transform import Rotation

from spinepipe.effects import PlaceSpread, Wrench, create
from spinepipe.frames import Pose
from spinepipe.model import Body, LoadCase, LoadStep, ScopedEffect, SpineModel
from spinepipe.studies.discrepancy.design.distinguishability import not_testable
from spinepipe.studies.discrepancy.design.information import Bench
from spinepipe.studies.discrepancy.design.signatures import cohort_signatures
from spinepipe.studies.discrepancy.design.testable import Judgement, judgements
from spinepipe.studies.discrepancy.search.baseline import (
    DAMPING,
    BaselineFit,
    BaselineModels,
    base_parameters,
    fit_baseline,
)
from spinepipe.studies.discrepancy.search.hypothesis import CandidateForm, Trials, Variant, trials
from spinepipe.studies.discrepancy.search.noise import Noise
from spinepipe.studies.discrepancy.search.nuisance import NuisancePriors
from spinepipe.studies.discrepancy.search.prediction import BUSHING, Simulated
from spinepipe.studies.discrepancy.search.readings import Repeats, SpecimenReadings
from spinepipe.studies.discrepancy.store import at_once
from spinepipe.units import ROTATIONS

STIFFNESS = np.array([1.5e5, 1.5e6, 1.5e5, 60.0, 50.0, 70.0])
UP_AND_DOWN = (0.0, 2.5, 5.0, 7.5, -2.5, -5.0, -7.5)
SPINE = ("L5S1", "L4L5", "L3L4")
AXES = {"flexion": (2, -1.0), "bending": (0, 1.0), "turning": (1, 1.0)}
NEEDED = 6.0
NO_NUISANCE = NuisancePriors(*[0.0] * 8)


def spine_of(joints: int, name: str = "a") -> SpineModel:
    """A lordotic chain without weight."""
    place = range(joints)
    frames = tuple(
        Pose(Rotation.from_euler("z", 10.0 * j, degrees=True).as_matrix(), np.r_[0.0, 0.035 * j, 0])
        for j in place
    )
    bodies = tuple(Body(f"v{j}", 0.0, frames[j].origin, np.zeros((3, 3))) for j in place)
    bushing = ScopedEffect(create(BUSHING), tuple(place), np.tile(STIFFNESS, (joints, 1)))
    damping = np.tile(DAMPING, (joints, 1))
    return SpineModel(name, SPINE[:joints], frames, bodies, np.zeros(3), damping, (bushing,))


def case_of(test: str, joints: int, moments, seconds: float | None = 10.0) -> LoadCase:
    axis, sign = AXES[test]
    steps = []
    for number, moment in enumerate(moments):
        about = np.zeros(3)
        about[axis] = sign * moment
        at = None if seconds is None else seconds * number
        steps.append(LoadStep(number, (Wrench(joints - 1, np.zeros(3), np.zeros(3), about),), at))
    return LoadCase(test, 1, tuple(steps))


def grounds_of(
    joints: int = 3,
    moments=UP_AND_DOWN,
    tests=tuple(AXES),
    seconds: float | None = 10.0,
    grouping: str = "per_specimen",
    zeroed: bool = True,
    sd: float = float(np.deg2rad(0.1)),
    priors: NuisancePriors | None = None,
    specimens: int = 1,
) -> BaselineFit:
    """The grounds of readings that the base makes without error."""
    readings, models = [], {}
    for name in "abc"[:specimens]:
        model = models[name] = spine_of(joints, name)
        cases = [case_of(test, joints, moments, seconds) for test in tests]
        made = Simulated(model, cases, zeroed, ()).at(np.zeros(0)).readings
        for q in made:
            q[..., :3] = np.nan
            if zeroed:
                q[0] = np.nan
        repeats = tuple(Repeats(case, q[None]) for case, q in zip(cases, made, strict=True))
        readings.append(SpecimenReadings(name, model.frames, repeats))
    noise = Noise(np.r_[[np.nan] * 3, [sd] * 3], 0.0, "declared", np.zeros(6, int), 0, zeroed)
    driven = [("extension", "right_bending", "left_rotation")[list(AXES).index(t)] for t in tests]
    base = {name: base_parameters(model, grouping, driven) for name, model in models.items()}
    start = BaselineModels(models, base, 100.0)
    return fit_baseline(readings, noise, priors or NuisancePriors(), start, at_once)


def judged(grounds: BaselineFit, effects) -> dict[str, Judgement]:
    tried = tried_in(grounds, effects) if isinstance(effects[0], str) else effects
    found = judgements(cohort_signatures(grounds, tried), NEEDED)
    return {one.effect: one for one in found}


def tried_in(grounds: BaselineFit, effects) -> tuple[Trials, ...]:
    joints = next(iter(grounds.fit.models.values())).n_joints
    return trials(effects, ROTATIONS, tuple(grounds.readings), joints)


def revealed(grounds: BaselineFit, effect: str) -> str:
    """The test that would tell."""
    tried = tried_in(grounds, [effect])
    found = list(judged(grounds, tried).values())
    (one,) = not_testable(Bench.of(grounds, None), tried, found, NEEDED)
    return one.test_that_would_tell


def only(effect: str, **options) -> Trials:
    """An effect in one variant, the same at all joints."""
    variant = Variant(effect, tuple(options.items()))
    return Trials(effect, (variant,), (CandidateForm(variant, PlaceSpread.SHARED),))
