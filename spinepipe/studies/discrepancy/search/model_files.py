"""Fitted models as model files, and fitted values in units of tables."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from spinepipe.effects import PlaceSpread
from spinepipe.effects.contract import Array
from spinepipe.model import ScopedEffect, SpineModel
from spinepipe.model.file import EffectEntry, ModelFile, Scope, Values
from spinepipe.studies.discrepancy.search.hypothesis import CandidateForm
from spinepipe.studies.discrepancy.search.joint_fit import JointFit
from spinepipe.studies.discrepancy.verdict import EVERY
from spinepipe.units import DEG_PER_RAD, MM_PER_M

DISPLAY_UNITS = {
    "rad": ("deg", DEG_PER_RAD),
    "m": ("mm", MM_PER_M),
    "m/rad": ("mm/deg", MM_PER_M / DEG_PER_RAD),
}
"""Unit inside to unit and factor in tables; all other units stay."""


@dataclass(frozen=True)
class FittedValue:
    """One fitted number. ``place``: specimen, joint or test it is of; empty for all."""

    name: str
    place: tuple[str, ...]
    value: float
    unit: str
    at_bound: bool


def model_file(
    fit: JointFit,
    name: str,
    cohort: str,
    base: Sequence[tuple[str, ...]] = (EVERY,),
    given: Mapping[str, int] = MappingProxyType({}),
) -> ModelFile:
    """The models of all specimens in one file.

    Parameters
    ----------
    base : specimens of each effect that the base has, in front of the supposed ones.
    given : how many effects of each specimen come between these, as the cohort's loads say: the
        file leaves them out, as whoever reads it has the cohort.
    """
    entries = []
    after = dict.fromkeys(fit.models, 0)
    for specimens in base:
        acting = {n: m for n, m in fit.models.items() if specimens == EVERY or n in specimens}
        scoped = {n: m.effects[after[n]] for n, m in acting.items()}
        if scoped:
            entries.append(_of_scoped(acting, scoped, specimens))
        for specimen in acting:
            after[specimen] += 1
    # `after`: the next effect of each specimen's model, which stand base, given, supposed
    for specimen in after:
        after[specimen] += given.get(specimen, 0)
    for supposed in fit.hypothesis.supposed:
        acting = {n: m for n, m in fit.models.items() if supposed.form.acts_in(n)}
        copies = _copies(supposed.form, acting, after)
        for copy in range(copies):
            scoped = {n: m.effects[after[n] + copy] for n, m in acting.items()}
            own = EVERY if supposed.form.specimen is None else (supposed.form.specimen,)
            entries.append(_of_scoped(acting, scoped, own))
        for specimen in acting:
            after[specimen] += copies
    return ModelFile(model=name, cohort=cohort, effects=tuple(entries))


def _of_scoped(
    models: Mapping[str, SpineModel],
    scoped: Mapping[str, ScopedEffect],
    specimens: tuple[str, ...],
) -> EffectEntry:
    """One effect of the file from what each specimen has of it."""
    first = next(iter(scoped.values()))
    joints = next(iter(models.values())).joints
    acting = tuple(joints[j] for j in first.joints)
    names = [p.name for p in first.effect.parameters]
    options = {
        key: list(value) if isinstance(value, tuple) else value
        for key, value in vars(first.effect).items()
        if not key.startswith("_")
    }
    return EffectEntry(
        effect=first.effect.name,
        options=options,
        scope=Scope(
            specimens=specimens,
            joints=EVERY if len(acting) == len(joints) else acting,
            tests=first.tests,
        ),
        values=tuple(_rows(scoped, acting, names)),
    )


def _rows(
    scoped: Mapping[str, ScopedEffect], joints: Sequence[str], names: Sequence[str]
) -> list[Values]:
    """Rows of values: one where all are the same, else by specimen, else by joint too."""
    stacked = np.stack([one.values for one in scoped.values()])
    if np.all(stacked == stacked[0, 0]):
        return [_row("*", "*", names, stacked[0, 0])]
    rows = []
    for specimen, values in zip(scoped, stacked, strict=True):
        if np.all(values == values[0]):
            rows.append(_row(specimen, "*", names, values[0]))
        else:
            pairs = zip(joints, values, strict=True)
            rows += [_row(specimen, joint, names, of_joint) for joint, of_joint in pairs]
    return rows


def _row(specimen: str, joint: str, names: Sequence[str], values: Sequence[float]) -> Values:
    numbers = {name: float(value) for name, value in zip(names, values, strict=True)}
    return Values(specimen=specimen, joint=joint, **numbers)


def _copies(form: CandidateForm, models: Mapping[str, SpineModel], after: Mapping[str, int]) -> int:
    """One copy of the effect, or one per test that it tells apart."""
    if form.spread is not PlaceSpread.BY_TEST:
        return 1
    name, model = next(iter(models.items()))
    behind = model.effects[after[name] :]
    tests: list[tuple[str, ...]] = []
    for scoped in behind:
        if scoped.effect != behind[0].effect or scoped.tests in tests or scoped.tests == EVERY:
            break
        tests.append(scoped.tests)
    return len(tests)


def fitted_values(fit: JointFit, number: int) -> tuple[FittedValue, ...]:
    """All fitted values of one supposed effect."""
    own = [k for k, u in enumerate(fit.hypothesis.unknowns) if u.supposed == number]
    parameters = fit.hypothesis.supposed[number].form.variant.create().parameters
    found = []
    for index in own:
        unknown = fit.hypothesis.unknowns[index]
        value, unit = in_tables(fit, index, fit.x[index])
        name, at_bound = parameters[unknown.column].name, bool(fit.at_bound[index])
        found.append(FittedValue(name, unknown.place, value, unit, at_bound))
    return tuple(found)


def in_tables(fit: JointFit, index: int, move: float) -> tuple[float, str]:
    """What an unknown of a supposed effect is where it has moved, in the unit of tables."""
    unknown = fit.hypothesis.unknowns[index]
    assert unknown.supposed is not None
    supposed = fit.hypothesis.supposed[unknown.supposed]
    p, start = supposed.form.variant.create().parameters[unknown.column], supposed.start
    at = float(start[unknown.column])
    value = at * float(np.exp(move)) if p.logarithmic else at + float(move)
    return display_value(p.unit, float(np.clip(value, p.low, p.high)))


def display_value(unit: str, value: float) -> tuple[float, str]:
    """A value in the unit of tables, and that unit."""
    name, factor = DISPLAY_UNITS.get(unit, (unit, 1.0))
    return value * factor, name


def covariance(fit: JointFit) -> Array:
    """(m, m) of all unknowns, priors counted in."""
    # Gauss-Newton: inverse of the curvature of half chi2 and of the priors
    jacobian = fit.whole_jacobian()
    precision = jacobian.T @ jacobian + np.diag([u.sd**-2.0 for u in fit.hypothesis.unknowns])
    return np.asarray(np.linalg.inv(precision), dtype=np.float64)
