"""Distributions of the factors of a global sensitivity study.

Not part of the package's front: what it imports of the analysis is no business of other kinds.
"""

from spinepipe.sensitivity.global_indices.spread import (
    LogNormal,
    LogUniform,
    Normal,
    Spread,
    Uniform,
)
from spinepipe.studies.global_sensitivity import GlobalSensitivity
from spinepipe.studies.spreads import AnySpread, Times

__all__ = ["spreads_of"]


def spreads_of(study: GlobalSensitivity) -> tuple[Spread, ...]:
    """(D,) how each value is spread: m, rad, or a multiplier; the dummy's from 0 to 1."""
    own = tuple(_in_si(factor.spread) for factor in study.factors)
    return (*own, Uniform(0.0, 1.0)) if study.dummy else own


def _in_si(spread: AnySpread) -> Spread:
    found = {"low": spread.low, "high": spread.high}
    ends = {name: end / spread.per_si for name, end in found.items() if end is not None}
    times = isinstance(spread, Times)
    if spread.sd is None:
        return LogUniform(**ends) if times else Uniform(**ends)
    if times:
        return LogNormal(spread.middle, spread.sd, **ends)
    return Normal(spread.middle / spread.per_si, spread.sd / spread.per_si, **ends)
