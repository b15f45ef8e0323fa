"""Persons of the cohort that comes along, and one with the made-up trunk, each made once."""

from collections.abc import Mapping
from functools import cache
from pathlib import Path

from trunk_cases import made_up_trunk

from spinepipe.cohort import Cohort, read
from spinepipe.muscles.muscle_equilibrium import SolvedTask, SolverOptions, solve_task
from spinepipe.muscles.person import Person
from spinepipe.muscles.subject import REFERENCE, Subject
from spinepipe.muscles.task import Task
from spinepipe.muscles.trunk import Trunk
from spinepipe.studies.subjects import SUBJECTS
from spinepipe.studies.trunk_loads.forms import TASKS
from spinepipe.studies.trunk_loads.persons import UprightPerson, regressions_of
from spinepipe.studies.trunk_loads.postures import read_tasks
from spinepipe.studies.trunk_loads.settings import TrunkLoads

FOLDER = Path(__file__).resolve().parents[2] / "config" / "cohorts" / "trunk_volunteers"
SETTINGS = TrunkLoads(study="persons", kind="trunk_loads", cohort="trunk_volunteers")

CLOSELY = SolverOptions(change=1e-7, residual_nm=1e-5, most=300)
"""Rounds until nothing moves."""


@cache
def volunteers() -> Cohort:
    """The cohort that comes along."""
    return read(FOLDER, (SUBJECTS, TASKS))


@cache
def tasks() -> Mapping[str, Task]:
    """Its tasks."""
    return read_tasks(volunteers(), SETTINGS.trunk_angle)


@cache
def standing() -> UprightPerson:
    """The volunteer, standing upright, with the muscles of the package."""
    return UprightPerson.of_cohort(SETTINGS, volunteers(), "volunteer")


def volunteer() -> Person:
    """The volunteer."""
    return standing().person


def person_of(trunk: Trunk, subject: Subject = REFERENCE) -> Person:
    """The reference person, or another, with another trunk."""
    regressions = regressions_of(SETTINGS, FOLDER)
    return UprightPerson.of(SETTINGS, trunk, subject, regressions).person


@cache
def made_up() -> Person:
    """The reference person with the made-up trunk, which is symmetric to the last bit."""
    return person_of(made_up_trunk())


@cache
def held_task(name: str) -> SolvedTask:
    """A task of the volunteer, settled closely."""
    return solve_task(volunteer(), tasks()[name], CLOSELY)
