"""ROS34PW2: four-stage, third-order, L-stable linearly implicit method for approximate Jacobians.

Coefficients: Rang and Angermann 2005, BIT 45:761-787, doi 10.1007/s10543-005-0035-y. A W-method
keeps its order when the Jacobian is only approximate, so the mass matrix may be taken as constant
within a step although it follows the pose.
"""

import numpy as np

GAMMA = 4.3586652150845900e-01

ALPHA = np.array(
    [
        [0.0, 0.0, 0.0, 0.0],
        [8.7173304301691801e-01, 0.0, 0.0, 0.0],
        [8.4457060015369423e-01, -1.1299064236484185e-01, 0.0, 0.0],
        [0.0, 0.0, 1.0, 0.0],
    ]
)
"""(4, 4) weights of earlier stages in the point at which a stage is evaluated."""

COUPLING = np.array(
    [
        [0.0, 0.0, 0.0, 0.0],
        [-8.7173304301691801e-01, 0.0, 0.0, 0.0],
        [-9.0338057013044082e-01, 5.4180672388095326e-02, 0.0, 0.0],
        [2.4212380706095346e-01, -1.2232505839045147e00, 5.4526025533510214e-01, 0.0],
    ]
)
"""(4, 4) weights of earlier stages in the Jacobian term (gamma_ij, j < i)."""

WEIGHTS = np.array([2.4212380706095346e-01, -1.2232505839045147e00, 1.5452602553351020e00, GAMMA])
EMBEDDED = np.array(
    [
        3.7810903145819369e-01,
        -9.6042292212423178e-02,
        5.0000000000000000e-01,
        2.1793326075422950e-01,
    ]
)
ERROR_WEIGHTS = WEIGHTS - EMBEDDED
"""(4,) the third-order result less the embedded second-order one."""

STAGE_TIMES = ALPHA.sum(axis=1)
TIME_WEIGHTS = COUPLING.sum(axis=1) + GAMMA
"""(4,) weight of the load's rate of change in each stage."""
