"""How indices settle as a design grows."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from spinepipe.sensitivity_analysis.global_indices.design import Design, Method
from spinepipe.sensitivity_analysis.global_indices.estimates import SensitivityIndex, Settings
from spinepipe.sensitivity_analysis.global_indices.indices import FEWEST, indices, names_of


@dataclass(frozen=True)
class DesignStage:
    """Indices from part of a design: how many base samples, trajectories or points, how many runs
    with those that failed, and the indices."""

    samples: int
    runs: int
    indices: tuple[SensitivityIndex, ...]


def convergence(
    design: Design,
    outputs: ArrayLike,
    ok: ArrayLike | None = None,
    settings: Settings | None = None,
    sizes: int = 8,
    resolution: ArrayLike = 0.0,
    whole: Sequence[SensitivityIndex] = (),
) -> tuple[DesignStage, ...]:
    """Indices but for those of pairs on growing parts of a design, the whole last.

    Parameters
    ----------
    outputs, ok, settings, resolution : as for `indices`.
    sizes : at most so many parts (1 or more), each twice the one before; fewer where they would be
        too small.
    whole : what `indices` makes of all of it, where that is known already.

    Parts of a Sobol design are its first base samples, powers of two, each of them as well spread
    as a design of its own; of Morris the first trajectories. The first points of a Latin hypercube
    are no Latin hypercube: its parts are nested random subsets (settings' seed), which scatter a
    little more than a hypercube of their size. A FAST curve has no parts: one stage.
    """
    settings = settings or Settings()
    asked = {index for index, _, other in names_of(design) if not other and settings.asks(index)}
    settings = replace(settings, wanted=tuple(sorted(asked)))
    values = np.asarray(outputs, dtype=np.float64)
    good = np.ones(design.n, dtype=bool) if ok is None else np.asarray(ok, dtype=bool)
    if design.method is Method.LATIN_HYPERCUBE:
        # the first points of a hypercube are none: a random order makes nested subsets
        order = np.random.default_rng([settings.seed, design.n]).permutation(design.n)
        design = replace(design, unit=design.unit[order])
        values, good, whole = values[order], good[order], ()
    # halves of halves of the samples, smallest first
    halves = {design.samples >> step for step in range(sizes)}
    least = FEWEST.get(design.method, design.samples)  # a FAST curve has no parts
    grown = sorted(n for n in halves if n == design.samples or n >= least)
    stages, known = [], tuple(one for one in whole if one.index in asked and not one.other)
    for samples in grown:
        part = design.first(samples)
        found = known if samples == design.samples else ()
        found = found or indices(part, values[: part.n], good[: part.n], settings, resolution)
        stages.append(DesignStage(samples, part.n, found))
    return tuple(stages)
