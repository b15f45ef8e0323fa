"""The design of a study: drawn from its seed, and read again from its file."""

from functools import lru_cache

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.files import Stamp, stamp
from spinepipe.sensitivity.global_indices.design import Design, draw
from spinepipe.sensitivity.global_indices.spread import values_of
from spinepipe.studies.global_sensitivity.settings import GlobalSensitivity, spreads_of
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


def drawn_values(path: str, study: GlobalSensitivity, part: slice) -> Array:
    """(n, D) values of some samples of ``design.parquet``, m, rad or multipliers."""
    result: Array = _values(stamp(path), len(study.factor_names))[part] / np.array(study.per_si)
    return result


@lru_cache(maxsize=2)
def _values(where: Stamp, factors: int) -> Array:
    column = read(where[0], ["value"]).column("value")
    values: Array = column.to_numpy().reshape(-1, factors)
    return values
