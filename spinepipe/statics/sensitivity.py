"""Exact sensitivities of solved steps: dq/dx = -K^-1 dr/dx, path states carried along.

Every derivative is taken at the solved pose with the tangent's LU factors that Newton left.
"""

from collections.abc import Sequence

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.statics.free import FreeParameter
from spinepipe.statics.holding import ActivePath, Law
from spinepipe.statics.path import SolvedStep
from spinepipe.statics.system import System


def by_parameters(
    system: System, solved: Sequence[SolvedStep], free: Sequence[FreeParameter]
) -> list[Array]:
    """(n, m) derivative of each step's pose by the m unknowns.

    Raises
    ------
    ValueError
        When a step has no equilibrium.
    """
    starts = system.initial_states().of
    state_by_x = {index: np.zeros((*s.shape, len(free))) for index, s in starts.items()}
    result = []
    for step in solved:
        residual = residual_by_parameters(system, step, free, state_by_x)
        dq = -step.factored.solve(residual)
        result.append(dq)
        state_by_x = _advance(system, step, free, dq, state_by_x)
    return result


def residual_by_parameters(
    system: System,
    step: SolvedStep,
    free: Sequence[FreeParameter],
    state_by_x: dict[int, Array],
) -> Array:
    """(n, m) derivative of the residual at fixed pose by the unknowns."""
    q = step.equilibrium.q
    derivatives = system.derivatives(q, step.states)
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
    placed = system.placed(step.equilibrium.q, with_parameters=True)
    joints_by_x = np.einsum(
        "jab,jbm->jam", placed.by_coordinate, dq.reshape(len(dq) // 6, 6, len(free))
    )
    joints_by_x += _placement_by_x(system, placed.by_parameter, free)
    carried_by_x = _carried(system, step, free, placed.q, joints_by_x, state_by_x)
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


def _placement_by_x(
    system: System, by_parameter: dict[int, tuple[Array, Array]], free: Sequence[FreeParameter]
) -> Array:
    """(J, 6, m) derivative of the coordinates seen by the laws by geometry parameters."""
    result = np.zeros((system.model.n_joints, 6, len(free)))
    for column, parameter in enumerate(free):
        if parameter.effect in by_parameter:
            dq = by_parameter[parameter.effect][0]
            weights = parameter.derivative(system.model.effects[parameter.effect].values)
            result[:, :, column] = dq[:, :, list(parameter.rows), parameter.column] @ weights
    return result


def observe(system: System, q: Array) -> Array:
    """Reported coordinates (J, 6) at pose q (n,): what the measurement effects make of it."""
    joints = q.reshape(-1, 6).copy()
    for active in system.measurement:
        joints[active.joints] = active.effect.observe(joints[active.joints], active.values).q
    return joints


def observed_by_parameters(
    system: System, q: Array, dq: Array, free: Sequence[FreeParameter]
) -> Array:
    """(J, 6, m) derivative of the reported coordinates by the unknowns, at pose q (n,)."""
    joints = q.reshape(-1, 6).copy()
    by_x = dq.reshape(len(joints), 6, dq.shape[1]).copy()
    for active in system.measurement:
        here = joints[active.joints]
        seen = active.effect.observe(here, active.values)
        own = active.effect.by_parameter(here, active.values)
        by_x[active.joints] = seen.by_coordinate @ by_x[active.joints]
        for column, parameter in enumerate(free):
            if parameter.effect == active.index:
                rows = _joints_moved(parameter, active.per_joint)
                weights = parameter.derivative(active.values)
                moved = own[rows, :, parameter.column] * weights[:, None]
                by_x[active.joints[rows], :, column] += moved
        joints[active.joints] = seen.q
    return by_x


def _joints_moved(parameter: FreeParameter, per_joint: bool) -> list[int] | slice:
    """Joints in scope that an unknown moves: its rows, or all where one row is shared."""
    return list(parameter.rows) if per_joint else slice(None)
