"""Draw a design. Sampling is SALib's; the same seed gives the same design."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from SALib.sample import fast_sampler, latin, sobol
from SALib.sample.morris import morris

from spinepipe.effects.contract import Array
from spinepipe.sensitivity.global_indices.design import DUMMY, Design, Method
from spinepipe.sensitivity.global_indices.run_count import design_problems


def draw(
    method: str,
    factors: Sequence[str],
    samples: int,
    seed: int,
    *,
    groups: Sequence[str | None] | None = None,
    second_order: bool = True,
    levels: int = 4,
    harmonics: int = 4,
    dummy: bool = False,
) -> Design:
    """A design of the factors.

    Parameters
    ----------
    method, samples, second_order, levels, harmonics : see `Design`. Sobol points are scrambled
        (scipy's generator), and their number is a power of two. Morris trajectories are not
        selected for spread: selected ones are no independent draws to bootstrap.
    groups : group of each factor, None for a factor alone; for Sobol and Morris.
    dummy : whether a last factor `DUMMY` that changes nothing is added.

    Raises
    ------
    ValueError
        With all that stands against the design.
    """
    names = (*factors, DUMMY) if dummy else tuple(factors)
    given = tuple(groups) if groups is not None else (None,) * len(factors)
    given = (*given, None) if dummy else given
    wrong = design_problems(method, names, given, samples, levels, harmonics)
    if wrong:
        raise ValueError("; ".join(wrong))
    own = tuple(name if g is None else g for name, g in zip(names, given, strict=True))
    bare = Design(
        Method(method), names, own, np.empty((0, len(names))), samples, seed,
        second_order, levels, harmonics,
    )  # fmt: skip
    return Design(**{**vars(bare), "unit": _points(bare)})


def salib_problem(design: Design) -> dict[str, Any]:
    """SALib's description of the unit cube; a new one for each call, for SALib writes into it."""
    problem: dict[str, Any] = {
        "num_vars": len(design.factors),
        "names": list(design.factors),
        "bounds": [[0.0, 1.0]] * len(design.factors),
    }
    if design.groups != design.factors:
        problem["groups"] = list(design.groups)
    return problem


def _points(design: Design) -> Array:
    """(n, D) points; all of SALib's samplers that are used."""
    problem, samples, seed = salib_problem(design), design.samples, design.seed
    if design.method is Method.SOBOL:
        order = design.second_order
        return sobol.sample(problem, samples, calc_second_order=order, seed=seed)
    if design.method is Method.LATIN_HYPERCUBE:
        return latin.sample(problem, samples, seed=seed)
    if design.method is Method.MORRIS:
        return morris.sample(problem, samples, num_levels=design.levels, seed=seed)
    return fast_sampler.sample(problem, samples, M=design.harmonics, seed=seed)
