"""Skin slides over bones: markers that are off together, along the spine, the more it is bent.

Where skin slides is not known, but how: along the body's own axis upwards, in proportion to the
bend of the whole trunk, under all markers of a vertebra alike, and to a part under all vertebrae
alike. So errors of markers in one frame hang together; their covariance is

    s^2 1 / weight + own^2 (of one vertebra) + shared^2 (of all vertebrae),

and residuals are what a Cholesky factor of it makes independent. Wang 2021 weighs all alike; with
skin that slides 10 to 20 mm the vertebrae of made-up people are then dragged down the trunk with
their markers (decision 0021).
"""

from dataclasses import replace

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.motion.objective import SHAPE, ResidualScales, SampledTrial
from spinepipe.motion.skeleton import PELVIS, body_poses

WHOLE_BEND_RAD = float(np.deg2rad(60.0))
"""Bend of T1 against the pelvis at which skin slides by its size."""

ON_PELVIS = 0.3
"""Of what it slides over vertebrae: there is less skin to pull on."""

_UP = 1


def with_sliding_skin(watched: SampledTrial, q: Array, sizes: ResidualScales) -> SampledTrial:
    """The trial, its markers weighed as skin slides in postures near the true ones.

    Parameters
    ----------
    q : (N + 1, 18, 6) m and rad, a first guess: bend and axes of bodies are taken from it.
    """
    if sizes.own_skin_m == 0.0 and sizes.shared_skin_m == 0.0:
        return watched
    turns, _ = body_poses(watched.skeleton, q)
    bend = trunk_bend(watched, turns) / WHOLE_BEND_RAD
    body = np.asarray(watched.markers.body)
    share = np.where(body == PELVIS, ON_PELVIS, 1.0)
    way = (bend[:, None] * share)[..., None] * turns[:, body][..., _UP]
    return replace(watched, shares=whitening(watched, way, sizes))


def trunk_bend(watched: SampledTrial, turns: Array) -> Array:
    """(F,) rad, how far T1 is turned against the pelvis, from the neutral pose; turns of bodies."""
    rest, _ = body_poses(watched.skeleton, np.zeros(SHAPE))
    now = np.swapaxes(turns[:, PELVIS], 1, 2) @ turns[:, -1]
    trace = np.einsum("fij,ij->f", now, rest[PELVIS].T @ rest[-1])
    found: Array = np.arccos(np.clip((trace - 1.0) / 2.0, -1.0, 1.0))
    return found


def whitening(watched: SampledTrial, way: Array, sizes: ResidualScales) -> Array:
    """(F, 3 K, 3 K) that make errors of markers independent, of size `sizes.marker_m`.

    Parameters
    ----------
    way : (F, K, 3) how skin under each marker slides, per metre.
    """
    # variance over that of a marker: of one vertebra, and of all but the pelvis
    body, count = np.asarray(watched.markers.body), len(watched.markers)
    one = body[:, None] == body
    spine = (body[:, None] != PELVIS) & (body != PELVIS)
    together = (sizes.own_skin_m**2 * one + sizes.shared_skin_m**2 * spine) / sizes.marker_m**2
    flat = way.reshape(len(way), -1)
    covariance = np.repeat(np.repeat(together, 3, axis=0), 3, axis=1) * (
        flat[:, :, None] * flat[:, None, :]
    )
    weight = np.repeat(watched.weight, 3, axis=1)
    seen = weight > 0.0
    covariance *= seen[:, :, None] & seen[:, None, :]  # what is out of sight hangs with nothing
    covariance += np.eye(3 * count) / np.where(seen, weight, 1.0)[:, None, :]
    # whitening: with C = L L', errors times the inverse of L are independent
    found: Array = np.linalg.inv(np.linalg.cholesky(covariance)) * seen[:, None, :]
    return found
