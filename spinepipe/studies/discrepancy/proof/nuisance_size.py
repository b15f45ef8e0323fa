"""How large the nuisances of this cohort are, of what their priors allow.

A search holds them as large as their priors say, so that they never pose as physics. A prediction
of motion not seen wants them as large as they are: their size is the most likely one of a few,
given what the final model leaves (empirical Bayes).
"""

import numpy as np

from spinepipe.discrepancy.grounds import Grounds

SIZES = np.array([0.03, 0.1, 0.2, 0.35, 0.6, 1.0])
"""Of one prior SD."""


def nuisance_size(grounds: Grounds) -> float:
    """Most likely size of the nuisances beside the grounds' fit, in prior SDs."""
    likelihood = np.zeros(len(SIZES))
    for name, one in grounds.readings.items():
        full, plain = grounds.setting.whitenings[name], grounds.plain[name]
        predicted = grounds.fit.predicted[name]
        errors = [
            np.nan_to_num(seen - test.mean) for seen, test in zip(predicted, one.tests, strict=True)
        ]
        along = full.directions.T @ plain.noise_only(errors)
        variance = 1.0 + np.outer(SIZES, full.sizes) ** 2
        likelihood -= 0.5 * np.sum(np.log(variance) + along**2 / variance, axis=1)
    return float(SIZES[np.argmax(likelihood)])
