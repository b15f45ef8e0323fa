"""Before the experiment: what is promised of planned tests, against a search of the tests made."""

from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from spinepipe.cli import main
from spinepipe.cohort import read
from spinepipe.studies.discrepancy.design.planned import named_with
from spinepipe.studies.discrepancy.search.investigation import investigate, prepare
from spinepipe.studies.discrepancy.store import at_once
from spinepipe.studies.read import read as read_study
from tests.generators.hidden import Recipe, draw_hidden, make

SURE, HOPELESS = "flexion_extension_asymmetry", "bending_rotation_coupling"
STUDY = f"""study: planned
kind: discrepancy
cohort: planned
base: {{stiffness: per_specimen}}
effects: [{HOPELESS}, {SURE}, load_offset, neutral_zone]
"""
SMALL = Recipe(seed=11, joints=3, n_specimens=2, gap=0.5)
MADE = {
    SURE: replace(SMALL, hidden=(draw_hidden(SURE, SMALL, coordinate="extension"),)),
    HOPELESS: replace(SMALL, hidden=(draw_hidden(HOPELESS, SMALL),)),
}


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study whose cohort has loads and geometry, and nothing read."""
    root = tmp_path_factory.mktemp("project")
    make(MADE[SURE], root / "config/cohorts/planned")
    (root / "config/cohorts/planned/motion.csv").unlink()
    (root / "config/studies").mkdir()
    (root / "config/studies/planned.yaml").write_text(STUDY)
    return root


def test_what_is_sure_is_named_and_what_is_hopeless_is_not(
    project: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Motion of another simulator: the same geometry and loads, one effect hidden at a time."""
    table = tmp_path / "plan.csv"
    words = ["new", "study", "planned", "--design", "--to", str(table)]
    assert main(["--root", str(project), *words]) == 0
    said = capsys.readouterr().out.splitlines()
    assert said[0].startswith("Of 4 effects that make a misfit of 0.5 SD of one reading, ")
    assert said[1].startswith("Most is gained by: ")
    rows = pd.read_csv(table).set_index(["effect", "gap"])
    assert rows.loc[(SURE, 0.5), "probability"] > 0.95
    assert rows.loc[(HOPELESS, 0.5), "probability"] < 0.05
    assert (rows["with_run"] >= rows["probability"]).all()
    by_gap = rows["probability"].unstack("gap")
    assert (by_gap[0.5] >= by_gap[0.2]).all()
    study = read_study(project / "config/studies/planned.yaml", project)
    for name, recipe in MADE.items():
        make(recipe, tmp_path / name)
        ended = investigate(prepare(study, read(tmp_path / name), None), at_once).ended
        assert (name in {one.name for one in ended.named}) is (name == SURE)


def test_half_of_the_data_sets_lead_by_more_than_is_expected() -> None:
    assert named_with(3.0) == 0.5
    assert named_with(0.0) == 0.0
    assert named_with(8.186) == pytest.approx(0.9, abs=1e-3)


def test_where_nobody_says_how_exact_readings_are_nothing_is_promised(
    project: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cohort = project / "config/cohorts/planned/cohort.yaml"
    told = cohort.read_text()
    sizes = ("measurement_sd", "accuracy", "  rotation_deg", "  translation_mm")
    kept = [one for one in told.splitlines(keepends=True) if not one.startswith(sizes)]
    cohort.write_text("".join(kept))
    try:
        words = ["new", "study", "planned", "--design", "--to", str(tmp_path / "a.csv")]
        assert main(["--root", str(project), *words]) == 1
    finally:
        cohort.write_text(told)
    assert "measurement_sd or accuracy" in capsys.readouterr().err
