"""`spinepipe new`: what a cohort can answer is offered, and what is written is sound.

Catches a kind that is offered and refused afterwards, a file that editors cannot check, and a
planned cohort that cannot be read.
"""

import io
import json
from pathlib import Path

import pandas as pd
import pytest
import yaml
from study_cases import Size, project
from sweeps import sweep

from spinepipe.cli import main
from spinepipe.studies.read import check
from spinepipe.studies.registry import kind_names


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """A project with a cohort of landmarks, loads and motion, `straight`, and a study `probe`."""
    project(tmp_path, Size())
    header = tmp_path / "config/cohorts/straight/cohort.yaml"
    sd = "measurement_sd: {rotation_deg: 0.1, translation_mm: 0.1}\n"
    header.write_text(header.read_text() + sd)
    return tmp_path


def new(root: Path, *words: str) -> int:
    return main(["-C", str(root), "new", *words])


def test_what_the_data_can_answer_is_offered_and_the_chosen_one_is_sound(
    root: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO("9\n2\n"))
    assert new(root, "study", "mine", "--cohort", "straight") == 0
    told = capsys.readouterr().out
    assert "1  discrepancy" in told
    assert "  scoliosis: needs a cohort with films" in told
    assert "A number from 1 to" in told
    assert "Next: spinepipe plan mine" in told
    study, _ = check(root, "mine", starting=False)
    assert study.kind == "cohort_stiffness"
    assert new(root, "study", "other", "--cohort", "straight", "--yes") == 0
    assert check(root, "other", starting=False)[0].kind == "discrepancy"


def test_recordings_alone_are_offered_what_reads_them(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without joints, markers' places and tasks: nothing that needs joints is offered."""
    (tmp_path / "config/cohorts").mkdir(parents=True)
    (tmp_path / "config/studies").mkdir()
    shipped = Path(__file__).resolve().parents[2] / "config/cohorts/stoop_lift"
    (tmp_path / "config/cohorts/lifts").symlink_to(shipped)
    for number in (1, 2):
        monkeypatch.setattr("sys.stdin", io.StringIO(f"{number}\n"))
        assert new(tmp_path, "study", f"my{number}", "--cohort", "lifts") == 0
    assert "range_of_motion: needs landmarks.csv or joints.csv" in capsys.readouterr().out
    markers, loads = (check(tmp_path, f"my{n}", starting=False)[0] for n in (1, 2))
    assert (markers.kind, markers.marker_set) == ("tracking", "plug_in_gait")
    assert (loads.kind, loads.motions.trials) == ("trunk_loads", ("lift1", "lift2", "lift3"))
    monkeypatch.setattr("sys.stdin", io.StringIO(""))  # nobody answers
    assert new(tmp_path, "study", "my3", "--cohort", "lifts") == 130


@sweep("kind", kind_names())
def test_the_first_line_leads_to_the_schema_of_its_keys(root: Path, kind: str) -> None:
    assert new(root, "study", f"my_{kind}", "--cohort", "straight", "--kind", kind) == 0
    path = root / f"config/studies/my_{kind}.yaml"
    first = path.read_text().splitlines()[0]
    assert first.startswith("# yaml-language-server: $schema=")
    schema = json.loads((path.parent / first.partition("=")[2]).read_text())
    document = yaml.safe_load(path.read_text())
    assert set(document) <= set(schema["properties"])
    assert set(schema["required"]) <= set(document)


@sweep(
    "words, told",
    [
        (["study", "probe"], "config/studies/probe.yaml is there"),
        (["study", "a b"], 'the name "a b"'),
        (["study", "mine", "--cohort", "strait"], "straight"),
        (["study", "mine", "--cohort", "straight", "--kind", "discrepanci"], "discrepancy"),
        (["study", "mine", "--cohort", "straight", "--kind", "xyz"], "leave --kind out"),
        (["study", "mine", "--cohort", "straight", "--design", "--misfit", "0"], "--misfit 0"),
        (
            ["study", "mine", "--cohort", "straight", "--design", "--kind", "scoliosis"],
            "--kind disc",
        ),
        (["cohort", "straight"], "config/cohorts/straight is there"),
        (["cohort", "c", "--vertebrae", "L5 L4", "--tests", "run:7.5"], '--tests "run:7.5"'),
    ],
)
def test_wrong_words(
    root: Path, capsys: pytest.CaptureFixture[str], words: list[str], told: str
) -> None:
    assert new(root, *words) == 2
    assert told in capsys.readouterr().err
    assert not (root / "config/cohorts/c").exists()
    assert not (root / "config/studies/mine.yaml").exists()


def test_a_planned_cohort_tells_before_there_are_data_what_its_tests_could_name(
    root: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["--vertebrae", "L5 L4", "--tests", "flexion_extension:7.5x2"]
    assert new(root, "cohort", "planned", *words) == 0
    folder = root / "config/cohorts/planned"
    loads = pd.read_csv(folder / "loads.csv")
    assert loads.mz_nm.iloc[[0, 5, 15, 20]].tolist() == [0.0, -7.5, 7.5, 0.0]
    assert len(pd.read_csv(folder / "motion_to_fill.csv")) == 2 * 21
    capsys.readouterr()
    path = root / "config/studies/before.yaml"
    path.write_text(
        "study: before\nkind: discrepancy\ncohort: planned\nbase: {stiffness: per_specimen}\n"
        "effects: [neutral_zone, load_offset]\n"
    )
    table = root / "before.csv"
    assert new(root, "study", "before", "--design", "--misfit", "0.5", "--to", str(table)) == 0
    told = capsys.readouterr().out
    assert told.startswith("Of 2 effects that make a misfit of 0.5 SD of one reading, ")
    assert "Next: " in told
    assert set(pd.read_csv(table).effect) == {"neutral_zone", "load_offset"}


def test_a_planned_cohort_with_vertebrae_in_the_wrong_order_is_not_written(
    root: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["--vertebrae", "L4 L5", "--tests", "flexion_extension:7.5"]
    assert new(root, "cohort", "c", *words) == 1
    assert "'L4' before 'L5'" in capsys.readouterr().err
    assert not (root / "config/cohorts/c").exists()
