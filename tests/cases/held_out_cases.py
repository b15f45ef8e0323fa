"""Small cohorts for held-out folds: coaxial chains of two joints in pure moments."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import cast

import numpy as np

from spinepipe.effects import PlaceSpread, Wrench, create
from spinepipe.effects.contract import Array
from spinepipe.frames import Pose
from spinepipe.model import Body, LoadCase, LoadStep, ScopedEffect, SpineModel
from spinepipe.studies.discrepancy.search.baseline import (
    BaselineFit,
    BaselineModels,
    base_parameters,
    fit_baseline,
)
from spinepipe.studies.discrepancy.search.gaps import gaps_at, whole_gap
from spinepipe.studies.discrepancy.search.hypothesis import ActiveTerm, CandidateForm, Variant
from spinepipe.studies.discrepancy.search.joint_fit import joint_fit
from spinepipe.studies.discrepancy.search.lack_of_fit import LackOfFit
from spinepipe.studies.discrepancy.search.noise import Noise
from spinepipe.studies.discrepancy.search.nuisance import NuisancePriors
from spinepipe.studies.discrepancy.search.prediction import Simulated
from spinepipe.studies.discrepancy.search.readings import Repeats, SpecimenReadings
from spinepipe.studies.discrepancy.search.search_state import SearchResult
from spinepipe.studies.discrepancy.store import at_once
from spinepipe.units import ROTATIONS

JOINTS = 2
CYCLES = 3
SD = float(np.deg2rad(0.05))
CORRELATION = 0.3
MOMENTS_NM = np.arange(6.0)
AXES = {"flexion": (2, -1.0), "extension": (2, 1.0), "bending": (0, 1.0)}
NONE = NuisancePriors(*[0.0] * 8)
ZONE = CandidateForm(Variant("neutral_zone", ()), PlaceSpread.SHARED)
ZONE_VALUES = np.array([0.6, 0.03, 12.0])


def chain(name: str, nm_per_rad: float, *effects: ScopedEffect) -> SpineModel:
    """Upright joints above one another, nothing weighs."""
    frames = tuple(Pose(np.eye(3), np.array([0.0, 0.03 * j, 0.0])) for j in range(JOINTS))
    bodies = tuple(
        Body(f"L{5 - j}", 0.5, f.origin + np.array([0.0, 0.01, 0.0]), 1e-3 * np.eye(3))
        for j, f in enumerate(frames)
    )
    springs = np.tile([1e5, 1e6, 1e5, nm_per_rad, nm_per_rad, nm_per_rad], (JOINTS, 1))
    bushing = ScopedEffect(create("linear_bushing"), tuple(range(JOINTS)), springs)
    return SpineModel(
        specimen=name,
        joints=("L5S1", "L4L5"),
        frames=frames,
        bodies=bodies,
        gravity=np.zeros(3),
        damping=np.tile([2000.0] * 3 + [10.0] * 3, (JOINTS, 1)),
        effects=(bushing, *effects),
    )


def cases(tests: Sequence[str]) -> list[LoadCase]:
    found = []
    for test in tests:
        axis, sign = AXES[test]
        steps = []
        for step, moment in enumerate(MOMENTS_NM):
            turning = sign * moment * np.eye(3)[axis]
            load = Wrench(JOINTS - 1, np.zeros(3), np.zeros(3), turning)
            steps.append(LoadStep(step, (load,)))
        found.append(LoadCase(test, 1, tuple(steps)))
    return found


def serial(steps: int) -> Array:
    """(T, T) correlation between load steps."""
    result: Array = CORRELATION ** np.abs(np.subtract.outer(np.arange(steps), np.arange(steps)))
    return result


def noise(read: Sequence[str] = ROTATIONS) -> Noise:
    sd = np.array([np.nan] * 3 + [SD if name in read else np.nan for name in ROTATIONS])
    return Noise(sd, CORRELATION, "repeats", np.zeros(6, dtype=np.int64), 0, False)


def noisy(q: Array, rng: np.random.Generator) -> Array:
    """(C, T, J, 6) repeats of q, translations not read."""
    factor = SD * np.linalg.cholesky(serial(len(q)))
    errors = np.einsum("tu,cujk->ctjk", factor, rng.normal(size=(CYCLES, *q.shape)))
    cycles = q + errors
    cycles[..., :3] = np.nan
    return cycles


def read(
    stiffness: Mapping[str, float], tests: Sequence[str], zone: bool, seed: int = 1
) -> tuple[SpecimenReadings, ...]:
    """What specimens with that stiffness in N m/rad show, with a neutral zone or without."""
    rng = np.random.default_rng(seed)
    found = []
    for name, k in stiffness.items():
        law = ScopedEffect(ZONE.variant.create(), (0, 1), np.tile(ZONE_VALUES, (JOINTS, 1)))
        model = chain(name, k, *([law] if zone else []))
        seen = Simulated(model, cases(tests), False, ()).at(np.zeros(0)).readings
        pairs = zip(cases(tests), seen, strict=True)
        repeats = tuple(Repeats(case, noisy(q, rng)) for case, q in pairs)
        found.append(SpecimenReadings(name, model.frames, repeats))
    return tuple(found)


def grounds(readings: Sequence[SpecimenReadings], priors: NuisancePriors = NONE) -> BaselineFit:
    models = {one.specimen: chain(one.specimen, 50.0) for one in readings}
    base = {name: base_parameters(m, "per_specimen", ROTATIONS) for name, m in models.items()}
    return fit_baseline(readings, noise(), priors, BaselineModels(models, base, 100.0), at_once)


def found(base: BaselineFit, zone: bool, spread: PlaceSpread = PlaceSpread.SHARED) -> SearchResult:
    """A search that ended with a neutral zone, or with nothing."""
    final = base
    if zone:
        guess = ActiveTerm(replace(ZONE, spread=spread), np.array([0.4, 0.04, 12.0]))
        final = base.at(joint_fit(base.suppose((guess,)), base.setting))
    return SearchResult(
        base=base,
        final=final,
        standing=(),
        stages=(),
        probabilities={},
        sets=(),
        with_tables=None,
        lack=cast(LackOfFit, None),  # nothing that is held out asks for it
        unfitted=0.0,
        base_gap=whole_gap(base, base.fit),
        final_gap=whole_gap(final, final.fit),
        base_at=gaps_at(base, base.fit),
        final_at=gaps_at(final, final.fit),
    )
