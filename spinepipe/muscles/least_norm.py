"""The smallest x within bounds that meets a few linear rows, by semismooth Newton on the dual.

Least |x|^2 / 2 subject to rows @ x = required, the last rows >= required, and least <= x <= most.
With multipliers y of the rows, x = clip(rows.T @ y, least, most), and the dual is a convex function
of y alone, quadratic piece by piece: a semismooth Newton method with an exact search along each
step (Qi and Sun 1993, Math Program 58:353) meets its minimum to rounding in about ten rounds. Where
few x are free the pieces are flat: the proximal term of the method of multipliers (Rockafellar
1976, Math Oper Res 1:97), which moves along with y, keeps the steps finite and changes no answer.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from spinepipe.effects.contract import Array

MOST_ROUNDS = 300
_MET = 1e-9
"""Row left over, in the unit of the rows, that counts as met."""
_PROXIMAL = 1e-12
"""Of the largest square of a coefficient: just above what rounding makes of a flat piece."""
_CENTRED = 0.1
"""The proximal term follows y where its own problem is met ten times as well as the rows."""


@njit(cache=True)
def least_norm(
    columns: Array, required: Array, equal: int, least: Array, most: Array, start: Array
) -> tuple[Array, Array, bool]:
    """The smallest x (M,), its multipliers (R,), and whether it meets the rows.

    Parameters
    ----------
    columns : (M, R), what a unit of each x adds to the rows. required : (R,).
    equal : how many rows must be met as they are; the others may exceed what is required.
    least, most : (M,) bounds. start : (R,) multipliers of a problem nearby, or noughts.
    """
    many, rows = columns.shape
    x, z, along = np.zeros(many), np.zeros(many), np.zeros(many)
    y, centre, left, slope = start.copy(), start.copy(), np.zeros(rows), np.zeros(rows)
    anew = not np.any(start)  # nothing is free at y = 0: the first curvature is that of all x
    free = np.ones(rows, dtype=np.bool_)
    weight = _PROXIMAL * np.max(np.square(columns))
    for rounds in range(MOST_ROUNDS):
        # Farkas' lemma: no x meets the rows if y @ rows @ x stays below y @ required
        gain, size = 0.0, 0.0
        left[:] = -required
        for j in range(many):
            z[j] = _dot(columns[j], y)
            x[j] = min(max(z[j], least[j]), most[j])
            gain += z[j] * (most[j] if z[j] > 0.0 else least[j])
            if x[j] != 0.0:
                for r in range(rows):
                    left[r] += columns[j, r] * x[j]
        off, inner = 0.0, 0.0
        for r in range(rows):
            gain -= y[r] * required[r]
            size = max(size, abs(y[r]))
            free[r] = r < equal or y[r] > 0.0 or left[r] < 0.0
            slope[r] = left[r] + weight * (y[r] - centre[r])
            if free[r]:
                off, inner = max(off, abs(left[r])), max(inner, abs(slope[r]))
        if off < _MET:
            return x, y, True
        if gain < -_MET * size:
            return x, y, False
        # an outer step of the method of multipliers
        if inner < _CENTRED * off:
            centre[:] = y
            slope[:] = left
        curved = _curvature(columns, z, least, most, anew and rounds == 0)
        step = _newton(curved, slope, free, weight)
        while np.any(free[equal:] & (y[equal:] == 0.0) & (step[equal:] < 0.0)):
            # an inequality that is met and would be left on its other side stays out of the step
            free[equal:] &= (y[equal:] > 0.0) | (step[equal:] >= 0.0)
            step = _newton(curved, slope, free, weight)
        for j in range(many):
            along[j] = _dot(columns[j], step)
        t = _line_search(z, along, least, most, _dot(slope, step), weight * _dot(step, step))
        # multipliers of inequalities stay at or above nought: the step ends where one comes to it
        stopped = -1
        for r in range(equal, rows):
            if step[r] < 0.0 and y[r] + t * step[r] <= 0.0:
                t, stopped = -y[r] / step[r], r
        y += t * step
        if stopped >= 0:
            y[stopped] = 0.0
    return x, y, False


@njit(cache=True)
def _dot(a: Array, b: Array) -> float:
    """Of two vectors of few numbers, for which a call of BLAS takes longer."""
    found = 0.0
    for k in range(len(a)):
        found += a[k] * b[k]
    return found


@njit(cache=True)
def _curvature(columns: Array, z: Array, least: Array, most: Array, of_all: bool) -> Array:
    """(R, R) of the dual, lower half: the sum over the x that are free, or over all of them."""
    many, rows = columns.shape
    found = np.zeros((rows, rows))
    for j in range(many):
        if of_all or least[j] < z[j] < most[j]:
            for r in range(rows):
                for q in range(r + 1):
                    found[r, q] += columns[j, r] * columns[j, q]
    return found


@njit(cache=True)
def _newton(curved: Array, slope: Array, free: NDArray[np.bool_], weight: float) -> Array:
    """(R,) Newton step of the free rows, by Cholesky's factors; nought in the others."""
    rows = len(slope)
    factor, step = np.zeros((rows, rows)), np.zeros(rows)
    for r in range(rows):
        if not free[r]:
            continue
        s = -slope[r]
        for q in range(r):
            if free[q]:
                c = curved[r, q] - _dot(factor[r, :q], factor[q, :q])
                factor[r, q] = c / factor[q, q]
        pivot = curved[r, r] + weight - _dot(factor[r, :r], factor[r, :r])
        factor[r, r] = np.sqrt(max(pivot, weight))  # rounding may leave less
        step[r] = (s - _dot(factor[r, :r], step[:r])) / factor[r, r]
    for r in range(rows - 1, -1, -1):
        if free[r]:
            step[r] /= factor[r, r]
            for q in range(r):
                step[q] -= factor[r, q] * step[r]
    return step


@njit(cache=True)
def _line_search(
    z: Array, along: Array, least: Array, most: Array, slope: float, floor: float
) -> float:
    """How far along the step the dual is lowest, from its slope and least curvature along it.

    Its slope is broken where an x comes to a bound or leaves it: through the breaks in order.
    """
    at, by = np.zeros(2 * len(z)), np.zeros(2 * len(z))
    n, curved = 0, floor
    # curvature where the step begins, and where along it each x becomes free or bound
    for j in range(len(z)):
        if along[j] == 0.0:
            continue
        one, other = (least[j] - z[j]) / along[j], (most[j] - z[j]) / along[j]
        enter, leave = min(one, other), max(one, other)
        if leave <= 0.0:
            continue
        square = along[j] * along[j]
        if enter > 0.0:
            at[n], by[n] = enter, square
            n += 1
        else:
            curved += square
        at[n], by[n] = leave, -square
        n += 1
    # through the breaks until the slope turns upwards
    t = 0.0
    for k in np.argsort(at[:n]):
        there = slope + max(curved, floor) * (at[k] - t)
        if there >= 0.0:
            break
        slope, t = there, at[k]
        curved += by[k]
    return t - slope / max(curved, floor)
