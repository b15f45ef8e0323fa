"""`spinepipe init` makes a project that is sound, and leaves alone what somebody has.

Catches a user's file that is written over, a project in which Snakemake or a check fails before
anything was added, and an example that does not come along.
"""

from pathlib import Path

import pytest

from spinepipe.cli import main
from spinepipe.shipped import IN_A_CLONE, SHIPPED
from spinepipe.studies.read import check, read_selection


def contents(folder: Path) -> dict[str, bytes]:
    return {str(path): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_beside_the_package_lies_the_repository() -> None:
    assert IN_A_CLONE
    assert (SHIPPED / "Snakefile").is_file()


def test_a_new_project(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["init", "my lab"]) == 0
    root = tmp_path / "my lab"
    assert capsys.readouterr().out.splitlines() == [
        "Made my lab: Snakefile, config/config.yaml, profiles/default/config.yaml",
        "Next: cd 'my lab'; spinepipe import YOUR_FILE.csv",
    ]
    assert {path.name for path in root.iterdir()} == {"Snakefile", "config", "profiles", "results"}
    assert len((root / "Snakefile").read_text().splitlines()) == 2
    assert read_selection(root).studies == ()
    assert main(["--root", str(root), "run"]) == 0
    assert capsys.readouterr().out.startswith("config/config.yaml names no study yet.")


def test_nothing_of_somebody_is_written_over(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mine = tmp_path / "config/config.yaml"
    mine.parent.mkdir()
    mine.write_bytes(b"studies: [mine]  # \xe4\n")
    (tmp_path / "Snakefile").symlink_to("gone")
    assert main(["init", str(tmp_path), "--slurm"]) == 0
    said = capsys.readouterr().out
    assert "profiles/slurm" in said
    assert "Left as they are, since they differ from what would be written: Snakefile" in said
    assert mine.read_bytes() == b"studies: [mine]  # \xe4\n"
    assert (tmp_path / "Snakefile").is_symlink()
    before = contents(tmp_path)
    assert main(["init", str(tmp_path)]) == 0
    assert "nothing to add" in capsys.readouterr().out
    assert contents(tmp_path) == before


def test_all_examples_come_along(tmp_path: Path) -> None:
    assert main(["init", str(tmp_path), "--examples"]) == 0
    selection = read_selection(tmp_path)
    assert selection == read_selection(SHIPPED)
    assert check(tmp_path, "l4l5_disc", starting=False)[0].study == "l4l5_disc"


def test_a_place_that_no_project_can_have(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").touch()
    assert main(["init", str(tmp_path / "file")]) == 2
    assert capsys.readouterr().err.endswith("\n  name another one: spinepipe init DIR\n")
