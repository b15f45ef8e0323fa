"""A small study of each kind, as small as the kind can be and make all it makes.

`eight_kinds` has one of each, called as its kind: one run of Snakemake makes what many tests look
at (`asked`). `SMALL` puts one of a kind into a project (`small_project.copy_project`).
"""

import shutil
from collections.abc import Callable
from pathlib import Path

import grid_cases
import stiffening_chains
import straight_chains
import tracked_cohort
from lever import write_lever
from machine_code import of_muscles
from small_project import Project, copy_project

from spinepipe.studies.read import check
from spinepipe.studies.registry import files_of
from tests.generators import ais_films

ROOT = Path(__file__).parents[2]
GRID = (
    "poses: 4\nstiffness_sets: 4\n"
    "virtual_tests: {moment_nm: 7.5, tests: [flexion, left_rotation], steps: 3}\n"
)
TRACKED = (
    "approaches: [ik_constrained_christophy_2012, optk_generic]\n"
    "intervals: 10\nprofiles: {intervals: 10, ratios: [1]}\ntrade_off: [1]\n"
)
SCOLIOSIS = "study: small\nkind: scoliosis\ncohort: films\nmodels: [tangent]\n"
TRUNK = (
    "study: small\nkind: trunk_loads\ncohort: trunk_volunteers\n"
    "drawn_tasks: [standing]\nsimplified_tasks: [flexion_50]\n"
    "volunteer: {specimen: volunteer}\n"
    "uncertain: {tasks: [standing], samples: 4, samples_per_target: 100}\n"
)


def cohort_stiffness(project: Project) -> None:
    straight_chains.write_cohort(project.path("config/cohorts") / straight_chains.NAME)
    project.path("config/studies/small.yaml").write_text(straight_chains.STUDY)


def discrepancy(project: Project) -> None:
    stiffening_chains.chains(project.folder)


def global_sensitivity(project: Project) -> None:
    write_lever(project, ("small", 64, "samples_per_target: 100"))


def joint_pose_sensitivity(project: Project) -> None:
    project.write_study("small", poses=4)


def range_of_motion(project: Project) -> None:
    grid_cases.project(project.folder, GRID, specimens=("a", "b"))


def scoliosis(project: Project) -> None:
    reading = ais_films.READINGS["ais18_phantom"]
    ais_films.write(project.path("config/cohorts/films"), reading, count=2)
    project.path("config/studies/small.yaml").write_text(SCOLIOSIS)


def tracking(project: Project) -> None:
    tracked_cohort.project(project.folder, TRACKED, tracked_cohort.known_truth)


def trunk_loads(project: Project) -> None:
    of_muscles()
    cohort = "config/cohorts/trunk_volunteers"
    shutil.copytree(ROOT / cohort, project.path(cohort))
    project.path("config/studies/small.yaml").write_text(TRUNK)


SMALL: dict[str, Callable[[Project], None]] = {
    made.__name__: made
    for made in (
        *(range_of_motion, global_sensitivity, cohort_stiffness, scoliosis),
        *(joint_pose_sensitivity, discrepancy, tracking, trunk_loads),
    )
}
"""Writes cohort and study into a project; by kind."""


def of_kind(kind: str, folder: Path) -> Project:
    """A project, in a folder that is yet to be made, with a study of that kind."""
    project = copy_project(folder)
    SMALL[kind](project)
    return project


def eight_kinds(folder: Path) -> Project:
    """A project with a study of each kind, of the kind's own name, none computed."""
    project = copy_project(folder)
    studies = project.path("config/studies")
    for kind, write in SMALL.items():
        write(project)
        (file,) = {one for one in studies.iterdir() if one.stem not in SMALL}
        text = file.read_text().replace(f"study: {file.stem}\n", f"study: {kind}\n")
        file.unlink()
        (studies / f"{kind}.yaml").write_text(text)
    project.path("config/config.yaml").write_text(f"studies: [{', '.join(SMALL)}]\n")
    return project


def asked(project: Project) -> list[str]:
    """What is computed of them: of one kind all, of the others all that is no picture and no page.

    The rules of figures and pages are the same for all kinds, and drawing takes longer than all
    else; `make test-full` draws them all.
    """
    found = []
    for kind in SMALL:
        files = files_of(*check(project.folder, kind))
        tables = [*files.table_files(files.tables, full=False)]
        others = [f"{files.folder}/{name}" for name in files.others]
        found += files.results() if kind == "range_of_motion" else [*tables, *others]
    return found
