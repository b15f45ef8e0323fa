"""A study of tracked motions: the files of OpenSim that a run makes, and what is computed again.

What would be caught: a trial or an approach whose motion is not exported, motions of one person
on which another's results hang, what is drawn that recomputes what is not.
"""

from pathlib import Path

import pytest
from small_project import Project
from tracked_cohort import NAME, known_truth, two_persons
from tracked_cohort import project as write_project
from tracked_study import Run

pytestmark = pytest.mark.slow

STUDY = """\
approaches: [ik_constrained_christophy_2012, optk_generic, optk_from_flexion]
intervals: 10
profiles: {intervals: 10, ratios: [1]}
trade_off: [1]
"""


def test_a_run_exports_every_motion(eight: Project) -> None:
    files = set(eight.files())
    motions = {name for name in files if name.endswith(".mot")}
    assert len(motions) == 3 * 2  # trials, approaches
    assert "tracking/opensim/a/flexion_extension/optk_generic.mot" in motions
    assert "tracking/opensim/a.osim" in files


def marks(root: Path) -> dict[str, str]:
    """What is expected of all job files."""
    run = Run(root)
    tables = run.files.made_of_jobs
    return {
        f"{table} {file}": run.expected.of_part(table, str(file))
        for table in tables
        for _, file in run.jobs_of(table)
    }


def test_changed_motion_computes_that_person_again(tmp_path: Path) -> None:
    """One marker of b moved by a micrometre in one frame of flexion."""
    write_project(tmp_path, STUDY, two_persons, known_truth)
    before = marks(tmp_path)
    path = tmp_path / f"config/cohorts/{NAME}/b_flexion_extension.trc"
    lines = path.read_text().splitlines()
    cells = lines[-1].split("\t")
    cells[2] = f"{float(cells[2]) + 0.001:.4f}"
    path.write_text("\n".join([*lines[:-1], "\t".join(cells)]) + "\n")
    after = marks(tmp_path)
    again = {name for name in before if before[name] != after[name]}
    assert again == {name for name in before if "specimen-b" in name}


def test_another_choice_of_what_is_drawn_tracks_anew_and_nothing_else(tmp_path: Path) -> None:
    write_project(tmp_path, STUDY, known_truth)
    before = marks(tmp_path)
    study = tmp_path / "config/studies/small.yaml"
    study.write_text(study.read_text() + "drawn_approaches: [optk_generic]\n")
    after = marks(tmp_path)
    again = {name.split()[0] for name in before if before[name] != after[name]}
    assert again == {"tracked", "fits", "drawn"}
