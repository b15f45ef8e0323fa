"""Values of fitted effects with their 95 % intervals, in the units of tables and reports."""

from dataclasses import dataclass

import numpy as np

from spinepipe.discrepancy.joint_fit import JointFit
from spinepipe.effects.contract import Array
from spinepipe.units import DEG_PER_RAD, MM_PER_M

NORMAL_95 = 1.959964

BORDER = {
    "rad": ("deg", DEG_PER_RAD),
    "m": ("mm", MM_PER_M),
    "m/rad": ("mm/deg", MM_PER_M / DEG_PER_RAD),
}
"""Unit inside to unit and factor outside; all other units stay."""


@dataclass(frozen=True)
class FittedValue:
    """One fitted number. ``place``: specimen, joint or test it is of; empty for all."""

    name: str
    place: tuple[str, ...]
    value: float
    low: float
    high: float
    unit: str
    at_bound: bool


def border(unit: str, value: float) -> tuple[float, str]:
    """A value in the unit of tables, and that unit."""
    name, factor = BORDER.get(unit, (unit, 1.0))
    return value * factor, name


def standard_errors(fit: JointFit) -> Array:
    """(m,) of all unknowns, priors counted in."""
    jacobian = fit.whole_jacobian()
    precision = jacobian.T @ jacobian + np.diag([u.sd**-2.0 for u in fit.hypothesis.unknowns])
    return np.sqrt(np.diagonal(np.linalg.inv(precision)))


def fitted_values(fit: JointFit, number: int) -> tuple[FittedValue, ...]:
    """All fitted values of one supposed effect."""
    errors = standard_errors(fit)
    supposed = fit.hypothesis.supposed[number]
    parameters = supposed.form.variant.create().parameters
    found = []
    for index, unknown in enumerate(fit.hypothesis.unknowns):
        if unknown.supposed == number:
            p, start = parameters[unknown.column], supposed.start[unknown.column]
            ends = fit.x[index] + errors[index] * NORMAL_95 * np.array([0.0, -1.0, 1.0])
            values = start * np.exp(ends) if p.logarithmic else start + ends
            inside = np.clip(values, p.low, p.high)
            (value, unit), low, high = border(p.unit, inside[0]), inside[1], inside[2]
            low, high = border(p.unit, low)[0], border(p.unit, high)[0]
            at_bound = bool(fit.at_bound[index])
            found.append(
                FittedValue(
                    p.name, unknown.place, float(value), float(low), float(high), unit, at_bound
                )
            )
    return tuple(found)
