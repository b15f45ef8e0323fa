"""A fit as a linear model: readings to first order in its unknowns and in the nuisances."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from spinepipe.discrepancy.grounds import Grounds
from spinepipe.discrepancy.hypothesis import Unknown
from spinepipe.discrepancy.whitening import Whitening
from spinepipe.effects.contract import Array, Indices


@dataclass(frozen=True)
class Tangent:
    """One specimen's readings near a fit; zero where nothing was read.

    Attributes
    ----------
    predicted : per test (T, J, 6). by_x : per test (T, J, 6, m), by each of its unknowns.
    numbers : (m,) which of all unknowns these are.
    nuisances : per test (T, J, 6, k), by nuisances of SD one.
    """

    predicted: tuple[Array, ...]
    by_x: tuple[Array, ...]
    numbers: Indices
    nuisances: tuple[Array, ...]


@dataclass(frozen=True)
class LinearModel:
    """All specimens near a fit, and the unknowns' moves from it: priors (M,) and bounds (M,)."""

    members: Mapping[str, Tangent]
    mean: Array
    sd: Array
    low: Array
    high: Array


def tangent(grounds: Grounds, nuisance_size: float) -> LinearModel:
    """The grounds' fit to first order; nuisances of that many prior SDs."""
    fit = grounds.fit
    unknowns: tuple[Unknown, ...] = fit.hypothesis.unknowns
    members = {}
    for name, member in fit.hypothesis.members.items():
        plain, full = grounds.plain[name], grounds.setting.whitenings[name]
        sizes = full.sizes
        members[name] = Tangent(
            fit.predicted[name],
            in_readings(plain, lengthened(full, fit.jacobians[name])),
            np.array(member.numbers, dtype=np.int64),
            in_readings(plain, full.directions * (nuisance_size * sizes)),
        )
    return LinearModel(
        members,
        np.array([u.mean for u in unknowns]) - fit.x,
        np.array([u.sd for u in unknowns]),
        np.minimum(np.array([u.low for u in unknowns]) - fit.x, 0.0),
        np.maximum(np.array([u.high for u in unknowns]) - fit.x, 0.0),
    )


def lengthened(white: Whitening, rows: Array) -> Array:
    """Noise-whitened rows (N, m) of those with the nuisances' share taken out."""
    longer = 1.0 / (1.0 + white.shrink) - 1.0
    result: Array = rows + white.directions @ (longer[:, None] * (white.directions.T @ rows))
    return result


def in_readings(plain: Whitening, white: Array) -> tuple[Array, ...]:
    """(T, J, 6, m) per test, of noise-whitened rows (N, m): the inverse of ``noise_only``."""
    found: list[Array] = []
    at = 0
    for root, used in zip(plain.roots, plain.used, strict=True):
        rows = np.zeros((*used.shape, white.shape[1]))
        count = int(used.sum())
        rows[used] = white[at : at + count]
        at += count
        empty = ~used.transpose(1, 2, 0)  # (J, 6, T)
        square = root + empty[..., None] * np.eye(used.shape[0])
        raw = np.asarray(np.linalg.solve(square, rows.transpose(1, 2, 0, 3)), dtype=np.float64)
        found.append(raw.transpose(2, 0, 1, 3))
    return tuple(found)
