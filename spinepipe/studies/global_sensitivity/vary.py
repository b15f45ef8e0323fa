"""A specimen with the values of factors: many spines, and each test of all of them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinepipe.cohort.varied.change import Change
from spinepipe.cohort.varied.frames import varied_frames
from spinepipe.cohort.varied.loads import varied_cases
from spinepipe.cohort.varied.start import Start
from spinepipe.cohort.varied.variation import variation
from spinepipe.effects.contract import Array
from spinepipe.model import ScopedEffect
from spinepipe.statics.many.spines import Cases, Spines


@dataclass(frozen=True, eq=False)
class Varied:
    """Spines of a specimen, for those of the samples that make a spine.

    Attributes
    ----------
    spines : K of them.
    cases : of each of the specimen's tests, of these K spines.
    kept : (K,) which sample each is.
    refused : the other samples, and why they make no spine.
    """

    spines: Spines
    cases: tuple[Cases, ...]
    kept: NDArray[np.int64]
    refused: dict[int, str]


def vary(start: Start, changes: Sequence[Change], values: Array) -> Varied:
    """Give factors their values.

    Landmarks are moved first; the joint frames that they make are then moved along their own axes
    and turned. A mass takes its inertia along. Loads keep their points when bodies are moved.

    Parameters
    ----------
    changes : D factors; several that change the same add up.
    values : (M, D) m, rad or factors, by sample.
    """
    values = np.asarray(values, dtype=float)
    total = variation(changes, values, start.model.joints, start.vertebrae)
    frames = varied_frames(start, total)
    same = Spines.of(start.model, len(values))
    bushing = same.values[0] * total.stiffness
    refused = _out_of_bounds(start.model.effects[0], start.model.joints, bushing) | frames.refused
    spines = Spines(
        like=start.model,
        rotations=frames.rotations,
        origins=frames.origins,
        masses=same.masses * total.masses,
        coms=same.coms + total.coms,
        inertias=same.inertias * total.masses[..., None, None],
        damping=same.damping * total.damping[:, None, None],
        values=(bushing,),
    )
    cases = tuple(varied_cases(test.case, total) for test in start.tests)
    return _of_kept(spines, cases, refused)


def _out_of_bounds(scoped: ScopedEffect, joints: Sequence[str], values: Array) -> dict[int, str]:
    """Samples whose stiffness (M, J, 6) no model may have, each with the first reason."""
    refused: dict[int, str] = {}
    for place, limits in enumerate(scoped.effect.parameters):
        found = values[:, :, place]
        for sample, joint in np.argwhere((found < limits.low) | (found > limits.high)).tolist():
            value = f"{limits.name} is {found[sample, joint]:.6g} {limits.unit}"
            allowed = f"allowed {limits.low:.3g} to {limits.high:.3g}"
            refused.setdefault(sample, f"joint {joints[joint]}: {value}, {allowed}")
    return refused


def _of_kept(spines: Spines, cases: tuple[Cases, ...], refused: dict[int, str]) -> Varied:
    """The spines that are spines."""
    kept = np.setdiff1d(np.arange(len(spines)), list(refused)).astype(np.int64)
    if refused:
        spines = spines.part(kept)
        cases = tuple(case.part(kept) for case in cases)
    return Varied(spines, cases, kept, dict(sorted(refused.items())))
