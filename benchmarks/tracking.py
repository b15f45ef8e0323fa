"""Tracked motions of 17 joints, and two joints beside collocation by CasADi and IPOPT."""

import sys
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import get_args

import numpy as np

from benchmarks.memory import peak_mib
from benchmarks.study import ROOT
from benchmarks.timing import cpu_seconds
from spinepipe.motion.objective import ForceCost, MotionObjective, SampledTrial, sample_trial
from spinepipe.motion.passive import PassiveLaw, passive_elements
from spinepipe.motion.points import marker_places
from spinepipe.motion.skeleton import MarkerTrial
from spinepipe.motion.trajectory import OptimalMotions, solve

sys.path.append(str(ROOT / "tests" / "cases"))
import moving_spine
import short_chain

INTERVALS, LONG_S = 100, 4.0
COST: ForceCost = "level_difference"

_PROGRAM = """
from benchmarks import tracking

tracking.both()
"""


@dataclass(frozen=True)
class Whole:
    """17 joints, 100 intervals: how it ended, after how many steps, CPU seconds."""

    what: str
    status: str
    steps: int
    seconds: float


@dataclass(frozen=True)
class Beside:
    """Two joints, 20 intervals, by both: CPU seconds and least costs."""

    force_cost: str
    ours_s: float
    peer_s: float
    ours: float
    peer: float

    @property
    def ratio(self) -> float:
        """How many times as long the peer takes."""
        return self.peer_s / self.ours_s


def trials() -> tuple[SampledTrial, SampledTrial]:
    """Forwards and back, and to a side and back; markers are some millimetres off."""
    frames = 2 * INTERVALS + 1
    by = np.sin(np.linspace(0.0, np.pi, frames)) ** 2
    found = []
    for axis, lumbar, thoracic in ((3, -0.09, -0.015), (4, 0.05, 0.015)):
        q = np.zeros((frames, 18, 6))
        q[:, 1:7, axis], q[:, 7:, axis] = lumbar * by[:, None], thoracic * by[:, None]
        on = moving_spine.markers()
        places = marker_places(moving_spine.spine(), on, q)
        places += np.random.default_rng(axis).normal(0.0, 3e-3, places.shape[1:])
        seen = np.ones(places.shape[:2], dtype=bool)
        kind = "flexion_extension" if axis == 3 else "lateral_bending"
        times = np.linspace(0.0, LONG_S, frames)
        trial = MarkerTrial(kind, kind, times, places, seen, "hanging")
        found.append(sample_trial(moving_spine.spine(), on, trial, INTERVALS))
    return found[0], found[1]


def _ask() -> MotionObjective:
    shipped = passive_elements()
    return MotionObjective(passive=PassiveLaw(shipped.a, shipped.b), force_cost=COST)


def _starts(seen: tuple[SampledTrial, ...]) -> list[np.ndarray]:
    return [np.zeros((one.grid.coefficients, 18, 6)) for one in seen]


def one() -> OptimalMotions:
    """A trial with generic passive elements."""
    seen = trials()[:1]
    return solve(_ask(), seen, _starts(seen))


def both() -> OptimalMotions:
    """Both trials, sharing the passive elements of all rotations, which are fitted."""
    fitted = np.zeros((17, 6), dtype=bool)
    fitted[:, 3:] = True
    seen = trials()
    return solve(replace(_ask(), fitted=fitted), seen, _starts(seen))


def wholes() -> list[Whole]:
    """One trial, and both calibrated; compiled before they are timed."""
    one()
    found = []
    for what, call in (("one trial, generic", one), ("both trials, calibrated", both)):
        start = time.process_time()
        done = call()
        found.append(Whole(what, done.status.value, done.steps, time.process_time() - start))
    return found


def memory_mib() -> float:
    """Most memory of a process that calibrates both trials."""
    return peak_mib(_PROGRAM)


def beside_ipopt() -> list[Beside]:
    """The chain of two joints; ours carries the 15 others along, locked."""
    seen, found = short_chain.trial(), []
    start = [np.zeros((seen.grid.coefficients, 18, 6))]
    for cost in get_args(ForceCost):
        asked = short_chain.ask(cost)
        ours = solve(asked, [seen], start)
        took = cpu_seconds(lambda asked=asked: solve(asked, [seen], start), 3).median
        with tempfile.TemporaryDirectory() as folder:
            peer = short_chain.by_ipopt(cost, Path(folder))
        found.append(Beside(cost, took, peer.cpu_s, ours.cost, peer.cost))
    return found
