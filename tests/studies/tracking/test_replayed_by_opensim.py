"""What a study writes for OpenSim: OpenSim puts its markers where we have them."""

from pathlib import Path

import numpy as np
import pytest
from cohort_cases import swap
from tracked_cohort import Motion, project
from tracked_study import Run

from spinepipe.cli import main
from spinepipe.marks import read_mark
from spinepipe.motion.export import COLUMNS, opensim_names
from spinepipe.motion.points import marker_places
from spinepipe.studies.tracking.persons import person_of
from spinepipe.studies.tracking.tracked_motions import motions
from spinepipe.tables import read_frame
from tests.reference.peers import opensim_motion as peer

STUDY = """\
approaches: [ik_constrained_christophy_2012, ik_springs]
intervals: 10
scaling: markers
profiles: {intervals: 10, ratios: [1]}
"""
STRANGE = "SA CR"
"""A marker whose name OpenSim cannot take."""

REPLAYED_M = 1e-6
"""A millimetre's thousandth; fifteen digits of metres and degrees leave far less."""


def rename(recorded: dict[str, Motion]) -> None:
    for motion in recorded.values():
        motion.names[motion.names.index("SACR")] = STRANGE


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A study whose motions are tracked and written."""
    folder = tmp_path_factory.mktemp("replayed")
    named = swap("marker_set.csv", "a,SACR,", f"a,{STRANGE},")
    project(folder, STUDY, named, spoilt=(rename,))
    found = Run(folder)
    found.write("tracked")
    found.export()
    return found


def test_files_are_where_the_study_says(run: Run) -> None:
    for name in run.files.others:
        assert run.path(f"{run.files.folder}/{name}").is_file(), name
    assert len(run.files.others) == 1 + 3 * 2
    skeleton = run.path(f"{run.files.folder}/opensim/a.osim")
    assert read_mark(skeleton) == run.expected.of_job("skeleton", {"specimen": "a"})


def test_opensim_replays_the_motions_of_a_study(run: Run) -> None:
    folder = run.path(f"{run.files.folder}/opensim")
    model = peer.model_of(folder / "a.osim", COLUMNS)
    cohort = run.expected.cohort
    person = person_of(cohort, "a", cohort.folder, "markers")
    names = [model.model.getMarkerSet().get(k).getName() for k in range(len(person.markers))]
    assert tuple(names) == opensim_names(person.markers.names)
    assert "SA_CR" in names
    for place, file in run.jobs_of("tracked"):
        (moved,) = motions(read_frame(file))
        path = folder / "a" / place["trial"] / f"{place['approach']}.mot"
        times, values = peer.coordinates_of(model, path)
        np.testing.assert_allclose(times, moved.time_s, atol=1e-12)
        np.testing.assert_allclose(
            peer.marker_places(model, values),
            marker_places(person.skeleton, person.markers, moved.q),
            rtol=0.0,
            atol=REPLAYED_M,
        )


def test_the_command_writes_the_same_model(
    run: Run, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "new" / "a.osim"
    command = ["--root", str(run.root), "export", "small", "a", "-o", str(file)]
    assert main(command) == 0
    assert "27 markers, without head and arms" in capsys.readouterr().out
    written = run.path(f"{run.files.folder}/opensim/a.osim").read_text()
    assert written.startswith(file.read_text())
    assert main([*command, "--pose", "1"]) == 1
    assert "this kind of study exports no sampled joints" in capsys.readouterr().err


def test_names_are_told_apart() -> None:
    assert opensim_names(("a b", "a_b", "a:b", "c", "", "ä")) == (
        "a_b_2",
        "a_b",
        "a_b_3",
        "c",
        "_",
        "__2",
    )
