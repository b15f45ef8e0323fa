"""Settings of searches for missing effects: every fault located, and what the cohort must have."""

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest
from chain_cases import DEGREES, STUDY, Chains
from sweeps import sweep

from spinepipe.effects import PlaceSpread, TriedValues, registry
from spinepipe.jobs.digest import settings_of
from spinepipe.jobs.expected import Expected
from spinepipe.model.file import EffectEntry, ModelFile, Scope, Values, write_model
from spinepipe.problems import InputError, InputProblem
from spinepipe.studies import read as studies
from spinepipe.studies.discrepancy.kind import KIND, DiscrepancyFiles
from spinepipe.studies.discrepancy.settings import Discrepancy

A = np.array([[50.0, 60.0, 200.0]] * 3)
FILE = f"config/studies/{STUDY}.yaml"
BASE = "base: {stiffness: per_specimen}\n"


class Slack:
    """Stands for an effect that may be tried."""

    trial: ClassVar[TriedValues] = TriedValues(({},), (PlaceSpread.SHARED,), "any test")


@pytest.fixture(autouse=True)
def _slack(monkeypatch: pytest.MonkeyPatch) -> None:
    """The registry with an effect `slack`, whatever effects the library has."""
    monkeypatch.setitem(registry._CLASSES, "slack", Slack)


def written(root: Path, study: str = BASE, **choices: object) -> Chains:
    """A project whose study is a search; changes of its cohort follow."""
    made = Chains({"a": A, "b": A}, **choices)  # type: ignore[arg-type]
    write(made, root, study)
    return made


def write(made: Chains, root: Path, study: str = BASE) -> None:
    made.write(root)
    head = f"study: {STUDY}\nkind: discrepancy\ncohort: chains\n"
    (root / FILE).write_text(head + study)


def complaints(root: Path) -> tuple[InputProblem, ...]:
    with pytest.raises(InputError) as caught:
        studies.check(root, STUDY)
    return caught.value.problems


def model(root: Path, *entries: EffectEntry, name: str = "model.yaml") -> str:
    """A base on a model file with these effects beside the bushing; the study's line."""
    effects = (EffectEntry(effect="linear_bushing"), *entries)
    (root / name).parent.mkdir(parents=True, exist_ok=True)
    write_model(ModelFile(model="m", cohort="chains", effects=effects), root / name)
    return f"base: {{model: {name}}}\n"


def test_four_lines_are_a_study(tmp_path: Path) -> None:
    written(tmp_path)
    study, cohort = studies.check(tmp_path, STUDY)
    assert isinstance(study, Discrepancy)
    assert (study.base.stiffness, study.base.model) == ("per_specimen", None)
    assert (study.seed, study.margin) == (2024, 3.0)
    sds = (2.0, 2.0, 1.0, 1.0, 1.0, 0.02, 0.02, 0.5)
    assert tuple(dict(study.nuisance).values()) == sds
    assert cohort.name == "chains"


def test_settings_of_versions_before_are_accepted(tmp_path: Path) -> None:
    before = "false_alarm: 0.01\nbootstrap: 100\nheld_out: {tests: false, refit: true}\n"
    written(tmp_path, "base: {stiffness: per_joint}\n" + before)
    study, _ = studies.check(tmp_path, STUDY)
    assert isinstance(study, Discrepancy)
    assert not {"false_alarm", "bootstrap", "held_out"} & set(study.model_dump())


def test_a_cohort_may_lie_anywhere(tmp_path: Path) -> None:
    written(tmp_path)
    away = tmp_path / "elsewhere" / "chains"
    away.parent.mkdir()
    (tmp_path / "config" / "cohorts" / "chains").rename(away)
    text = (tmp_path / FILE).read_text().replace("cohort: chains", f"cohort: {away}")
    (tmp_path / FILE).write_text(text)
    assert studies.check(tmp_path, STUDY)[1].folder == away


@dataclass(frozen=True)
class Case:
    """Lines of a study file from line 4 on; line and key of the fault, what is said and advised."""

    about: str
    study: str
    row: int
    key: str
    says: str
    remedy: str = ""


# One fault a line, however long: this is a table to look things up in.
# fmt: off
# ruff: noqa: E501
CASES = [
    Case("no base", "seed: 1", 1, "base", "the key is missing"),
    Case("empty base", "base: {}", 4, "base", "exactly one of the two"),
    Case("two bases", "base: {stiffness: per_joint, model: m.yaml}", 4, "base", "exactly one of the two"),
    Case("unknown base", "base: {stiffness: per_level}", 4, "base.stiffness", "'per_joint'"),
    Case("unknown key", BASE + "margins: 3", 5, "margins", "did you mean 'margin'"),
    Case("unknown test", BASE + "tests: [flexon]", 5, "tests.0", "unknown test 'flexon'", "did you mean 'flexion'"),
    Case("unknown coordinate", BASE + "coordinates: [flexion]", 5, "coordinates.0", "'extension'"),
    Case("coordinate that was not measured", BASE + "coordinates: [extension, superior]", 5, "coordinates.1", "which was not measured"),
    Case("unknown effect", BASE + "effects: [slak]", 5, "effects.0", "unknown effect 'slak'", "did you mean 'slack'"),
    Case("effect that cannot be tried", BASE + "effects: [slack, linear_bushing]", 5, "effects.1", "does not say how it may be tried"),
    Case("effect twice", BASE + "effects: [slack, slack]", 5, "effects", "'slack' stands there twice"),
    Case("no effect wanted", BASE + "most_effects: 0", 5, "most_effects", "greater than or equal to 1"),
    Case("negative margin", BASE + "margin: -1", 5, "margin", "greater than or equal to 0"),
    Case("negative nuisance", BASE + "nuisance: {load_gain: -0.1}", 5, "nuisance.load_gain", "greater than or equal to 0"),
    Case("unknown nuisance", BASE + "nuisance: {load_axis: 1}", 5, "nuisance.load_axis", "did you mean 'load_axis_deg'"),
    Case("no model file", "base: {model: none.yaml}", 4, "base.model", "no file 'none.yaml'"),
    Case("its own result", "base: {model: results/probe/discrepancy/model_base.yaml}", 4, "base.model", "does not write itself"),
]
# fmt: on


@sweep("case", CASES)
def test_fault_of_the_study_is_located_and_explained(case: Case, tmp_path: Path) -> None:
    written(tmp_path, case.study + "\n")
    problems = complaints(tmp_path)
    listing = "\n".join(map(str, problems))
    rows = (case.row, None) if case.row == 1 else (case.row,)
    here = [p for p in problems if p.file == FILE and p.column == case.key and p.row in rows]
    assert any(case.says in str(p) and case.remedy in p.remedy for p in here), listing
    assert all(p.found and p.allowed and p.remedy for p in problems), listing


def test_what_a_model_lacks_shows_in_motion(tmp_path: Path) -> None:
    written(tmp_path)
    (tmp_path / "config" / "cohorts" / "chains" / "motion.csv").unlink()
    (problem,) = complaints(tmp_path)
    assert (problem.row, problem.column) == (3, "cohort")
    assert "no motion.csv" in problem.found


def test_a_specimen_without_readings_is_named(tmp_path: Path) -> None:
    made = Chains({"a": A, "b": A})
    made.motion = made.motion[made.motion["specimen"] == "a"]
    write(made, tmp_path)
    (problem,) = complaints(tmp_path)
    assert problem.found == "no motion of specimen 'b' in any chosen test"


def test_zeros_of_zeroing_are_no_readings(tmp_path: Path) -> None:
    made = Chains({"a": A, "b": A}, zeroed=True)
    later = (made.motion["test"] == "flexion") & (made.motion["step"] > 0)
    made.motion.loc[later, list(DEGREES)] = np.nan
    write(made, tmp_path, BASE + "tests: [left_axial_rotation, flexion]\n")
    (problem,) = complaints(tmp_path)
    assert problem.column == "tests.1"
    assert problem.found == "test 'flexion', which has no motion"


def test_translations_alone_are_enough(tmp_path: Path) -> None:
    """Shear: force and displacement of one joint, and nobody read how it turned."""
    made = Chains({"a": A, "b": A})
    for degrees in DEGREES:
        made.motion[degrees] = np.nan
    made.motion["anterior_mm"] = 0.5
    write(made, tmp_path)
    assert studies.check(tmp_path, STUDY)


def test_noise_must_be_known_from_somewhere(tmp_path: Path) -> None:
    written(tmp_path, sd=False)
    (problem,) = complaints(tmp_path)
    assert problem.column == "measurement_sd"
    assert "no rotation was read in two cycles" in problem.found
    assert "set measurement_sd:" in problem.remedy


@sweep(
    "study, choices",
    [
        (BASE, {"sd": False, "cycles": 2}),
        (BASE + "measurement_sd: {rotation_deg: 0.1, translation_mm: 0.1}\n", {"sd": False}),
    ],
)
def test_repeats_or_declared_sds_will_do(study: str, choices: dict, tmp_path: Path) -> None:
    written(tmp_path, study, **choices)
    assert studies.check(tmp_path, STUDY)


def test_cycles_of_other_tests_are_no_repeats(tmp_path: Path) -> None:
    made = Chains({"a": A, "b": A}, cycles=2, sd=False)
    for table in ("loads", "motion"):
        rows = getattr(made, table)
        setattr(made, table, rows[(rows["cycle"] == 1) | (rows["test"] != "flexion")])
    write(made, tmp_path, BASE + "tests: [flexion]\n")
    assert [problem.column for problem in complaints(tmp_path)] == ["measurement_sd"]


def mark_of_search(root: Path) -> str:
    """What all results of the search must carry."""
    return Expected(str(root), *studies.check(root, STUDY)).of_job("search", {})


def test_a_sound_model_file_is_a_base(tmp_path: Path) -> None:
    study = model(tmp_path, name="results/other/model_with_effects.yaml")
    written(tmp_path, study)
    found, _ = studies.check(tmp_path, STUDY)
    assert isinstance(found, Discrepancy)
    assert found.base.model == "results/other/model_with_effects.yaml"
    assert KIND.job("search").reads_base
    before = mark_of_search(tmp_path)
    base = tmp_path / "results/other/model_with_effects.yaml"
    base.write_text(base.read_text("utf-8") + "# another\n", "utf-8")
    assert mark_of_search(tmp_path) != before, "the search hangs on this very file"


ELSEWHERE = {
    "scope.joints": ("L1L2", Scope(joints=("L1L2",)), ()),
    "values.joint": ("L1L2", Scope(), (Values(joint="L1L2"),)),
    "scope.specimens": ("specimen 'z'", Scope(specimens=("z",)), ()),
    "values.specimen": ("specimen 'z'", Scope(), (Values(specimen="z"),)),
    "scope.tests": ("test 'twist'", Scope(tests=("twist",)), ()),
}


@sweep("place", ELSEWHERE)
def test_a_model_of_another_spine_is_refused(place: str, tmp_path: Path) -> None:
    found, scope, values = ELSEWHERE[place]
    entry = EffectEntry(effect="linear_bushing", scope=scope, values=values)
    written(tmp_path, model(tmp_path, entry))
    (problem,) = complaints(tmp_path)
    assert (problem.file, problem.column) == ("model.yaml", f"effects.1.{place}")
    assert found in problem.found


def test_a_model_that_another_study_makes_may_come_later(tmp_path: Path) -> None:
    written(tmp_path, "base: {model: results/first/discrepancy/model_with_effects.yaml}\n")
    assert [problem.column for problem in complaints(tmp_path)] == ["base.model"]
    (tmp_path / "config" / "studies" / "first.yaml").write_text("study: first\n")
    assert studies.check(tmp_path, STUDY)


def test_problems_of_the_model_file_are_told(tmp_path: Path) -> None:
    written(tmp_path, model(tmp_path))
    text = (tmp_path / "model.yaml").read_text().replace("linear_bushing", "linear_bush")
    (tmp_path / "model.yaml").write_text(text)
    (problem,) = complaints(tmp_path)
    assert problem.file == "model.yaml"
    assert "unknown effect 'linear_bush'" in problem.allowed


def test_all_results_but_the_page_lie_in_one_folder(tmp_path: Path) -> None:
    written(tmp_path)
    study, cohort = studies.check(tmp_path, STUDY)
    assert isinstance(study, Discrepancy)
    files = DiscrepancyFiles.of(study, cohort)
    results = set(files.results())
    tables = {"gap", "candidates", "where", "confusions", "held_out"}
    named = {f"{name}.parquet" for name in tables}
    named |= {"verdict.json", "model_base.yaml", "model_with_effects.yaml"}
    folder = f"results/{STUDY}/discrepancy"
    assert {f"{folder}/{name}" for name in named} <= results
    pages = {file for file in results if not file.startswith(f"{folder}/")}
    assert pages == {f"results/{STUDY}/report.html"}
    assert files.lost() == []


def test_every_setting_counts_for_the_search(tmp_path: Path) -> None:
    written(tmp_path)
    study, _ = studies.check(tmp_path, STUDY)
    counted = settings_of(study, KIND.job("search").ignores)
    assert set(counted) == set(Discrepancy.model_fields)
