"""Anything read off the laws of fitted joints, and how it follows each fitted value.

Each value is moved a little both ways and the number read off again; with the covariance of the fit
that makes an interval (delta method).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from spinepipe.calibrate.profile import NORMAL_95
from spinepipe.effects import Effect
from spinepipe.effects.contract import Array, JointLaw, PathLaw
from spinepipe.model import SpineModel
from spinepipe.statics import with_parameters
from spinepipe.studies.discrepancy.search.joint_fit import JointFit
from spinepipe.studies.discrepancy.search.model_files import covariance
from spinepipe.studies.discrepancy.verdict import EVERY

STEP = 0.05
"""Standard errors that a fitted value is moved by."""

Laws = list[tuple[Effect, Array]]


def laws_at(model: SpineModel, joint: int) -> Laws:
    """Laws of a joint in all tests, with their parameters (P,), in order."""
    return [
        (one.effect, one.values[one.joints.index(joint) if one.effect.per_joint else 0])
        for one in model.effects
        if isinstance(one.effect, JointLaw | PathLaw) and joint in one.joints
        if one.tests == EVERY
    ]


@dataclass(frozen=True)
class JointNumbers:
    """Numbers (N,) of one joint of a specimen; NaN where one is not there.

    Attributes
    ----------
    slopes : (N, m) by all unknowns of the fit. at_bound : (N,) whether it hangs on one at a bound.
    """

    values: Array
    slopes: Array
    at_bound: Array


def mean_of(ones: Sequence[JointNumbers], number: int, spread: Array) -> tuple[float, float | None]:
    """Mean of a number over joints, and half its 95 % interval.

    None where the number comes and goes within the errors.

    Parameters
    ----------
    spread : (m, m) covariance of the unknowns.
    """
    value = float(np.mean([one.values[number] for one in ones]))
    slope = np.mean([one.slopes[number] for one in ones], axis=0)
    variance = float(slope @ spread @ slope)
    return value, NORMAL_95 * float(np.sqrt(variance)) if np.isfinite(variance) else None


def told(
    fit: JointFit,
    specimens: Sequence[str],
    joint: str,
    read: Callable[[Sequence[Laws]], list[Array]],
) -> dict[str, JointNumbers]:
    """Numbers by specimen, read off where the fit stands and beside it.

    Parameters
    ----------
    read : (N,) numbers of each of many joints, whose laws it is given.
    """
    errors = np.sqrt(np.diagonal(covariance(fit)))
    asked: list[tuple[str, int | None, float]] = []
    curves: list[Laws] = []
    for specimen in specimens:
        member = fit.hypothesis.members[specimen]
        at = fit.models[specimen].joints.index(joint)
        own = fit.x[list(member.numbers)]
        here = laws_at(with_parameters(member.model, member.free, own), at)
        asked.append((specimen, None, 0.0))
        curves.append(here)
        for place, unknown in enumerate(member.numbers):
            limits = fit.hypothesis.unknowns[unknown]
            for side in (-1.0, 1.0):
                to = np.clip(own[place] + side * STEP * errors[unknown], limits.low, limits.high)
                there = laws_at(
                    with_parameters(member.model, member.free, _with(own, place, to)), at
                )
                if any(np.any(a != b) for (_, a), (_, b) in zip(here, there, strict=True)):
                    asked.append((specimen, unknown, float(to - own[place])))
                    curves.append(there)
    found = read(curves)
    return {
        specimen: _one(fit, specimen, asked, found)
        for specimen, unknown, _ in asked
        if unknown is None
    }


def _with(x: Array, place: int, value: float) -> Array:
    changed = x.copy()
    changed[place] = value
    return changed


def _one(
    fit: JointFit, specimen: str, asked: Sequence[tuple[str, int | None, float]], read: list[Array]
) -> JointNumbers:
    values = next(
        found
        for (name, unknown, _), found in zip(asked, read, strict=True)
        if name == specimen and unknown is None
    )
    beside: dict[int, list[tuple[float, Array]]] = {}
    for (name, unknown, away), found in zip(asked, read, strict=True):
        if name == specimen and unknown is not None:
            beside.setdefault(unknown, []).append((away, found))
    slopes, at_bound = np.zeros((len(values), len(fit.x))), np.zeros(len(values), dtype=bool)
    for unknown, sides in beside.items():
        (low, first), (high, last) = sides if len(sides) == 2 else ((0.0, values), sides[0])
        slopes[:, unknown] = (last - first) / (high - low)
        at_bound |= fit.at_bound[unknown] & (slopes[:, unknown] != 0.0)
    return JointNumbers(values, slopes, at_bound)
