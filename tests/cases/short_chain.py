"""Two joints that turn, on a pelvis that stands still: small enough for CasADi and IPOPT."""

import json
import os
import subprocess
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from moving_spine import everywhere, law, spine

from spinepipe.motion.objective import ForceCost, MotionObjective, SampledTrial, sample_trial
from spinepipe.motion.points import marker_places
from spinepipe.motion.skeleton import MarkerSet, MarkerTrial, Masses, Skeleton

INTERVALS, FRAMES, BODIES = 20, 41, 2
SCRIPT = Path(__file__).parents[1] / "reference" / "collocation.py"


@dataclass(frozen=True, eq=False)
class Reference:
    """Least cost, turns (N + 1, 2, 3) rad and CPU seconds of IPOPT."""

    cost: float
    turns: np.ndarray
    cpu_s: float


def skeleton() -> Skeleton:
    """Nothing above L4 weighs anything; L4 carries what a trunk weighs."""
    kg = np.zeros(18)
    kg[1 : BODIES + 1] = 3.0, 8.0
    com, about = spine().masses.com.copy(), np.zeros((18, 3, 3))
    com[2] = [0.03, 0.15, 0.01]
    about[1], about[2] = np.diag([0.02, 0.03, 0.015]), np.diag([0.2, 0.1, 0.15])
    return Skeleton(spine().steps, Masses(kg, com, about))


def markers() -> MarkerSet:
    """Three on either vertebra."""
    on = everywhere()
    some = (on.body > 0) & (on.body <= BODIES)
    names = tuple(name for name, kept in zip(on.names, some, strict=True) if kept)
    empty = ("",) * len(names)
    return MarkerSet(names, on.body[some], on.at[some], on.weight[some], empty)


def trial() -> SampledTrial:
    """Forwards and sideways and back in two seconds, markers some millimetres off."""
    by = np.sin(np.linspace(0.0, np.pi, FRAMES)) ** 2
    q = np.zeros((FRAMES, 18, 6))
    q[:, 1, 3], q[:, 2, 3] = -0.07 * by, -0.05 * by
    q[:, 1, 4], q[:, 2, 5] = 0.03 * by, 0.02 * by
    places = marker_places(skeleton(), markers(), q)
    places = places + np.random.default_rng(4).normal(0.0, 2e-3, places.shape[1:])
    seen = np.ones(places.shape[:2], dtype=bool)
    times = np.linspace(0.0, 2.0, FRAMES)
    made = MarkerTrial("made", "flexion_extension", times, places, seen, "hanging")
    return sample_trial(skeleton(), markers(), made, INTERVALS)


def ask(cost: ForceCost) -> MotionObjective:
    """Both joints turn and nothing else moves."""
    free = np.zeros((18, 6), dtype=bool)
    free[1 : BODIES + 1, 3:] = True
    return replace(MotionObjective(passive=law(0.5), force_cost=cost), free=free)


def by_ipopt(cost: ForceCost, folder: Path) -> Reference:
    """The same, by collocation in a process of its own."""
    given, result = folder / "asked.json", folder / "solved.json"
    given.write_text(json.dumps(_written(trial(), ask(cost))))
    # OpenSim, if it was imported, has told children to load its own CasADi
    own = {key: value for key, value in os.environ.items() if key != "LD_LIBRARY_PATH"}
    subprocess.run([sys.executable, str(SCRIPT), str(given), str(result)], check=True, env=own)
    found = json.loads(result.read_text())
    return Reference(found["cost"], np.array(found["turns"]).reshape(-1, 2, 3), found["cpu_s"])


def _written(seen: SampledTrial, asked: MotionObjective) -> dict[str, Any]:
    body, steps = seen.skeleton.masses, seen.skeleton.steps[:BODIES]
    assert asked.passive is not None
    sizes = asked.sizes
    return {
        "places": seen.places.tolist(),
        "step_s": seen.grid.step_s,
        "frames": sizes.frames,
        "step_turns": [step.rotation.tolist() for step in steps],
        "step_origins": [step.origin.tolist() for step in steps],
        "kg": body.kg[1 : BODIES + 1].tolist(),
        "com": body.com[1 : BODIES + 1].tolist(),
        "about": body.about_com[1 : BODIES + 1].tolist(),
        "a": asked.passive.a[:BODIES].reshape(-1, 2).tolist(),
        "b": asked.passive.b[:BODIES].reshape(-1, 2).tolist(),
        "marker_body": (seen.markers.body - 1).tolist(),
        "marker_at": seen.markers.at.tolist(),
        "marker_m": sizes.marker_m,
        "load_sizes": ([sizes.force_n] * 3 + [sizes.moment_nm] * 3) * BODIES,
        "common_share": sizes.force_n / sizes.common_n / np.sqrt(17),
        "bend_size": sizes.turn_rad_per_s2,
        "force_cost": asked.force_cost,
    }
