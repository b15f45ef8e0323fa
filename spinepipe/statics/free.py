"""Free parameters: which numbers of a model's effects a fit moves, and which of them together."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spinepipe.effects import Parameter
from spinepipe.effects.contract import Array
from spinepipe.model import SpineModel


@dataclass(frozen=True)
class FreeParameter:
    """One unknown: a column of an effect's values, moved in one or more rows at once.

    A logarithmic unknown multiplies its rows by ``exp(x)``, others are added, so rows that share
    an unknown keep their ratios (or differences): equal rows stay equal.

    Attributes
    ----------
    label : name used in tables, e.g. ``extension_nm_per_rad`` or ``extension_nm_per_rad@L2L3``.
    effect : place in the model's effects. column, rows : what of its values moves.
    """

    label: str
    effect: int
    column: int
    rows: tuple[int, ...]
    logarithmic: bool

    def derivative(self, values: Array) -> Array:
        """(len(rows),) derivative of the moved values by the unknown."""
        moved: Array = values[list(self.rows), self.column]
        return moved if self.logarithmic else np.ones(len(self.rows))


def free_parameters(
    model: SpineModel, effect: int, names: Sequence[str], grouping: str
) -> tuple[FreeParameter, ...]:
    """Unknowns for named parameters of one effect.

    Parameters
    ----------
    grouping : ``per_specimen`` (one unknown for all joints in scope) or ``per_joint``.

    Raises
    ------
    ValueError
        For an unknown parameter name or grouping.
    """
    scoped = model.effects[effect]
    declared = {p.name: (column, p) for column, p in enumerate(scoped.effect.parameters)}
    unknown = [name for name in names if name not in declared]
    if unknown:
        raise ValueError(f"{scoped.effect.name} has no parameter {unknown[0]!r}: {list(declared)}")
    rows = tuple(range(len(scoped.values)))
    if grouping == "per_specimen":
        groups = [("", rows)]
    elif grouping == "per_joint":
        groups = [(f"@{model.joints[scoped.joints[row]]}", (row,)) for row in rows]
    else:
        raise ValueError(f"grouping {grouping!r}: per_specimen or per_joint")
    return tuple(
        FreeParameter(name + suffix, effect, column, members, parameter.logarithmic)
        for name in names
        for column, parameter in [declared[name]]
        for suffix, members in groups
    )


def declared(model: SpineModel, free: FreeParameter) -> Parameter:
    """The declaration of the parameter an unknown moves."""
    return model.effects[free.effect].effect.parameters[free.column]


def moved(model: SpineModel, free: Sequence[FreeParameter], x: Array) -> SpineModel:
    """The model with its unknowns moved by x from where they are (log or absolute)."""
    values = {p.effect: model.effects[p.effect].values.copy() for p in free}
    for parameter, change in zip(free, x, strict=True):
        at = (list(parameter.rows), parameter.column)
        here = values[parameter.effect]
        here[at] = here[at] * np.exp(change) if parameter.logarithmic else here[at] + change
    effects = tuple(
        scoped.with_values(values[index]) if index in values else scoped
        for index, scoped in enumerate(model.effects)
    )
    return model.with_effects(effects)
