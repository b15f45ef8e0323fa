"""`python -m benchmarks trunk_beside OLD`: samples of a person, and a lift, beside a commit.

Both commits are measured by this file, in turn, each in processes of its own; the least of their
CPU times counts. A commit that knows no lifts is measured on samples alone.
"""

import json
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from benchmarks import trunk
from benchmarks.study import ROOT
from spinepipe import cohort as cohorts
from spinepipe.muscles.muscle_equilibrium import solve_task
from spinepipe.studies.study import COHORTS
from spinepipe.studies.subjects import SUBJECTS
from spinepipe.studies.trunk_loads.persons import UprightPerson, solver_options, vary_task
from spinepipe.studies.trunk_loads.settings import NOMINAL

SAMPLES = 40
"""Of `trunk.SAMPLES`, to which the time is scaled."""

LIFT, STRESS_PA = "lift3", 0.6e6
"""200 frames of 4 s."""

Figures = dict[str, float]
"""CPU seconds."""


def figures() -> Figures:
    """What this commit takes."""
    found = {f"{trunk.SAMPLES:,} samples x twelve tasks": _samples_s()}
    try:
        from spinepipe.studies.trunk_loads import lifts
    except ImportError:  # an older commit
        return found
    from spinepipe.studies.recordings import RECORDED

    cohort = cohorts.read(ROOT / COHORTS / "stoop_lift", (SUBJECTS, *RECORDED))
    person = UprightPerson.of_cohort(trunk.STUDY, cohort, "s01").person
    motion = lifts.lift_of(cohort, "s01", LIFT, person)
    tasks = lifts.tasks_of(motion, np.arange(len(motion.time_s)), STRESS_PA)
    options = solver_options(trunk.STUDY)
    name = f"loads of all {len(tasks)} frames of a lift"
    return found | {
        name: _seconds(lambda some: list(lifts.held_in_turn(person, some, options)), tasks)
    }


def _samples_s() -> float:
    """The same samples in every commit."""
    everyone, rng = trunk.Everyone.read(), np.random.default_rng(1)
    first, twelve = everyone.first(), everyone.twelve()
    drawn = [
        {
            name: NOMINAL[name] + rng.normal(0.0, spread.sd)
            for name, spread in trunk.STUDY.uncertain.factors.items()
        }
        for _ in range(SAMPLES)
    ]

    def solve(some: Sequence[Mapping[str, float]]) -> None:
        for values in some:
            person = first.varied(values)
            for task in twelve:
                try:
                    solve_task(person, vary_task(task, values))
                except ValueError:  # hands out of reach
                    continue

    return _seconds(solve, drawn) * trunk.SAMPLES / SAMPLES


def _seconds(call: Callable[[Sequence[Any]], object], what: Sequence[Any]) -> float:
    """CPU seconds of a call with all, after one with the first."""
    call(what[:1])
    begun = time.process_time()
    call(what)
    return time.process_time() - begun


def beside(old: str) -> list[tuple[str, float, float | None]]:
    """What is measured, at HEAD and at an older commit; None where that does not know it."""
    from benchmarks.equilibria import measured_beside  # which an older commit has not

    return measured_beside(old, "trunk", __file__)


if __name__ == "__main__":
    sys.stdout.write(json.dumps(figures()))
