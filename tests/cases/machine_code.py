"""The machine code of compiled loops, made once: copies of the project take it along.

It lies beside its source and is told apart by what the source says, not by where it lies. A copy
without it compiles for itself, in each of its workers, which takes longer than a small study.
"""

import fcntl
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import numpy as np
from example_effects import loaded, spine
from trunk_person import tasks, volunteer

import spinepipe
from spinepipe.muscles.muscle_equilibrium import SolverOptions, solve_task
from spinepipe.muscles.stability import stiffness
from spinepipe.statics import Course
from spinepipe.statics.batched import Stack, settle

_AT_ONCE = SolverOptions(change=np.inf, residual_nm=np.inf, most=1)


@contextmanager
def _one_at_a_time() -> Iterator[None]:
    """Other workers of the tests wait and then find what was compiled."""
    kept = Path(spinepipe.__file__).with_name("__pycache__")
    kept.mkdir(exist_ok=True)
    with (kept / "compiling.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


@cache
def of_joints() -> None:
    """Compile what looks at stacks of spines, unless it is there."""
    with _one_at_a_time():
        model = spine(2)
        stack = Stack.of([model], [(0, loaded(model, steps=1))])
        stack.solve()
        settle(stack, Course(0.05), np.array([0]))


@cache
def of_muscles() -> None:
    """Compile what looks at trunks, unless it is there."""
    with _one_at_a_time():
        person = volunteer()
        stiffness(person, solve_task(person, tasks()["standing"], _AT_ONCE), gain=5.0)
