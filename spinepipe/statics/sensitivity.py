"""Exact sensitivities of solved steps: dq/dx = -K^-1 dr/dx, path states carried along.

The unknowns x are free parameters: which numbers of a model's effects a fit moves, and which of
them together. Every derivative is taken at the solved pose with the tangent's LU factors that
Newton left.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from spinepipe.effects import Parameter
from spinepipe.effects.contract import Array, MeasurementContext
from spinepipe.model import SpineModel
from spinepipe.statics.joint_forces import ActivePath, Law
from spinepipe.statics.joint_kinematics import Active
from spinepipe.statics.measurement_model import (
    Instrument,
    measurement_context,
    read,
    read_by,
    reading_derivative,
    share_passed,
)
from spinepipe.statics.path import SolvedStep
from spinepipe.statics.system import System


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
        by_logarithm: Array = values[list(self.rows), self.column]
        return by_logarithm if self.logarithmic else np.ones(len(self.rows))


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


def with_parameters(model: SpineModel, free: Sequence[FreeParameter], x: Array) -> SpineModel:
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


def by_parameters(
    system: System, solved: Sequence[SolvedStep], free: Sequence[FreeParameter]
) -> list[Array]:
    """(n, m) derivative of each step's pose by the m unknowns.

    Raises
    ------
    ValueError
        When a step has no equilibrium.
    """
    return [dq for _, dq, _ in step_by_step(system, solved, free)]


def step_by_step(
    system: System, solved: Sequence[SolvedStep], free: Sequence[FreeParameter]
) -> Iterator[tuple[SolvedStep, Array, dict[int, Array]]]:
    """Each step, the derivative (n, m) of its pose, and those of the states that it began with."""
    starts = system.initial_states().of
    state_by_x = {index: np.zeros((*s.shape, len(free))) for index, s in starts.items()}
    for step in solved:
        residual = unsupported_by_parameters(system, step, free, state_by_x)
        residual[system.fixed] = 0.0  # a coordinate that a rig fixes stays, whatever is missing
        dq = -step.factored.solve(residual)
        yield step, dq, state_by_x
        state_by_x = _advance(system, step, free, dq, state_by_x)


def reactions_by(
    system: System, solved: Sequence[SolvedStep], free: Sequence[FreeParameter]
) -> list[Array]:
    """(n, m) derivative of each step's reaction by the m unknowns.

    Raises
    ------
    ValueError
        When a step has no equilibrium.
    """
    result = []
    for step, dq, state_by_x in step_by_step(system, solved, free):
        found = np.zeros(dq.shape)
        tangent = system.unsupported(step.equilibrium.q, step.loading, step.states).tangent
        own = unsupported_by_parameters(system, step, free, state_by_x)
        found[system.fixed] = (own + tangent @ dq)[system.fixed]
        result.append(found)
    return result


def unsupported_by_parameters(
    system: System,
    step: SolvedStep,
    free: Sequence[FreeParameter],
    state_by_x: dict[int, Array],
) -> Array:
    """(n, m) derivative, at fixed pose, of what the joints hold less what is applied."""
    q = step.equilibrium.q
    derivatives = system.derivatives(q, step.states)
    # derivative by every parameter of every effect, (n, R, P) of each; unknowns pick from them
    table = {
        i: d.reshape(system.chain.n, *d.shape[2:]) for i, d in derivatives.by_parameter.items()
    }
    for active in system.load_effects:
        table[active.index] = system.load_derivative(q, step.loading, active)
    columns = np.zeros((system.chain.n, len(free)))
    for column, parameter in enumerate(free):
        if parameter.effect in table:
            rows = list(parameter.rows)
            weights = parameter.derivative(system.model.effects[parameter.effect].values)
            columns[:, column] = table[parameter.effect][:, rows, parameter.column] @ weights
    for index, by_state in derivatives.by_state.items():
        flat = by_state.reshape(system.chain.n, -1)
        columns += flat @ state_by_x[index].reshape(flat.shape[1], -1)
    return columns


def _advance(
    system: System,
    step: SolvedStep,
    free: Sequence[FreeParameter],
    dq: Array,
    state_by_x: dict[int, Array],
) -> dict[int, Array]:
    """Derivatives of the states after the step: by pose, parameter, earlier state and carried."""
    if not step.advances:
        return {}
    kinematics = system.joint_kinematics(step.equilibrium.q, by_parameters=True)
    joints_by_x = np.einsum(
        "jab,jbm->jam", kinematics.by_coordinate, dq.reshape(len(dq) // 6, 6, len(free))
    )
    # of geometry parameters: what they move under the laws while the pose stays
    moved = np.zeros_like(joints_by_x)
    for column, parameter in enumerate(free):
        if parameter.effect in kinematics.by_parameter:
            by_own = kinematics.by_parameter[parameter.effect][0]
            weights = parameter.derivative(system.model.effects[parameter.effect].values)
            moved[:, :, column] = by_own[:, :, list(parameter.rows), parameter.column] @ weights
    joints_by_x += moved
    carried_by_x = _carried(system, step, free, kinematics.q, joints_by_x, state_by_x)
    following = {}
    for law in system.paths:
        after = step.advances[law.index]
        by_x = np.einsum("jsa,jam->jsm", after.by_coordinate, joints_by_x[law.joints])
        by_x += np.einsum("jst,jtm->jsm", after.by_state, state_by_x[law.index])
        if after.by_carried is not None:
            by_x += after.by_carried @ carried_by_x[law.index]
        _add_own(by_x, after.by_parameter, law, free)
        following[law.index] = by_x
    return following


def _carried(
    system: System,
    step: SolvedStep,
    free: Sequence[FreeParameter],
    q: Array,
    joints_by_x: Array,
    state_by_x: dict[int, Array],
) -> dict[int, Array]:
    """(J, 6, m) derivative of what each path law is carried, where its state depends on that."""
    readers = [i for i, after in step.advances.items() if after.by_carried is not None]
    result: dict[int, Array] = {}
    load, load_by_x = np.zeros_like(q), np.zeros_like(joints_by_x)
    for law in system.laws if readers else ():
        j, carried, carried_by_x = law.joints, load[law.joints], load_by_x[law.joints]
        if law.index in readers:
            result[law.index] = carried_by_x
        response = law.respond(q[j], carried, step.states)
        by_x = response.tangent @ joints_by_x[j]
        if response.by_carried is not None:
            by_x += response.by_carried @ carried_by_x
        if isinstance(law, ActivePath):
            by_x += law.by_state(q[j], carried, step.states) @ state_by_x[law.index]
        _add_own(by_x, law.by_parameter(q[j], carried, step.states), law, free)
        load[j] += response.load
        load_by_x[j] += by_x
    return result


def _add_own(by_x: Array, by_parameter: Array, law: Law, free: Sequence[FreeParameter]) -> None:
    """Add to (J, …, m) what a law's own unknowns do, from its derivative (J, …, P)."""
    for column, parameter in enumerate(free):
        if parameter.effect == law.index:
            rows = _joints_moved(parameter, law.per_joint)
            own = by_parameter[rows, :, parameter.column]
            by_x[rows, :, column] += own * parameter.derivative(law.values)[:, None]


def observe(system: System, q: Array, place: int | None = None) -> Array:
    """Reported coordinates (J, 6) at pose q (n,): what the measurement effects make of it.

    Parameters
    ----------
    place : of the load step in its test, for instruments that drift or follow other joints.

    Raises
    ------
    ValueError
        Where such an instrument is not told the load step.
    """
    joints = q.reshape(-1, 6).copy()
    for active in system.measurement:
        around = _beside(system, active, joints, place)
        here = joints[active.joints]
        joints[active.joints] = read(active.effect, here, active.values, around).q
    return joints


def _beside(
    system: System, active: Active[Instrument], joints: Array, place: int | None
) -> MeasurementContext | None:
    """What stands beside the joints in scope (J, 6); None where no load step is told."""
    if place is None:
        return None
    every = measurement_context(joints, share_passed(system.case)[place])
    at = active.joints
    return MeasurementContext(every.above[at], every.below[at], every.passed[at])


def observed_by_parameters(
    system: System, q: Array, dq: Array, free: Sequence[FreeParameter], place: int | None = None
) -> Array:
    """(J, 6, m) derivative of the reported coordinates by the unknowns, at pose q (n,)."""
    joints = q.reshape(-1, 6).copy()
    by_x = dq.reshape(len(joints), 6, dq.shape[1]).copy()
    for active in system.measurement:
        here, around = joints[active.joints], _beside(system, active, joints, place)
        seen = read(active.effect, here, active.values, around)
        own = read_by(active.effect, here, active.values, around)
        neighbours = np.zeros((2, len(joints), *by_x.shape[1:]))
        neighbours[0, :-1], neighbours[1, 1:] = by_x[1:], by_x[:-1]
        above, below = neighbours[:, active.joints]
        by_x[active.joints] = reading_derivative(seen, by_x[active.joints], (above, below))
        for column, parameter in enumerate(free):
            if parameter.effect == active.index:
                rows = _joints_moved(parameter, active.per_joint)
                weights = parameter.derivative(active.values)
                by_parameters = own[rows, :, parameter.column] * weights[:, None]
                by_x[active.joints[rows], :, column] += by_parameters
        joints[active.joints] = seen.q
    return by_x


def _joints_moved(parameter: FreeParameter, per_joint: bool) -> list[int] | slice:
    """Joints in scope that an unknown moves: its rows, or all where one row is shared."""
    return list(parameter.rows) if per_joint else slice(None)
