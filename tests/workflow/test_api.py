"""What a notebook gives and what a run writes agree to the last bit; examples in docstrings run."""

import doctest
import html
import json
import shutil
from importlib import import_module
from pathlib import Path

import matplotlib as mpl
import pandas as pd
import pytest
import stiffening_chains
import straight_chains
from small_project import Project

import spinepipe as sp
from spinepipe.cli import main
from spinepipe.cohort import Cohort
from spinepipe.tidy.tables import write_tidy

ROOT = Path(__file__).parents[2]
mpl.use("Agg")
MODULES = (
    *("arrays", "cohorts", "machine", "missing_effects", "results"),
    *("sensitivity", "simulation", "stiffness"),
)


def cohort_of(project: Project, name: str) -> Cohort:
    return sp.read_cohort(project.path(f"config/cohorts/{name}"))


def same(found: pd.DataFrame, results: pd.DataFrame, **where: str) -> None:
    """Rows of a run that have these values, whatever their order, are those of the notebook."""
    for column, value in where.items():
        results, found = results[results[column] == value], found[found[column] == value]
    assert len(found)
    keys = [name for name in found if found[name].dtype == object]
    ours, theirs = (one.sort_values(keys).reset_index(drop=True) for one in (found, results))
    pd.testing.assert_frame_equal(ours, theirs, check_exact=True, check_dtype=False)


@pytest.mark.parametrize("module", MODULES)
def test_examples_say_what_is_so(module: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    found = doctest.testmod(import_module(f"spinepipe.api.{module}"), report=True)
    assert not found.failed


def test_stiffness_is_that_of_a_run(eight: Project) -> None:
    cohort, run = (
        cohort_of(eight, straight_chains.NAME),
        sp.open_results(eight.path("results/cohort_stiffness")),
    )
    for name in ("per_joint", "partially_pooled"):
        by_test = sp.calibrate(cohort, stiffness=name, leave_out="test")
        for table in ("stiffness", "errors"):
            mine = getattr(by_test, table)
            same(mine, run[table], representation=name, source="own")
        by_specimen = sp.calibrate(cohort, stiffness=name, leave_out="specimen")
        source = "others_median" if name == "per_joint" else "others_pooled"
        whole = {"representation": name, "source": source, "fitted_to": "all"}
        same(by_specimen.errors, run["errors"], **whole)
        same(by_specimen.predicted_stiffness, run["predicted_stiffness"], **whole)
        assert set(by_specimen.left_out["stage"]) == {"left_out_specimen"}


def test_a_model_moves_as_its_errors_say(eight: Project) -> None:
    """Mean error of a joint, from predicted less measured motion, is the one that the fit tells."""
    cohort = cohort_of(eight, straight_chains.NAME)
    fit = sp.calibrate(cohort, stiffness="per_joint", leave_out=None)
    keys = ["specimen", "test", "cycle", "step", "joint"]
    predicted = fit.predicted.to_dataframe().reset_index()
    both = predicted.merge(cohort.motion, on=keys, suffixes=("", "_measured"))
    off = (both["extension_deg"] - both["extension_deg_measured"]).abs()
    mean = off.groupby([both["specimen"], both["test"], both["joint"]]).mean().dropna()
    told = fit.errors[fit.errors["coordinate"] == "extension"]
    told = told.set_index(["specimen", "test", "joint"])["mae"]
    assert mean.loc[told.index].to_numpy() == pytest.approx(told.to_numpy(), abs=1e-9)


def test_missing_effects_are_those_of_a_run(eight: Project) -> None:
    found = sp.find_missing_effects(
        cohort_of(eight, "chains"),
        effects=["nonlinear_stiffening", "hysteresis"],
        settings={"bootstrap": 100},
    )
    run = sp.open_results(eight.path("results/discrepancy"))
    assert (found.verdict, found.table["name"].tolist()) == ("NAMED", ["nonlinear_stiffening"])
    same(found.misfit, run["gap"])
    same(found.candidates, run["candidates"])
    assert stiffening_chains.STIFFNESS.keys() == set(found.misfit["specimen"])
    assert len(sp.plot.effects(found).patches) == len(found.probabilities)
    # the model goes on into a fit
    fit = sp.calibrate(cohort_of(eight, "chains"), base=found.model, leave_out=None)
    plain = sp.calibrate(cohort_of(eight, "chains"), leave_out=None)
    assert fit.fits["cost"].sum() < 0.5 * plain.fits["cost"].sum()


def test_why_an_effect_is_named_or_not_is_told(
    eight: Project, capsys: pytest.CaptureFixture[str]
) -> None:
    """By the command line, from the files of the run; a wrong name with those that there are."""
    asked = ["--root", str(eight.folder), "why", "discrepancy"]
    for effect, words in (
        ("nonlinear_stiffening", "in the most probable set"),
        ("hysteresis", "not fitted"),
    ):
        assert main([*asked, effect]) == 0
        told = capsys.readouterr().out
        assert told.startswith("Verdict: NAMED. nonlinear_stiffening")
        assert "a name needs 0.95" in told
        assert words in told
    assert main([*asked, "histeresis"]) == 1
    assert "did you mean 'hysteresis'?" in capsys.readouterr().err


def test_indices_are_those_of_a_run(eight: Project) -> None:
    factors = {
        "load_point_x": {"of": "load_point", "axis": "x", "offset_mm": {"sd": 5}},
        "load_point_y": {"of": "load_point", "axis": "y", "offset_mm": {"sd": 5}},
        "bending": {
            "of": "stiffness",
            "coordinate": "right_bending",
            "times": {"low": 0.5, "high": 2},
        },
    }
    settings = {
        "design": {"method": "sobol", "samples": 64, "second_order": False},
        "outputs": {"motion": ["extension"], "joint_load": ["extension"]},
        "bootstraps": 200,
        "samples_per_target": 100,
    }
    found = sp.sensitivity(cohort_of(eight, "lever"), factors, settings=settings)
    run = sp.open_results(eight.path("results/global_sensitivity"))
    assert sp.plot.indices(found).get_xlabel() == "ST"
    same(found.table, run["indices"])
    same(found.responses, run["responses"])


def test_results_tell_what_they_hold_and_what_differs(eight: Project, tmp_path: Path) -> None:
    run = sp.open_results(eight.path("results/cohort_stiffness"))
    assert set(run.tables["name"]) == set(run)
    assert run["stiffness"].attrs["units"]["standard_error"]
    assert run.stale == []
    assert sp.compare(run, run).empty
    other = sp.open_results(eight.path("results/cohort_stiffness"))
    changed = run["stiffness"].copy()
    changed.loc[0, "stiffness"] += 1.0
    other._read["stiffness"] = changed.drop(index=1)
    told = sp.compare(run, other)
    assert told["column"].tolist() == ["", "stiffness"]
    assert told["difference"].iloc[1] == pytest.approx(1.0)
    with pytest.raises(FileNotFoundError, match="no tables"):
        sp.open_results(tmp_path)


def test_what_cannot_be_fitted_is_told_as_in_a_study_file(eight: Project) -> None:
    cohort = cohort_of(eight, straight_chains.NAME)
    with pytest.raises(sp.InputError, match="free"):
        sp.calibrate(cohort, free=["flexion"])
    assert set(sp.check(cohort)["severity"]) <= {"warning"}
    told = sp.check(eight.path("config/cohorts/nowhere"))
    assert told["severity"].tolist() == ["problem"]


def test_figures_and_pages_can_be_made(eight: Project, tmp_path: Path) -> None:
    cohort = cohort_of(eight, straight_chains.NAME)
    fit = sp.calibrate(cohort, stiffness="per_joint")
    shown = sp.plot.curves(cohort, cohort.tests[0], predicted=fit.predicted)
    assert {one.get_label() for one in shown.lines} >= {"measured, cycle 1", "predicted, cycle 1"}
    assert len(sp.plot.stiffness(fit).lines) == len(cohort.specimen_names)
    assert len(sp.plot.left_out(fit).patches) == len(cohort.tests)
    fit.report(tmp_path / "fit.html")
    for text in ((tmp_path / "fit.html").read_text(), fit._repr_html_()):
        assert fit.headline in text
        assert "data:image/png" in text
    assert list(fit.quality) == ["light", "check", "finding"]
    assert fit.cite().startswith("Stiffness in flexion")
    assert fit.predicted["extension_deg"].attrs["units"] == "deg"


def test_results_of_a_run_say_what_its_page_says(eight: Project, tmp_path: Path) -> None:
    """The kind of which the page is made too; and its tidy tables beside it."""
    folder = eight.path("results/range_of_motion")
    run = sp.open_results(folder)
    page = (folder / "report.html").read_text()
    assert run.headline in html.unescape(page)
    assert set(run.quality["light"]) <= {"ok", "check", "stop"}
    assert "static equilibrium" in run.cite()
    assert run.headline in html.unescape(run._repr_html_())
    arrays = run.xarray("range_of_motion")["predicted_extension_deg"]
    assert (arrays.attrs["units"], "step" in arrays.dims) == ("deg", True)
    run.report(tmp_path / "copy.html")
    assert (tmp_path / "copy.html").read_text() == page
    shutil.copytree(folder, tmp_path / "results")
    written = write_tidy(tmp_path / "results", "range_of_motion")
    assert [one.stem for one in written] == ["angles", "stiffness", "quality"]
    told = json.loads((tmp_path / "results/tidy/datapackage.json").read_text())
    fields = told["resources"][0]["schema"]["fields"]
    assert {"name": "predicted_extension_deg", "unit": "deg"}.items() <= next(
        one for one in fields if one["name"] == "predicted_extension_deg"
    ).items()
    for one in written:
        csv = pd.read_csv(one, keep_default_na=False, na_values=[""])
        parquet = pd.read_parquet(one.with_suffix(".parquet"))
        pd.testing.assert_frame_equal(csv, parquet, check_dtype=False)


def test_a_study_is_cited(eight: Project, capsys: pytest.CaptureFixture[str]) -> None:
    asked = ["--root", str(eight.folder), "cite", "range_of_motion"]
    assert main(asked) == 0
    told = capsys.readouterr().out
    assert "solved for static equilibrium" in told
    assert "@article{molder2021," in told
    assert "commit" not in told or len(told.split("commit now: ")[1].split()[0]) >= 7
    assert main([*asked, "--csl"]) == 0
    assert json.loads(capsys.readouterr().out)[0]["DOI"].startswith("10.12688/")
    assert main(["--root", str(eight.folder), "cite", "cohort_stiffness"]) == 1
    assert "report.html" in capsys.readouterr().err


def test_a_run_is_started_where_it_is_not_up_to_date(eight: Project) -> None:
    said: list[str] = []
    run = sp.run(eight.path("config/studies/range_of_motion.yaml"), cores=1, say=said.append)
    assert run.headline
    assert any("Nothing to be done" in one for one in said)
    with pytest.raises(sp.InputError, match="no such file"):
        sp.run(eight.path("config/studies/nothing.yaml"))
