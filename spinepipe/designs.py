"""Designs: which points of an uncertain input are computed. Sampling is SALib's."""

from collections.abc import Sequence

import numpy as np
from SALib.sample import latin

from spinepipe.effects.contract import Array
from spinepipe.frames import Pose, transform_of


def latin_hypercube_normal(means: Array, sds: Array, n: int, seed: int) -> Array:
    """(n, D) Latin hypercube of independent normals with means (D,) and SDs (D,).

    A coordinate whose SD is zero stays at its mean.

    Raises
    ------
    ValueError
        For a negative SD or fewer than two points.
    """
    if not np.all(sds >= 0.0) or n < 2:
        raise ValueError("a Latin hypercube needs SDs that are not negative and at least 2 points")
    free = np.flatnonzero(sds > 0.0)
    points = np.tile(np.asarray(means, dtype=float), (n, 1))
    if len(free):
        problem = {
            "num_vars": len(free),
            "names": [f"x{index}" for index in free],
            "bounds": [[0.0, 1.0]] * len(free),
            "dists": ["norm"] * len(free),
        }
        points[:, free] += latin.sample(problem, n, seed=seed) * sds[free]
    return points


def specimen_seed(seed: int, specimen: str) -> int:
    """A seed of its own for each specimen, so that adding one leaves the others' draws alone."""
    words = np.frombuffer(specimen.encode(), dtype=np.uint8).astype(np.uint32)
    return int(np.random.SeedSequence([seed, *words.tolist()]).generate_state(1)[0])


def sample_landmarks(
    points: Array, sds: Array, n: int, seed: int, specimen: str
) -> tuple[Array, Sequence[int]]:
    """(n, L, 3) landmark sets around points (L, 3) with per-axis SDs (L,), and pose numbers."""
    flat = latin_hypercube_normal(
        points.ravel(), np.repeat(sds, 3), n, specimen_seed(seed, specimen)
    )
    return flat.reshape(n, *points.shape), range(n)


def sample_log_uniform(lowest: Array, highest: Array, n: int, seed: int) -> Array:
    """(n, D) Latin hypercube, each coordinate uniform on a logarithmic scale between its ends.

    A coordinate whose ends are equal stays there.

    Raises
    ------
    ValueError
        For an end that is not positive, ends the wrong way round, or fewer than two points.
    """
    lowest, highest = np.asarray(lowest, dtype=float), np.asarray(highest, dtype=float)
    if n < 2 or not np.all((lowest > 0.0) & (lowest <= highest)):
        raise ValueError("a log-uniform sample needs positive ends in order and at least 2 points")
    problem = {
        "num_vars": len(lowest),
        "names": [f"x{index}" for index in range(len(lowest))],
        "bounds": [[0.0, 1.0]] * len(lowest),
    }
    share = latin.sample(problem, n, seed=seed)
    points: Array = lowest * (highest / lowest) ** share
    return points


def sample_joint_frames(
    frames: Sequence[Pose],
    translation_sd_m: float,
    rotation_sd_rad: float,
    n: int,
    seed: int,
    specimen: str,
) -> list[tuple[Pose, ...]]:
    """Sets of joint frames around given ones; the first set is the given one, the others drawn.

    Each frame is moved along its own axes and then turned by Z, X', Y'' angles, all six of them
    independent normals.

    Parameters
    ----------
    translation_sd_m, rotation_sd_rad : SDs per axis.
    n : number of sets, at least 1.
    """
    size = 6 * len(frames)
    sds = np.tile(np.repeat([translation_sd_m, rotation_sd_rad], 3), len(frames))
    own = specimen_seed(seed, specimen)
    drawn = latin_hypercube_normal(np.zeros(size), sds, max(2, n - 1), own)[: n - 1]
    moved = (
        tuple(frame @ transform_of(by) for frame, by in zip(frames, point, strict=True))
        for point in drawn.reshape(n - 1, len(frames), 6)
    )
    return [tuple(frames), *moved]


def sample_factors(spread: float, dimensions: int, n: int, seed: int) -> Array:
    """(n, dimensions) factors: the first row is 1, the others log-uniform within the spread.

    Parameters
    ----------
    spread : factors are drawn from 1 / spread to spread.
    n : number of rows, at least 1.
    """
    highest = np.full(dimensions, spread)
    drawn = sample_log_uniform(1.0 / highest, highest, max(2, n - 1), seed)[: n - 1]
    return np.vstack([np.ones(dimensions), drawn])
