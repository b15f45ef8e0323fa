"""Folds fitted anew: the full simulator, from where the full fit ended, on the training alone."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from spinepipe.discrepancy.grounds import Grounds
from spinepipe.discrepancy.hypothesis import Hypothesis, Member
from spinepipe.discrepancy.joint_fit import JointFit, Setting, joint_fit
from spinepipe.discrepancy.proof.chosen import only
from spinepipe.discrepancy.proof.fold_linear import Placed, own_unknowns
from spinepipe.discrepancy.proof.folds import Part
from spinepipe.discrepancy.proof.tangent import LinearModel
from spinepipe.discrepancy.tasks import Run
from spinepipe.discrepancy.whitening import whitening, with_nuisances
from spinepipe.effects.contract import Array, Indices
from spinepipe.statics import moved


class NoFold(RuntimeError):
    """A fold's fit has no start; the message says why."""


def refitted(grounds: Grounds, linear: LinearModel, part: Part, run: Run) -> Placed:
    """The scored specimens as fits to the training have them.

    Parameters
    ----------
    linear : the grounds' fit to first order; its nuisances are used.

    Raises
    ------
    NoFold
        When a fit has no start.
    """
    hypothesis = grounds.fit.hypothesis
    count = len(hypothesis.unknowns)
    free, x = np.arange(count), np.zeros(count)
    if part.apart is None:
        _, fit = _fitted(grounds, linear, part, list(hypothesis.members), free, x, run)
    else:
        numbers = {
            name: np.array(one.numbers, dtype=np.int64) for name, one in hypothesis.members.items()
        }
        own = own_unknowns(numbers, part.apart)
        others = [name for name in hypothesis.members if name != part.apart]
        # own values stay at the full fit: no training tells them yet, priors would switch them off
        x, _ = _fitted(grounds, linear, part, others, np.setdiff1d(free, own), x, run)
        _, fit = _fitted(grounds, linear, part, [part.apart], own, x, run)
    nuisances = {name: _nuisances(grounds, linear, part, name, fit) for name in part.scored}
    return Placed({name: fit.predicted[name] for name in part.scored}, nuisances)


def _fitted(
    grounds: Grounds,
    linear: LinearModel,
    part: Part,
    specimens: Sequence[str],
    free: Indices,
    x: Array,
    run: Run,
) -> tuple[Array, JointFit]:
    """Moves from the full fit after a fit of the free unknowns, others as in x; and that fit."""
    start = _again(grounds.fit, linear, specimens, free, x)
    readings, whitenings = {}, {}
    for name in specimens:
        one, steps = grounds.readings[name], part.training[name]
        tests = tuple(only(test, there) for test, there in zip(one.tests, steps, strict=True))
        readings[name] = replace(one, tests=tests)
        plain = whitening(tests, grounds.noise)
        whitenings[name] = with_nuisances(plain, linear.members[name].nuisances)
    fit = run(joint_fit, start, Setting(readings, whitenings, grounds.noise.zeroed))
    if not fit.usable:
        raise NoFold(fit.status)
    ended = x.copy()
    ended[free] += fit.x
    return ended, fit


def _again(
    fit: JointFit, linear: LinearModel, specimens: Sequence[str], free: Indices, x: Array
) -> Hypothesis:
    """The fit's hypothesis of some specimens, started where it ended, moved by x."""
    order = {int(number): place for place, number in enumerate(free)}
    members = {}
    for name in specimens:
        one = fit.hypothesis.members[name]
        kept = [k for k, number in enumerate(one.numbers) if number in order]
        members[name] = Member(
            moved(fit.models[name], one.free, x[list(one.numbers)]),
            tuple(one.free[k] for k in kept),
            tuple(order[one.numbers[k]] for k in kept),
        )
    unknowns = tuple(
        replace(
            fit.hypothesis.unknowns[number],
            low=float(linear.low[number] - x[number]),
            high=float(linear.high[number] - x[number]),
            mean=float(linear.mean[number] - x[number]),
        )
        for number in free
    )
    return Hypothesis(members, unknowns, fit.hypothesis.supposed)


def _nuisances(
    grounds: Grounds, linear: LinearModel, part: Part, specimen: str, fit: JointFit
) -> tuple[Array, ...]:
    """What the nuisances add per test (T, J, 6), at their most likely values in the training."""
    moves = linear.members[specimen].nuisances
    pairs = zip(grounds.readings[specimen].tests, part.training[specimen], strict=True)
    tests = [only(test, there) for test, there in pairs]
    plain = whitening(tests, grounds.noise)
    left = [
        np.nan_to_num(test.mean - seen)
        for test, seen in zip(tests, fit.predicted[specimen], strict=True)
    ]
    columns, residual = plain.noise_only(moves), plain.noise_only(left)
    inner = np.eye(columns.shape[1]) + columns.T @ columns
    z = np.linalg.solve(inner, columns.T @ residual)
    return tuple(moved_by @ z for moved_by in moves)
