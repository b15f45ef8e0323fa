"""Morris indices: elementary effects, their mean, mean size and SD."""

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.sensitivity.global_indices.design import Design
from spinepipe.sensitivity.global_indices.estimated import Estimated
from spinepipe.sensitivity.global_indices.intervals import percentile_interval, resample_weights
from spinepipe.sensitivity.global_indices.settings import Settings

ALONE = ("mu", "mu_star", "sigma")


def morris_indices(design: Design, outputs: Array, settings: Settings) -> Estimated:
    """mu, mu_star and sigma of each factor, mu_star alone of a group of several.

    Parameters
    ----------
    design : as many trajectories as there are in the outputs.
    outputs : (n, K) of whole trajectories.

    Indices are in the output's unit per whole range of the factor (0 to 1 of its share). Factors
    of a group move together, each up or down by chance, so that their effect has a size but no
    sign (Campolongo et al. 2007, doi:10.1016/j.envsoft.2006.10.004). Intervals are percentiles
    over resampled trajectories; those of sigma are narrow below 20 trajectories (88-95 % held).
    """
    effects = elementary_effects(design, outputs)
    kinds = [(index, g) for g in range(len(design.inputs)) for index in _kinds(design, g)]
    pick = np.array([3 * g + ALONE.index(index) for index, g in kinds])
    found = [_one(effects[:, :, k], settings)[:, pick] for k in range(outputs.shape[1])]
    estimate, low, high = np.stack(found, axis=-1)
    names = tuple((index, design.inputs[g], "") for index, g in kinds)
    return Estimated(names, estimate, np.stack([low, high]))


def elementary_effects(design: Design, outputs: Array) -> Array:
    """(r, G, K) change of output per unit step; of a group of several its size."""
    inputs = design.inputs
    steps = np.diff(design.unit.reshape(-1, design.block, len(design.factors)), axis=1)
    changes = np.diff(outputs.reshape(-1, design.block, outputs.shape[1]), axis=1)
    found = np.empty((len(steps), len(inputs), outputs.shape[1]))
    for g, name in enumerate(inputs):
        columns = [at for at, group in enumerate(design.groups) if group == name]
        moved = steps[:, :, columns[0]]
        when = np.abs(moved).argmax(axis=1)[:, None]
        effect = np.take_along_axis(changes, when[:, :, None], axis=1)[:, 0]
        effect = effect / np.take_along_axis(moved, when, axis=1)
        found[:, g] = effect if len(columns) == 1 else np.abs(effect)
    return found


def _kinds(design: Design, g: int) -> tuple[str, ...]:
    several = design.groups.count(design.inputs[g]) > 1
    return ("mu_star",) if several else ALONE


def _one(effects: Array, settings: Settings) -> Array:
    """(3, 3 G) estimates and ends of one output from effects (r, G)."""
    r = len(effects)
    weights = resample_weights(r, settings.bootstraps, settings.seed)
    drawn = np.concatenate([_indices(some / r, effects) for some in weights])
    whole = _indices(np.full((1, r), 1.0 / r), effects)
    return np.vstack([whole, percentile_interval(drawn, settings.confidence)])


def _indices(weights: Array, effects: Array) -> Array:
    """(R, 3 G) mu, mu_star, sigma of each factor, for weights (R, r) that sum to 1."""
    r, centre = len(effects), effects.mean(axis=0)
    off = effects - centre  # sums of squares of small numbers
    mean, size = weights @ off, weights @ np.abs(effects)
    square = np.maximum(weights @ off**2 - mean**2, 0.0)
    sigma = np.sqrt(square * r / (r - 1))
    return np.stack([mean + centre, size, sigma], axis=-1).reshape(len(weights), -1)
