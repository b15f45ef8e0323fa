"""A project with a small study of each kind, as small as the kind can be and make all it makes."""

import shutil
from collections.abc import Callable
from pathlib import Path

import grid_cases
import stiffening_chains
import straight_chains
import tracked_cohort
from lever import lever
from machine_code import of_muscles
from small_project import Project, copy_project

from tests.generators import ais_films

ROOT = Path(__file__).parents[2]
GRID = (
    "poses: 2\nstiffness_sets: 8\n"
    "virtual_tests: {moment_nm: 7.5, tests: [flexion, left_rotation], steps: 3}\n"
)
TRACKED = (
    "approaches: [ik_constrained_christophy_2012, optk_generic]\n"
    "intervals: 10\nprofiles: {intervals: 10, ratios: [1]}\ntrade_off: [1]\n"
)
SCOLIOSIS = "study: small\nkind: scoliosis\ncohort: films\nmodels: [{models}]\n"
TRUNK = (
    "study: small\nkind: trunk_loads\ncohort: trunk_volunteers\n"
    "drawn_tasks: [standing]\nsimplified_tasks: [flexion_50]\n"
    "volunteer: {specimen: volunteer}\n"
    "uncertain: {tasks: [standing], samples: 32, samples_per_target: 8}\n"
)


def cohort_stiffness(folder: Path) -> Project:
    project = copy_project(folder)
    straight_chains.write_cohort(project.path("config/cohorts/chains"))
    project.path("config/studies/small.yaml").write_text(straight_chains.STUDY)
    return project


def discrepancy(folder: Path) -> Project:
    project = copy_project(folder)
    shutil.rmtree(project.path("config"))
    stiffening_chains.chains(folder)
    return project


def global_sensitivity(folder: Path) -> Project:
    return lever(folder, ("small", 8, ""))


def joint_pose_sensitivity(folder: Path) -> Project:
    project = copy_project(folder)
    project.write_study("small", poses=4)
    return project


def range_of_motion(folder: Path) -> Project:
    project = copy_project(folder)
    grid_cases.project(folder, GRID, specimens=("a",))
    return project


def scoliosis(folder: Path) -> Project:
    project = copy_project(folder)
    reading = ais_films.READINGS["ais18_phantom"]
    ais_films.write(project.path("config/cohorts/films"), reading, count=2)
    models = "tangent_fitted, tangent"
    project.path("config/studies/small.yaml").write_text(SCOLIOSIS.format(models=models))
    return project


def tracking(folder: Path) -> Project:
    project = copy_project(folder)
    tracked_cohort.project(folder, TRACKED, tracked_cohort.known_truth)
    return project


def trunk_loads(folder: Path) -> Project:
    of_muscles()
    project = copy_project(folder)
    cohort = "config/cohorts/trunk_volunteers"
    shutil.copytree(ROOT / cohort, project.path(cohort))
    project.path("config/studies/small.yaml").write_text(TRUNK)
    return project


SMALL: dict[str, Callable[[Path], Project]] = {
    made.__name__: made
    for made in (
        *(range_of_motion, global_sensitivity, cohort_stiffness, scoliosis),
        *(joint_pose_sensitivity, discrepancy, tracking, trunk_loads),
    )
}
"""Makes the project in a folder that is yet to be made; by kind."""
