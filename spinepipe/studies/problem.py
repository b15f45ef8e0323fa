"""What kinds of study fit of a specimen: the stiffness of its bushings, to its measured motion.

A kind builds the model, brings the readings into the model's joint frames, says what is free and
what counts, and may add unknowns of its own. Bounds of a stiffness are those of the study, of all
other unknowns those that their effects declare.
"""

from collections.abc import Sequence

import numpy as np

from spinepipe.calibration import Problem
from spinepipe.cohort.measured import MeasuredCycle
from spinepipe.effects.contract import Array
from spinepipe.frames import Pose
from spinepipe.model import MeasuredCase, SpineModel
from spinepipe.statics import FreeParameter, free_parameters
from spinepipe.units import COORDINATES, STIFFNESS_COLUMNS

BUSHING = 0
"""Place of the bushings among the effects of a model."""


def measured_in_frames(
    tested: Sequence[MeasuredCycle], nominal: Sequence[Pose], frames: Sequence[Pose]
) -> tuple[MeasuredCycle, ...]:
    """Cycles whose readings are brought from one set of joint frames into another."""
    return tuple(one.in_frames(nominal, frames) for one in tested)


def stiffness_problem(
    model: SpineModel,
    cases: Sequence[MeasuredCase],
    coordinates: Sequence[str],
    grouping: str,
    bound_factor: float,
    weights: Array,
    further: tuple[FreeParameter, ...] = (),
    further_sd: Array | None = None,
    correlated: bool = False,
    along_bounds: bool = False,
) -> Problem:
    """The fit of a model's bushings to measured cases, with further unknowns behind.

    Parameters
    ----------
    cases : with readings in the joint frames of the model, NaN where none enters the cost.
    coordinates : whose stiffness is free. grouping : see `free_parameters`.
    bound_factor : stiffness lies between start / factor and start x factor.
    weights : (6,) per mm2 and deg2.
    further_sd : SD of the prior of each further unknown, infinite for none; None: no unknown has
        a prior.
    correlated, along_bounds : see `Problem`.
    """
    columns = [STIFFNESS_COLUMNS[COORDINATES.index(name)] for name in coordinates]
    stiffness = free_parameters(model, BUSHING, columns, grouping)
    reach = np.full(len(stiffness) + len(further), np.inf)
    reach[: len(stiffness)] = np.log(bound_factor)
    prior_sd = None
    if further_sd is not None:
        prior_sd = np.concatenate([np.full(len(stiffness), np.inf), further_sd])
    return Problem(
        model=model,
        cases=tuple(cases),
        free=(*stiffness, *further),
        weights=weights,
        lower=-reach,
        upper=reach,
        correlated=correlated,
        along_bounds=along_bounds,
        prior_sd=prior_sd,
    )
