"""How many combinations of the unknowns the data tell, before anything is fitted."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import qr

from spinepipe.calibrate.problem import Evaluator, Problem
from spinepipe.calibrate.uncertainty import RANK_TOLERANCE, declared_deviation
from spinepipe.decomposition import svd
from spinepipe.effects.contract import Array


@dataclass(frozen=True)
class Rank:
    """What the data tell of the unknowns at the start of a fit.

    Attributes
    ----------
    rank : number of independent combinations that are told; None where the start has no pose.
    silent : (m,) which unknowns to leave out so that as many stay as are told, the best told ones.
    message : why there is no rank.
    """

    rank: int | None
    silent: tuple[bool, ...]
    message: str = ""


def rank_at_start(problem: Problem, noise: Array | None, told_below: float) -> Rank:
    """The rank of the Jacobian at the start, in the noise of the readings.

    A combination is told where its standard error is below ``told_below`` typical changes of an
    unknown (of the natural logarithm of a stiffness: 1 is a factor of 2.7). Errors that zeroed
    readings share are left out: they lower a rank nowhere but at its edge.

    Parameters
    ----------
    noise : (6,) m and rad, SD of one reading; None: whatever leaves a trace is told.

    Raises
    ------
    RefusedModel
        Where nothing that was measured has a weight, or the engine refuses the model.
    """
    found = Evaluator(problem).at(np.zeros(len(problem.free)))
    if found.jacobian is None:
        return Rank(None, (False,) * len(problem.free), found.message)
    seen = found.jacobian * problem.scale
    if noise is None:
        least = RANK_TOLERANCE * max(float(np.abs(seen).max(initial=0.0)), np.finfo(float).tiny)
    else:
        seen = seen / declared_deviation(problem, found.coordinate, noise)[:, None]
        least = 1.0 / told_below
    rank = int((svd(seen)[1] > least).sum())
    order = qr(seen, mode="r", pivoting=True)[1]  # the best told first, each beside those before
    silent = np.isin(np.arange(len(order)), order[rank:])
    return Rank(rank, tuple(map(bool, silent)))
