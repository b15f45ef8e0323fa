"""Estimates of several indices at once, as the methods hand them to `indices`."""

from dataclasses import dataclass

import numpy as np

from spinepipe.effects.contract import Array


@dataclass(frozen=True, eq=False)
class Estimated:
    """C indices of K outputs.

    Attributes
    ----------
    names : (C,) of index, factor, and second factor of a pair (else empty).
    estimate : (C, K). ends : (2, C, K), or None where the method has no interval.
    note : what a reader of all these must know.
    """

    names: tuple[tuple[str, str, str], ...]
    estimate: Array
    ends: Array | None
    note: str = ""


NOTHING = Estimated((), np.empty((0, 0)), None)
"""No index of no output."""
