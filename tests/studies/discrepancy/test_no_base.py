"""A base model that cannot be fitted: a verdict all the same, with what looks wrong in the data."""

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow.parquet as pq
import pytest
from chain_cases import JOINTS, STUDY
from discrepancy_cases import files_of_a_search, project
from sweeps import sweep

from spinepipe.jobs import draw, report
from spinepipe.model.file import effects_for, read_model
from spinepipe.studies.discrepancy import job as search
from spinepipe.studies.discrepancy.kind import KIND

ROOT = Path(__file__).resolve().parents[3]
START = [149000.0, 1890000.0, 135000.0, 51.0, 68.8, 291.0]
"""Default stiffness of studies (docs/studies/discrepancy.md): N/m, then N m/rad."""


def searched(root: Path, study: str = "base: {stiffness: per_specimen}\n") -> Path:
    """Results of a cohort whose moments are 60 times too large; the folder they are in."""
    project(root, study)
    path = root / "config/cohorts/chains/loads.csv"
    loads = pd.read_csv(path)
    loads[["mx_nm", "my_nm", "mz_nm"]] *= 60.0
    loads.to_csv(path, index=False)
    folder = root / "results" / STUDY / "discrepancy"
    folder.mkdir(parents=True)
    search.run(str(root), STUDY, **files_of_a_search(folder))
    return folder


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return searched(tmp_path_factory.mktemp("no_base"))


@pytest.fixture(scope="module")
def verdict(folder: Path) -> Mapping[str, Any]:
    found: Mapping[str, Any] = json.loads((folder / "verdict.json").read_text())
    return found


def test_the_verdict_says_that_nothing_is_known_and_why(verdict: Mapping[str, Any]) -> None:
    assert verdict["verdict"] == "UNKNOWN"
    assert verdict["why"].startswith("the base model cannot be fitted: a, test flexion, step 2")
    assert verdict["effects"] == verdict["candidates_in_set"] == []
    assert set(verdict["unknown"]) == {"where", "shape", "reason", "coordinate", "stays"}
    assert verdict["imperfections"] is None
    assert "flexion" in verdict["unknown"]["where"]
    sizes = [v for key in ("gap", "rms_residual") for k, v in verdict[key].items() if k != "unit"]
    assert set(sizes) == {None}


def test_the_mistake_is_pointed_to(verdict: Mapping[str, Any]) -> None:
    (error,) = verdict["suspected_data_errors"]
    assert error["where"] == "all specimens"
    assert error["what"].startswith("unit")


def test_tables_hold_their_schemas_and_no_rows(folder: Path) -> None:
    for schema in KIND.tables:
        table = pq.read_table(folder / f"{schema.name}.parquet")
        assert table.num_rows == 0
        assert table.column_names == [column.name for column in schema.columns]


@sweep("of", ["base", "with_effects"])
def test_models_are_where_the_fit_started_and_say_so(folder: Path, of: str) -> None:
    model = read_model(folder / f"model_{of}.yaml")
    assert model.model == f"{STUDY}_{of}_not_fitted"
    (bushing,) = effects_for(model, "a", JOINTS)
    assert bushing.values.tolist() == [START] * len(JOINTS)


def test_a_model_file_stays_the_start_that_it_was(tmp_path: Path) -> None:
    text = (
        "model: given\ncohort: chains\neffects:\n- effect: linear_bushing\n"
        "  values:\n  - {extension_nm_per_rad: 9.0}\n- effect: facet_contact\n"
    )
    (tmp_path / "given.yaml").write_text(text)
    made = searched(tmp_path, f"base: {{model: {tmp_path / 'given.yaml'}}}\n")
    model = read_model(made / "model_with_effects.yaml")
    assert [entry.effect for entry in model.effects] == ["linear_bushing", "facet_contact"]
    assert effects_for(model, "a", JOINTS)[0].values[0, 3] == 9.0


def test_figures_and_report_cope(folder: Path) -> None:
    root, verdict, drawn = str(folder.parents[2]), str(folder / "verdict.json"), []
    for figure in KIND.figures:
        paths = [str(folder / f"{table}.parquet") for table in figure.tables]
        svg, pdf, png = (str(folder / f"{figure.name}.{end}") for end in ("svg", "pdf", "png"))
        others = {"verdict": verdict} if "verdict.json" in figure.reads else {}
        draw.run(root, STUDY, figure.name, paths, svg, pdf, png, **others)
        drawn.append(svg)
        assert "<desc>" in Path(svg).read_text()
    paths = [str(folder / f"{table.name}.parquet") for table in KIND.tables]
    output, leading = folder.parent / "report.html", folder / "report.html"
    former = {"former": str(leading), "verdict": verdict}
    report.run(root, STUDY, "report", paths, drawn, str(output), **former)
    page = output.read_text()
    told = re.findall(r'(?:url=|href=)"?([^"]+)"', leading.read_text())
    assert told == ["../report.html"] * 2
    described = json.loads((folder / "datapackage.json").read_text())["resources"]
    assert all((folder / one["path"]).is_file() for one in described)
    assert len(described) == len(KIND.tables)
    assert "he base model cannot be fitted: a, test flexion" in page
    assert "before the files are checked: all specimens" in page
    assert "none of the known effects" not in page
