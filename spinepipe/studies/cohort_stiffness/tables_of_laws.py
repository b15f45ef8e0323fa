"""Columns of laws that stiffen: growth beside each stiffness, and how it spreads in a cohort."""

from spinepipe.tables.schema import Column

_LINEAR = "a linear representation, or no law was found"
_UNIT = "1/rad or 1/m, see growth_unit"
_OPEN = f"{_LINEAR}, the region is open there, or none was looked for"


def _growth(name: str, meaning: str, null: str) -> Column:
    return Column(name, "number", meaning, _UNIT, null, low=0.0)


GROWTH = (
    _growth(
        "growth",
        "how fast this joint stiffens in this coordinate: b of the law k (exp(b |q|) - 1) / b "
        "with k in stiffness, the stiffness at rest; 0 is linear",
        _LINEAR,
    ),
    Column("growth_unit", "text", "unit of growth", null=_LINEAR, allowed=("1/rad", "1/m")),
    _growth(
        "growth_standard_error",
        "standard error of growth, to first order; of a prediction for a new specimen its standard "
        "deviation",
        f"{_LINEAR}, at a bound, or not constrained by the data",
    ),
    _growth(
        "growth_low",
        "lower end of the 95 % region of growth, as of stiffness; 0 where it is open below",
        _OPEN,
    ),
    _growth("growth_high", "upper end of the 95 % region of growth", _OPEN),
    Column(
        "growth_open_below",
        "flag",
        "whether the region reaches 0: the data do not exclude that this joint is linear",
        null=f"{_LINEAR}, or no region was looked for",
    ),
    Column(
        "growth_open_above",
        "flag",
        "whether the region reaches the upper bound of growth",
        null=f"{_LINEAR}, or no region was looked for",
    ),
    Column(
        "growth_identifiable",
        "flag",
        "whether the data hold this growth, see identifiable",
        null=f"{_LINEAR}, or taken from other specimens",
    ),
    Column(
        "growth_at_bound",
        "text",
        "whether the fit ended at a bound of growth; lower: it is linear",
        null=_LINEAR,
        allowed=("no", "lower", "upper"),
    ),
)
"""Of table ``stiffness``."""

GROWTH_CELLS = tuple(column.name for column in GROWTH)


def _spread(name: str, meaning: str) -> Column:
    null = "a linear representation, no fit, or cannot be told apart with this cohort"
    return Column(name, "number", meaning, "1/rad, or 1/m of translations", null)


GROWTH_SPREADS = (
    _spread("growth_centre", "growth in the middle of the cohort; not below zero"),
    _spread("growth_between_levels", "SD of growth between levels, the same in all specimens"),
    _spread("growth_between_specimens", "SD of growth between specimens, the same at all levels"),
    _spread("growth_between_joints", "SD of growth that is left: each joint for itself"),
)
"""Of table ``pooling``."""

SPREAD_CELLS = tuple(column.name for column in GROWTH_SPREADS)
