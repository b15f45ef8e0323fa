"""Indices from FAST curves, by SALib."""

import numpy as np
from numpy.typing import NDArray
from SALib.analyze import fast

from spinepipe.effects.contract import Array
from spinepipe.sensitivity.global_indices.design import Design
from spinepipe.sensitivity.global_indices.estimated import Estimated

NO_INTERVAL = "FAST has no interval: its one curve per factor cannot be resampled"


def fast_indices(design: Design, outputs: Array, whole: NDArray[np.bool_]) -> Estimated:
    """S1 and ST of each factor whose curve is whole.

    Parameters
    ----------
    outputs : (n, K), read only on whole curves. whole : (D,) bool.

    A curve that does not vary has indices of 0. There are no intervals: errors of FAST are
    bias (few harmonics, interference) more than scatter. SALib's own, of which it warns, held 60
    to 100 % of known indices where 95 % were asked (tests/validation/results/index_coverage.md),
    and Student's t over eight curves of other phases fewer.
    """
    curves = outputs.reshape(len(design.factors), design.samples, -1)
    kept = [at for at in range(len(design.factors)) if whole[at]]
    found = np.array([[_one(curve, design.harmonics) for curve in curves[at].T] for at in kept])
    estimate = np.moveaxis(found.reshape(len(kept), -1, 2), 2, 0)
    names = tuple((index, design.factors[at], "") for index in ("S1", "ST") for at in kept)
    return Estimated(names, estimate.reshape(len(names), -1), None, NO_INTERVAL)


def _one(curve: Array, harmonics: int) -> tuple[float, float]:
    """S1 and ST of one curve.

    SALib's `analyze` is not called: it always resamples, which seeds numpy for the whole process
    and divides 0 by 0 where half a curve does not vary.
    """
    if np.ptp(curve) == 0.0:
        return 0.0, 0.0
    own = (len(curve) - 1) // (2 * harmonics)  # frequency of the curve's factor
    with np.errstate(invalid="ignore"):
        found = fast.compute_orders(curve, len(curve), harmonics, own)
    first, total = (float(value) if np.isfinite(value) else 0.0 for value in found)
    return first, total
