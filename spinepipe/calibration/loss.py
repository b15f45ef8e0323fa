"""How misfit counts in every fit: the one place where a loss is decided.

All fits (stiffness, missing effects, films, pressures of a trunk) minimise the sum of squares of
what `counted` returns. It is least squares: residuals count as they are. A robust loss rho(r^2)
would return s = sign(r) sqrt(rho(r^2)) and ds/dr here, and nowhere else; costs, regions and
covariances follow (Triggs et al. 2000, section 4.3, doi:10.1007/3-540-44480-7_21). Priors of
unknowns are not readings and stay quadratic.
"""

import numpy as np

from spinepipe.effects.contract import Array


def counted(residuals: Array) -> tuple[Array, Array]:
    """Numbers (N,) whose squares are summed, and their slopes (N,) by the residuals of readings.

    Parameters
    ----------
    residuals : (N,) in SDs of a reading, or in the unit that the fit weighs them in.
    """
    return residuals, np.ones_like(residuals)
