"""Errors of joint centres and axes as nuisances of a fit, each with a normal prior around none.

A nuisance belongs to a specimen: what is fitted predicts this specimen's other load cases. Of a
specimen of which nothing was fitted nothing is known of them, and it is predicted without any.

Nuisances do not tell of stiffness what readings do not tell without them: such stiffness is held. A
moment that no load case applies turns a tilted joint all the same, by tilt over stiffness, and as
small tilts are the likelier ones that stiffness would go to its lower bound.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from spinepipe.calibration import Fit, Problem
from spinepipe.effects import create
from spinepipe.effects.contract import Array
from spinepipe.model import ScopedEffect, SpineModel
from spinepipe.statics import FreeParameter, declared, free_parameters, with_parameters
from spinepipe.studies.cohort_stiffness.representations import EACH_JOINT, named
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness
from spinepipe.units import DEG_PER_RAD, MM_PER_M

Row = dict[str, Any]

CENTRE, AXES = "joint_centre_offset", "axes_tilt"

SHOWN = {"m": ("mm", MM_PER_M), "rad": ("deg", DEG_PER_RAD)}
"""Unit of a parameter: the unit in tables, and how many of it."""


def prior_sds(study: CohortStiffness, representation: str) -> dict[str, float]:
    """Prior SD, m or rad, of each nuisance effect that a representation fits, by its name."""
    if not named(representation).without_nuisances or study.nuisance is None:
        return {}
    asked = study.nuisance
    sds = {CENTRE: asked.centre_mm / MM_PER_M, AXES: asked.axes_deg / DEG_PER_RAD}
    return {effect: sd for effect, sd in sds.items() if sd > 0.0}


def nuisance_effects(
    study: CohortStiffness, representation: str, joints: int
) -> tuple[ScopedEffect, ...]:
    """The nuisance effects of a representation's model, where fits start: all of them off."""
    everywhere = tuple(range(joints))
    made = [create(name, None) for name in prior_sds(study, representation)]
    return tuple(
        ScopedEffect(effect, everywhere, np.zeros((joints, len(effect.parameters))))
        for effect in made
    )


def free_nuisances(
    study: CohortStiffness, model: SpineModel, representation: str, first: int
) -> tuple[tuple[FreeParameter, ...], Array]:
    """Unknowns of the nuisance effects of a model, each joint its own, and their prior SDs (m,).

    Parameters
    ----------
    first : place of the first of these effects in the model.
    """
    found: tuple[FreeParameter, ...] = ()
    sds: list[float] = []
    for place, sd in enumerate(prior_sds(study, representation).values(), first):
        names = [one.name for one in model.effects[place].effect.parameters]
        unknowns = free_parameters(model, place, names, EACH_JOINT)
        found += unknowns
        sds += [sd] * len(unknowns)
    return found, np.array(sds)


def without_nuisances(problem: Problem) -> Problem:
    """The problem with joint centres and axes as stated."""
    kept = [index for index in range(len(problem.free)) if not problem.has_prior(index)]
    free = tuple(problem.free[index] for index in kept)
    lower, upper = problem.lower[kept], problem.upper[kept]
    return replace(problem, free=free, lower=lower, upper=upper, prior_sd=None)


def start_from_plain(problem: Problem, plain: Fit) -> tuple[Problem, str]:
    """The problem from where the fit without nuisances ended, and what is held there, in words.

    Held is stiffness whose standard error without nuisances is too large, see ``identifiable``.

    Parameters
    ----------
    plain : of the problem `without_nuisances`; where it has no pose, all is fitted from the start.
    """
    if not plain.status.usable:
        return problem, ""
    known = plain.uncertainty.identifiable | (plain.at_bound != 0)
    stiffness = [index for index in range(len(problem.free)) if not problem.has_prior(index)]
    x = np.zeros(len(problem.free))  # nuisances start at none
    x[stiffness] = np.where(plain.uncertainty.silent, 0.0, plain.x)
    held = [index for index, told in zip(stiffness, known, strict=True) if not told]
    kept = np.setdiff1d(np.arange(len(x)), held)
    assert problem.prior_sd is not None
    note = f"held as without nuisances: {len(held)} of {len(stiffness)} stiffnesses"
    # Unknowns count from where the model stands now, and so do their bounds.
    return replace(
        problem,
        model=with_parameters(problem.model, problem.free, x),
        free=tuple(problem.free[index] for index in kept),
        lower=(problem.lower - x)[kept],
        upper=(problem.upper - x)[kept],
        prior_sd=problem.prior_sd[kept],
    ), (note if held else "")


def fitted_nuisances(problem: Problem, found: Fit) -> tuple[ScopedEffect, ...]:
    """The nuisance effects of a specimen with the values of its fit; none of a plain fit."""
    places = dict.fromkeys(unknown.effect for unknown in _unknowns(problem).values())
    model = with_parameters(problem.model, problem.free, found.x)
    return tuple(model.effects[place] for place in places)


def nuisance_rows(problem: Problem, found: Fit, joints: Sequence[str]) -> list[Row]:
    """Rows of the table ``nuisances``; none where the fit has no stiffness."""
    if not found.status.usable:
        return []
    rows = []
    for index, unknown in _unknowns(problem).items():
        parameter = declared(problem.model, unknown)
        of_centre = problem.model.effects[unknown.effect].effect.name == CENTRE
        unit, many = SHOWN[parameter.unit]
        assert problem.prior_sd is not None
        value, sd = float(found.values[index]), float(problem.prior_sd[index])
        error = float(found.uncertainty.standard_error[index])
        rows.append(
            {
                "joint": joints[unknown.rows[0]],
                "parameter": f"centre_{parameter.name}" if of_centre else parameter.name,
                "unit": unit,
                "value": value * many,
                "prior_sd": sd * many,
                "standard_error": error * many if np.isfinite(error) else None,
                "pull": value / sd,
            }
        )
    return rows


def _unknowns(problem: Problem) -> dict[int, FreeParameter]:
    """The unknowns that are nuisances, by their number."""
    return {
        index: unknown for index, unknown in enumerate(problem.free) if problem.has_prior(index)
    }
