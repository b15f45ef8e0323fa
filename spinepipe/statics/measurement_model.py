"""What an instrument reads of joints, when that hangs on more than each joint's own motion.

Some instruments follow the neighbouring joints too, or drift while a test goes on
(`spinepipe.effects.contract.MeasurementBeside`); all others read joint by joint.
"""

import numpy as np

from spinepipe.effects import MeasurementEffect, Observation
from spinepipe.effects.contract import Array, MeasurementBeside, MeasurementContext
from spinepipe.model import LoadCase

Instrument = MeasurementEffect | MeasurementBeside


def share_passed(case: LoadCase) -> Array:
    """(T,) share of a test that has passed at each load step: of its time, else of its steps."""
    clock, times = 0.0, []
    for step in case.steps:
        clock = clock if step.time is None else step.time
        times.append(clock)
    along = np.array(times) - times[0]
    if along[-1] <= 0.0:
        along = np.arange(len(times), dtype=float)
    found: Array = along / max(float(along[-1]), 1.0 if len(times) == 1 else 0.0)
    return found


def measurement_context(motion: Array, passed_at: Array | float) -> MeasurementContext:
    """What stands beside every joint of lanes, of motion (..., J, 6); flat, (N J, 6) and (N J,).

    Parameters
    ----------
    passed_at : (...) share of the test that has passed on each lane.
    """
    above, below = np.zeros(motion.shape), np.zeros(motion.shape)
    above[..., :-1, :], below[..., 1:, :] = motion[..., 1:, :], motion[..., :-1, :]
    share = np.broadcast_to(np.asarray(passed_at)[..., None], motion.shape[:-1])
    return MeasurementContext(above.reshape(-1, 6), below.reshape(-1, 6), share.reshape(-1))


def read(
    effect: Instrument, q: Array, values: Array, around: MeasurementContext | None
) -> Observation:
    """What an instrument reports of joints (K, 6).

    Raises
    ------
    ValueError
        Where it must know what stands beside, and is not told.
    """
    if not isinstance(effect, MeasurementBeside):
        return effect.observe(q, values)
    return effect.observe_beside(q, values, _known(effect, around))


def read_by(
    effect: Instrument, q: Array, values: Array, around: MeasurementContext | None
) -> Array:
    """(K, 6, P) derivative of what it reports by its parameters."""
    if not isinstance(effect, MeasurementBeside):
        return effect.by_parameter(q, values)
    return effect.by_parameter_beside(q, values, _known(effect, around))


def reading_derivative(seen: Observation, by_x: Array, around: tuple[Array, Array] | None) -> Array:
    """(K, 6, m) what is reported by unknowns, from what those do to the true motion.

    Parameters
    ----------
    by_x : (K, 6, m) of the joints themselves. around : the same of the joints above and below.
    """
    found: Array = seen.by_coordinate @ by_x
    if around is None:
        return found
    for by_other, other in zip((seen.by_above, seen.by_below), around, strict=True):
        if by_other is not None:
            found = found + by_other @ other
    return found


def _known(effect: Instrument, around: MeasurementContext | None) -> MeasurementContext:
    if around is None:
        raise ValueError(f"{effect.name} reads by the load step: say which one")
    return around
