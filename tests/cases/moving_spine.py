"""A made-up spine that moves, with markers: round numbers, nobody's."""

from functools import cache

import numpy as np

from spinepipe.frames import Pose, rotation_zxy
from spinepipe.motion.objective import SampledTrial, sample_trial
from spinepipe.motion.passive import PassiveLaw
from spinepipe.motion.points import marker_places
from spinepipe.motion.skeleton import (
    BODIES,
    JOINTS,
    MarkerSet,
    MarkerTrial,
    Masses,
    Skeleton,
    skeleton_of,
)

CLUSTERS = ("T1", "T3", "T7", "T11", "L2", "L4")
SINGLES = ("T5", "T9", "T12", "L3")
PELVIS_M = ((0.07, 0.0, -0.12), (0.07, 0.0, 0.12), (-0.08, 0.02, -0.04), (-0.08, 0.02, 0.04))


@cache
def spine() -> Skeleton:
    """17 joints on a curve that bends forwards, backwards and forwards again; 40 kg."""
    heights = np.linspace(0.9, 1.38, len(JOINTS))
    ahead = 0.025 * np.cos(np.linspace(0.0, 2.2 * np.pi, len(JOINTS)))
    tilt = np.arctan2(-np.gradient(ahead), np.gradient(heights))
    joints = [
        Pose(rotation_zxy(t, 0.0, 0.0), np.array([x, y, 0.0]))
        for x, y, t in zip(ahead, heights, tilt, strict=True)
    ]
    kg = np.array([12.0, *[1.5] * (len(JOINTS) - 1), 12.0])
    com = np.tile([0.02, 0.015, 0.0], (len(BODIES), 1))
    about = np.array([m * np.diag([0.006, 0.009, 0.004]) for m in kg])
    return skeleton_of(joints, Masses(kg, com, about))


@cache
def markers() -> MarkerSet:
    """The protocol of Wang 2021: 22 on the spine, four on the pelvis and one on the sacrum."""
    names, bodies, places, clusters = [], [], [], []
    arms = np.array([[0.0, 0.03, 0.0], [0.0, -0.01, 0.02], [0.0, -0.01, -0.02]])
    for body in CLUSTERS:
        for k, arm in enumerate(arms):
            names.append(f"{body}_{k}")
            bodies.append(BODIES.index(body))
            places.append(np.array([-0.07, 0.0, 0.0]) + arm)
            clusters.append(body)
    for body in SINGLES:
        names.append(body)
        bodies.append(BODIES.index(body))
        places.append(np.array([-0.06, 0.0, 0.0]))
        clusters.append("")
    for name, place in zip(("LASI", "RASI", "LPSI", "RPSI"), PELVIS_M, strict=True):
        names.append(name)
        bodies.append(0)
        places.append(np.array(place))
        clusters.append("")
    return MarkerSet(
        tuple(names), np.array(bodies), np.array(places), np.ones(len(names)), tuple(clusters)
    )


def everywhere() -> MarkerSet:
    """Three markers on every body: nothing is left open."""
    arms = np.array([[-0.06, 0.03, 0.01], [-0.06, -0.01, 0.03], [-0.05, 0.0, -0.03]])
    bodies = np.repeat(np.arange(len(BODIES)), 3)
    names = tuple(f"{BODIES[body]}_{k % 3}" for k, body in enumerate(bodies))
    at = np.tile(arms, (len(BODIES), 1))
    return MarkerSet(names, bodies, at, np.ones(len(names)), tuple("" for _ in names))


def law(stiffer: float = 1.0) -> PassiveLaw:
    """The same at every joint: 60 N m/rad at rest, 3e5 N/m."""
    a = np.tile(np.array([300.0, 500.0, 300.0, 1.5, 1.5, 2.0])[:, None], (len(JOINTS), 1, 2))
    b = np.tile(np.array([1e3, 2e3, 1e3, 40.0, 40.0, 50.0])[:, None], (len(JOINTS), 1, 2))
    return PassiveLaw(stiffer * a, b)


def postures(seed: int, frames: int, size: float = 0.1) -> np.ndarray:
    """(F, 18, 6) m and rad, translations a tenth of that."""
    drawn = np.random.default_rng(seed).normal(0.0, size, (frames, len(BODIES), 6))
    return drawn * np.array([0.1] * 3 + [1.0] * 3)


def trial_at(places: np.ndarray, step_s: float = 0.1) -> MarkerTrial:
    """A trial of markers at places (F, K, 3) m, all seen."""
    times, seen = step_s * np.arange(len(places)), np.ones(places.shape[:2], dtype=bool)
    return MarkerTrial("made", "flexion_extension", times, places, seen, "hanging")


def sampled(
    q: np.ndarray,
    on: MarkerSet | None = None,
    off: np.ndarray | float = 0.0,
    step_s: float = 0.1,
    intervals: int | None = None,
) -> SampledTrial:
    """Markers of postures (F, 18, 6), off their places by as much; every frame a node, or fewer."""
    worn = markers() if on is None else on
    trial = trial_at(marker_places(spine(), worn, q) + off, step_s)
    return sample_trial(spine(), worn, trial, len(q) - 1 if intervals is None else intervals)
