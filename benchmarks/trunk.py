"""Trunk loads: one task, twelve tasks, a thousand samples, beside OpenSim's static optimisation."""

import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.memory import peak_mib
from benchmarks.study import ROOT
from benchmarks.timing import cpu_seconds
from spinepipe import cohort as cohorts
from spinepipe.cohort import Cohort
from spinepipe.effects.contract import Array
from spinepipe.muscles.forces import Demand, least_stress
from spinepipe.muscles.muscle_equilibrium import angles_of, solve_task
from spinepipe.muscles.person import Person
from spinepipe.muscles.pose import place_bodies, rotations_of
from spinepipe.muscles.task import Task
from spinepipe.muscles.trunk import LEVELS
from spinepipe.studies.study import COHORTS
from spinepipe.studies.subjects import SUBJECTS
from spinepipe.studies.trunk_loads.forms import TASKS
from spinepipe.studies.trunk_loads.persons import UprightPerson, vary_task
from spinepipe.studies.trunk_loads.postures import read_tasks
from spinepipe.studies.trunk_loads.settings import NOMINAL, TrunkLoads
from tests.reference.peers import opensim_static, opensim_trunk

STUDY = TrunkLoads(study="trunk", kind="trunk_loads", cohort="trunk_volunteers")
TWELVE, SAMPLES, REPEATS = range(1, 13), 1000, 5
BUDGET_S = 60.0
POSTURE = "flexion_50"
SHARE = 0.9
FEW, MANY = 6, 16
"""Frames of a run of OpenSim, whose splines through a motion want six."""

_PROGRAM = """
from benchmarks import trunk

everyone = trunk.Everyone.read()
person = everyone.first().person
for task in everyone.twelve():
    trunk.solve_task(person, task)
"""


@dataclass(frozen=True, eq=False)
class Everyone:
    """The shipped cohort and the first of its persons."""

    cohort: Cohort
    tasks: Mapping[str, Task]

    @classmethod
    def read(cls) -> "Everyone":
        """From the folder of the project."""
        cohort = cohorts.read(ROOT / COHORTS / STUDY.cohort, (SUBJECTS, TASKS))
        return cls(cohort, read_tasks(cohort, STUDY.trunk_angle))

    def first(self) -> UprightPerson:
        """The first person, standing as is found."""
        return UprightPerson.of_cohort(STUDY, self.cohort, self.cohort.specimen_names[0])

    def twelve(self) -> list[Task]:
        """One task of each number of Ghezelbash 2016 Table 1."""
        of_number = {task.number: task for task in reversed(self.tasks.values())}
        return [of_number[number] for number in TWELVE if number in of_number]


@dataclass(frozen=True)
class OneTask:
    """A task: how it ended, after how many rounds, CPU seconds."""

    name: str
    status: str
    rounds: int
    seconds: float


@dataclass(frozen=True)
class Sampled:
    """Samples of a person in twelve tasks: held, not reached by the arms, CPU seconds of all."""

    samples: int
    runs: int
    out_of_reach: int
    seconds: float

    @property
    def whole_s(self) -> float:
        """CPU seconds of as many as are wanted."""
        return self.seconds / self.samples * SAMPLES


@dataclass(frozen=True)
class Beside:
    """One posture of the same muscles by both: CPU seconds; largest difference of forces, N."""

    ours_s: float
    settled_s: float
    peer_s: float
    apart_n: float
    largest_n: float


def tasks() -> Iterator[OneTask]:
    """The twelve tasks of a person, one by one, warm."""
    everyone = Everyone.read()
    person = everyone.first().person
    for task in everyone.twelve():
        found = solve_task(person, task)
        took = cpu_seconds(lambda one=task: solve_task(person, one), REPEATS).median
        yield OneTask(task.name, found.status.value, len(found.rounds), took)


def standing_s() -> float:
    """CPU seconds until a person stands upright at their size."""
    everyone = Everyone.read()
    return cpu_seconds(everyone.first, REPEATS).median


def samples() -> Sampled:
    """As many samples of a person in twelve tasks as a minute of CPU takes."""
    everyone, rng = Everyone.read(), np.random.default_rng(1)
    spreads, first = STUDY.uncertain.factors, everyone.first()
    start, done, runs, far = time.process_time(), 0, 0, 0
    while time.process_time() - start < BUDGET_S:
        values: dict[str, float] = {
            name: NOMINAL[name] + rng.normal(0.0, spread.sd) for name, spread in spreads.items()
        }
        person = first.varied(values)
        for task in everyone.twelve():
            try:
                solve_task(person, vary_task(task, values))
                runs += 1
            except ValueError:
                far += 1
        done += 1
    return Sampled(done, runs, far, time.process_time() - start)


def memory_mib() -> float:
    """Most memory of a process that holds the twelve tasks once."""
    return peak_mib(_PROGRAM)


def beside_opensim() -> Beside:
    """Straight muscles in a bent posture, with nine tenths of the moments that they can make.

    OpenSim's time is that of one frame more: of many frames less that of few.
    """
    everyone = Everyone.read()
    first, task = everyone.first(), everyone.tasks[POSTURE]
    person, whole = first.varied({}, wrapping=False), first.person
    bends = np.diff(angles_of(person, task), axis=0)
    demand = _demand(person, task, bends)
    few, _ = _theirs(person, bends, demand, FEW)
    many, theirs = _theirs(person, bends, demand, MANY)
    ours = least_stress(demand).forces
    return Beside(
        cpu_seconds(lambda: _ours(person, task, bends, demand), 4 * REPEATS).median,
        cpu_seconds(lambda: solve_task(whole, task), REPEATS).median,
        (many - few) / (MANY - FEW),
        float(np.abs(theirs - ours).max()),
        float(ours.max()),
    )


def _peer(person: Person) -> opensim_trunk.OpenSimTrunk:
    """The trunk in OpenSim, turning about the same centres."""
    return opensim_trunk.build(replace(person.lines.trunk, joints=person.chain.centres))


def _demand(person: Person, task: Task, bends: Array) -> Demand:
    """What OpenSim's lever arms ask of the muscles in a sagittal posture."""
    muscles = person.lines.trunk.muscles
    many = len(muscles)
    arms = opensim_trunk.lever_arms(_peer(person), bends).reshape(many, -1).T
    wanted = np.zeros((len(LEVELS), 3))
    wanted[:, 0] = solve_task(person, task).demand.required.reshape(-1, 3)[:, 2]
    demand = Demand(
        np.ascontiguousarray(arms),
        wanted.ravel(),
        np.zeros(many),
        task.stress_pa * muscles.pcsa,
        muscles.pcsa,
        np.zeros((2, many)),
    )
    return replace(demand, required=SHARE * arms @ least_stress(demand).forces)


def _ours(person: Person, task: Task, bends: Array, demand: Demand) -> None:
    """Lines of action and forces, once; the spine does not move."""
    rotations = rotations_of(person.chain, angles_of(person, task))
    person.lines.pulls(place_bodies(person.chain, rotations, np.zeros_like(bends)))
    least_stress(demand)


def _theirs(person: Person, bends: Array, demand: Demand, frames: int) -> tuple[float, Array]:
    """CPU seconds of so many frames, and forces (M,) N of the last."""
    ready = opensim_static.asked(_peer(person), bends, demand.required, demand.most, frames)
    start = time.process_time()
    found = opensim_static.forces(ready)
    return time.process_time() - start, found[-1]
