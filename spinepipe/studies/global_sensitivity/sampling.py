"""The design of a study: its points, drawn from its seed, and the values of factors at them."""

from functools import lru_cache

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.files import Stamp, stamp
from spinepipe.sensitivity_analysis.global_indices.design import Design, draw
from spinepipe.sensitivity_analysis.global_indices.spread import (
    Distribution,
    LogNormal,
    LogUniform,
    Normal,
    Uniform,
    values_of,
)
from spinepipe.studies.global_sensitivity.factors import AnySpread, Times
from spinepipe.studies.global_sensitivity.settings import GlobalSensitivity
from spinepipe.tables import read


def design_of(study: GlobalSensitivity) -> Design:
    """The design that the study's seed gives."""
    own = study.design
    groups = tuple(factor.group for factor in study.factors)
    return draw(
        own.method,
        tuple(factor.label for factor in study.factors),
        own.samples,
        study.seed,
        groups=groups if any(groups) else None,
        second_order=own.second_order,
        levels=own.levels,
        harmonics=own.harmonics,
        dummy=study.dummy,
    )


def drawn_in_units(study: GlobalSensitivity) -> Array:
    """(n, D) values of all samples as ``design.parquet`` has them: mm, deg or multipliers."""
    values: Array = values_of(design_of(study), spreads_of(study)) * np.array(study.per_si)
    return values


def spreads_of(study: GlobalSensitivity) -> tuple[Distribution, ...]:
    """(D,) how each value is spread: m, rad, or a multiplier; the dummy's from 0 to 1."""
    own = tuple(_in_si(factor.spread) for factor in study.factors)
    return (*own, Uniform(0.0, 1.0)) if study.dummy else own


def _in_si(spread: AnySpread) -> Distribution:
    found = {"low": spread.low, "high": spread.high}
    ends = {name: end / spread.per_si for name, end in found.items() if end is not None}
    times = isinstance(spread, Times)
    if spread.sd is None:
        return LogUniform(**ends) if times else Uniform(**ends)
    if times:
        return LogNormal(spread.middle, spread.sd, **ends)
    return Normal(spread.middle / spread.per_si, spread.sd / spread.per_si, **ends)


def factor_values(path: str, study: GlobalSensitivity, part: slice) -> Array:
    """(n, D) values of some samples of ``design.parquet``, m, rad or multipliers."""
    result: Array = _values(stamp(path), len(study.factor_names))[part] / np.array(study.per_si)
    return result


@lru_cache(maxsize=2)
def _values(where: Stamp, factors: int) -> Array:
    column = read(where[0], ["value"]).column("value")
    values: Array = column.to_numpy().reshape(-1, factors)
    return values
