"""The phantom as a whole: six specimens, their loads, their true and their measured motion."""

from dataclasses import dataclass

import numpy as np

from . import anatomy, loads, measure, mechanics, truth
from .anatomy import DONORS, JOINTS, Anatomy

# One stream each, so that no choice (law, frame error, zeroing, bridges) changes what others draw.
ANATOMY, TRUTH, LOADS, NOISE, CENTRES, BRIDGES = range(6)


@dataclass(frozen=True)
class Phantom:
    """All that a cohort folder holds, and what no lab would know.

    P specimens, T tests, C cycles, S load steps, J joints (caudal to cranial); SI but `measured`.

    Attributes
    ----------
    specimens : true geometry and masses.
    stiffness : (P, J, 6) truth, N/m and N m/rad; for the stiffening law at the neutral pose.
    moments : (P, T, C, S, 3) N m on T12, fixed in ground.
    motion : (P, T, C, S, J, 6) m and rad, without noise, not zeroed, in the true joint frames.
    stated_origins : (P, J, 3) m, joint centres as the cohort folder states them.
    measured : (P, T, C, S, J, 6) mm and deg, as in motion.csv but not rounded.
    """

    seed: int
    law: mechanics.Law
    frame_error_mm: float
    zeroed: bool
    bridged: bool
    specimens: tuple[Anatomy, ...]
    stiffness: np.ndarray
    moments: np.ndarray
    motion: np.ndarray
    stated_origins: np.ndarray
    measured: np.ndarray


def phantom(
    seed: int,
    *,
    law: mechanics.Law = "linear",
    frame_error_mm: float = 0.0,
    zeroed: bool = True,
    bridged: bool = False,
) -> Phantom:
    """Draw a phantom; equal seeds share geometry, truth, loads and noise whatever else is asked.

    Parameters
    ----------
    frame_error_mm : SD per axis of the stated joint centres; orientations are stated truly.
    bridged : whether each joint is stiffer by a factor of its own in each rotation, up to nearly
        rigid.
    """

    def stream(number):
        return np.random.default_rng([seed, number])

    bones = stream(ANATOMY)
    specimens = tuple(anatomy.build(donor, bones) for donor in DONORS)
    stiffness = truth.draw(stream(TRUTH), len(DONORS))
    if bridged:
        stiffness = truth.bridged(stiffness, stream(BRIDGES))
    moments = loads.draw(stream(LOADS), len(DONORS))
    motion = _motion(specimens, stiffness, moments, law)
    true_origins = np.stack([specimen.origins for specimen in specimens])
    error = frame_error_mm / 1000.0 * stream(CENTRES).normal(size=true_origins.shape)
    stated = np.round(true_origins + error, 9) if frame_error_mm else true_origins
    seen = _seen(specimens, motion, stated - true_origins)
    measured = measure.readings(seen, stream(NOISE), zeroed)
    return Phantom(
        seed,
        law,
        frame_error_mm,
        zeroed,
        bridged,
        specimens,
        stiffness,
        moments,
        motion,
        stated,
        measured,
    )


def _motion(specimens, stiffness, moments, law):
    """(P, T, C, S, J, 6) static poses of all specimens at once."""
    geometry = ("origins", "rotations", "masses", "centres")
    stacked = (np.stack([getattr(s, name) for s in specimens]) for name in geometry)
    chains = mechanics.Chains(*stacked, stiffness)
    states = moments.reshape(len(specimens), -1, 3)
    q = mechanics.equilibrium(chains, states, law)
    return q.reshape(*moments.shape[:-1], len(JOINTS), 6)


def _seen(specimens, motion, errors):
    """Motion about the stated centres, which lie ``errors`` (P, J, 3) m in ground off the true."""
    rotations = np.stack([specimen.rotations for specimen in specimens])
    offsets = np.einsum("pjki,pjk->pji", rotations, errors)[:, None, None, None]
    return measure.about_other_centres(motion, offsets, mechanics.turned(motion)[-1])
