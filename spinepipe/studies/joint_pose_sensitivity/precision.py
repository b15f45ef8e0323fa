"""The precision of an input that keeps an output's error below a limit."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

CONFIDENCE = (2.5, 97.5)


@dataclass(frozen=True)
class Required:
    """The largest SD that will do, with its 95 % interval.

    None where one lies outside the sampled SDs; the message says on which side.
    """

    sd: float | None
    low: float | None
    high: float | None
    message: str


def required_precision(
    sds: Array, errors: Array, limit: float, share: float, bootstraps: int, seed: int
) -> Required:
    """The largest SD at which so large a share of samples has an error below the limit.

    The share is taken as straight between the sampled SDs; the interval is a percentile bootstrap
    over samples, all SDs of a sample together.

    Parameters
    ----------
    sds : (k,) rising. errors : (k, n) of n samples at each SD, infinite where there is no result.
    """
    below = errors < limit
    found = _crossing(sds, below.mean(axis=1), share)
    n = errors.shape[1]
    drawn = np.random.default_rng(seed).integers(0, n, (bootstraps, n))
    repeated = np.array([_crossing(sds, below[:, row].mean(axis=1), share) for row in drawn])
    low, high = np.percentile(repeated, CONFIDENCE, method="inverted_cdf")
    message = _message(sds, found) or _beyond(sds, low, high)
    return Required(_inside(found), _inside(low), _inside(high), message)


def _crossing(sds: Array, below: Array, share: float) -> float:
    """SD at which the share of samples below the limit first falls under the asked one.

    Minus infinity where it is under it from the start, infinity where it never is.
    """
    short = np.flatnonzero(below < share)
    if not len(short):
        return np.inf
    after = int(short[0])
    if after == 0:
        return -np.inf
    fraction = (below[after - 1] - share) / (below[after - 1] - below[after])
    return float(sds[after - 1] + fraction * (sds[after] - sds[after - 1]))


def _inside(sd: float) -> float | None:
    return float(sd) if np.isfinite(sd) else None


def _message(sds: Array, found: float) -> str:
    if found == np.inf:
        return f"{sds[-1]:g} mm will do, the largest that was sampled"
    if found == -np.inf:
        return f"{sds[0]:g} mm will not do, the smallest that was sampled"
    return ""


def _beyond(sds: Array, low: float, high: float) -> str:
    """Which ends of the interval lie outside the sampled SDs, "" for none."""
    ends = [f"begins below {sds[0]:g} mm"] if low == -np.inf else []
    ends += [f"ends above {sds[-1]:g} mm"] if high == np.inf else []
    return f"the interval {' and '.join(ends)}" if ends else ""
