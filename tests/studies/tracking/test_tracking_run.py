"""A study of tracked motions from beginning to end, and what is computed again."""

from pathlib import Path

import pytest
from small_project import Project, Shared, copy_project
from tracked_cohort import NAME, known_truth, project, two_persons

from spinepipe.studies.tracking.kind import KIND

pytestmark = pytest.mark.slow

STUDY = """\
approaches: [ik_constrained_christophy_2012, optk_generic, optk_from_flexion]
intervals: 10
profiles: {intervals: 10, ratios: [1]}
trade_off: [1]
"""
RESULTS = "small/"
JOB = f"{RESULTS}jobs/specimen=b/trial=stance/approach=optk_generic/fits.parquet"
MOTION = f"{RESULTS}opensim/a/flexion_extension/optk_generic.mot"


def build(folder: Path) -> Project:
    made = copy_project(folder)
    project(folder, STUDY, two_persons, known_truth)
    made.run()
    return made


@pytest.fixture
def computed(shared: Shared) -> Project:
    """A project whose study has been computed; built once and not to be changed."""
    return shared.project("tracking", build)


@pytest.fixture
def tracked(computed: Project, tmp_path: Path) -> Project:
    """The same, for one test to change."""
    return computed.copy(tmp_path / "project")


def jobs(files: set[str]) -> set[str]:
    return {name for name in files if name.startswith(f"{RESULTS}jobs/")}


def test_a_run_makes_tables_motions_and_a_report(computed: Project) -> None:
    files = set(computed.files())
    assert {f"{RESULTS}{table.name}.parquet" for table in KIND.tables} <= files
    motions = {name for name in files if name.endswith(".mot")}
    assert len(motions) == 2 * 3 * 3
    assert MOTION in motions
    assert {f"{RESULTS}opensim/{name}.osim" for name in "ab"} <= files
    assert f"{RESULTS}report.html" in files
    assert computed.planned() == set()


def test_a_lost_job_file_is_computed_again_alone(tracked: Project) -> None:
    """With the other files of the same job."""
    tracked.path(f"results/{JOB}").unlink()
    folder = JOB.removesuffix("fits.parquet")
    of_job = {f"{folder}{name}.parquet" for name in ("tracked", "fits", "drawn")}
    assert jobs(tracked.planned()) == of_job


def test_a_lost_motion_is_written_again_alone(tracked: Project) -> None:
    before = tracked.contents()
    tracked.path(f"results/{MOTION}").unlink()
    assert tracked.rerun() == {MOTION}
    assert tracked.contents() == before


def test_changed_motion_computes_that_person_again(tracked: Project) -> None:
    """One marker of b moved by a micrometre in one frame of flexion."""
    path = tracked.path(f"config/cohorts/{NAME}/b_flexion_extension.trc")
    lines = path.read_text().splitlines()
    cells = lines[-1].split("\t")
    cells[2] = f"{float(cells[2]) + 0.001:.4f}"
    path.write_text("\n".join([*lines[:-1], "\t".join(cells)]) + "\n")
    planned = tracked.planned()
    of_b = {name for name in jobs(set(tracked.files())) if "specimen=b/" in name}
    assert jobs(planned) == of_b
    exported = {name for name in planned if "/opensim/" in name}
    assert exported == {name for name in tracked.files() if "/opensim/b" in name}


def test_another_choice_of_what_is_drawn_tracks_anew_and_nothing_else(tracked: Project) -> None:
    study = "config/studies/small.yaml"
    tracked.edit(study, "intervals: 10\n", "intervals: 10\ndrawn_approaches: [optk_generic]\n")
    names = {name.rsplit("/", 1)[1] for name in jobs(tracked.planned())}
    assert names == {"tracked.parquet", "fits.parquet", "drawn.parquet"}
