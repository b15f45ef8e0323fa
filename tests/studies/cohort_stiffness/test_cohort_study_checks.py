"""Settings of cohort studies: every fault located and explained, and what the cohort must have.

Seen here: a fault that passes, is told of another line or key, or without what to do.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from chain_cases import DEGREES, MOMENT_OF, STUDY, Chains
from cohort_edge_cases import A

from spinepipe.documents.names import ALLOWED
from spinepipe.problems import InputError, InputProblem
from spinepipe.studies import read as studies
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness

FILE = f"config/studies/{STUDY}.yaml"
LEVEL = "{extension_nm_per_rad: 50, right_bending_nm_per_rad: 50, left_rotation_nm_per_rad: 50}"


def chains(study: str = "", **choices: object) -> Chains:
    return Chains({"a": A, "b": A}, study=study, **choices)  # type: ignore[arg-type]


def complaints(made: Chains, root: Path) -> tuple[InputProblem, ...]:
    made.write(root)
    with pytest.raises(InputError) as caught:
        studies.check(root, STUDY)
    return caught.value.problems


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
    Case("unknown key", "cycle: all", 4, "cycle", "did you mean 'cycles'"),
    Case("negative seed", "seed: -1", 4, "seed", "greater than or equal to 0"),
    Case("broken seed", "seed: 1.5", 4, "seed", "valid integer"),
    Case("no tests", "tests: []", 4, "tests", "at least 1 of them"),
    Case("test twice", "tests: [flexion, flexion]", 4, "tests", "'flexion' stands there twice"),
    Case("test without a name", "tests: ['']", 4, "tests.0", "at least 1 character"),
    Case("unknown test", "tests: [flexion, flexon]", 4, "tests.1", "unknown test 'flexon'", "did you mean 'flexion'"),
    Case("unknown cycles", "cycles: quiet", 4, "cycles", "did you mean 'quietest'"),
    Case("unknown steps", "steps: last", 4, "steps", "'all' or 'peak'"),
    Case("stiffness of no threshold", "neutral_zone_below_nm_per_deg: 1.0", 4, "neutral_zone_below_nm_per_deg", "1, and no threshold asked for", "choose another definition"),
    Case("threshold without a stiffness", "neutral_zone: threshold", 4, "neutral_zone", "without neutral_zone_below_nm_per_deg", "give both"),
    Case("no representation", "representations: []", 4, "representations", "at least 1 of them"),
    Case("unknown representation", "representations: [per_level]", 4, "representations.0", "'per_joint'"),
    Case("literature is no fit", "representations: [literature]", 4, "representations.0", "'per_joint'"),
    Case("representation twice", "representations: [per_joint, per_joint]", 4, "representations", "'per_joint' stands there twice"),
    Case("nothing free", "free: []", 4, "free", "at least 1 of them"),
    Case("unknown coordinate", "free: [flexion]", 4, "free.0", "'extension'"),
    Case("coordinate twice", "free: [extension, extension]", 4, "free", "'extension' stands there twice"),
    Case("unknown cost", "cost: unweighted", 4, "cost", "'measurement_sd' or 'published'"),
    Case("translation at the published cost", "cost: published\nfree: [extension, superior]", 5, "free", "found superior", "choose cost: measurement_sd"),
    Case("SD of zero", "measurement_sd: {rotation_deg: 0, translation_mm: 1}", 4, "measurement_sd.rotation_deg", "greater than 0"),
    Case("half an SD", "measurement_sd: {rotation_deg: 1}", 4, "measurement_sd.translation_mm", "the key is missing"),
    Case("no stiffness", "stiffness: {right_n_per_m: 0}", 4, "stiffness.right_n_per_m", "greater than or equal to 1"),
    Case("stiffness without unit", "stiffness: {anterior: 5}", 4, "stiffness.anterior", "did you mean 'anterior_n_per_m'"),
    Case("unknown joint", f"level_stiffness:\n  L5S1: {LEVEL}\n  L4L6: {LEVEL}\nrepresentations: [per_joint]", 6, "level_stiffness.L4L6", "unknown joint 'L4L6'", "did you mean 'L4L5'"),
    Case("missing joints", f"level_stiffness:\n  L5S1: {LEVEL}", 4, "level_stiffness", "no value for L4L5, L3L4", "leave level_ratio out"),
    Case("half a level", "level_stiffness: {L5S1: {extension_nm_per_rad: 5}}", 4, "level_stiffness.L5S1.right_bending_nm_per_rad", "the key is missing"),
    Case("bounds of one", "bound_factor: 1", 4, "bound_factor", "greater than 1"),
    Case("no start", "starts: 0", 4, "starts", "greater than or equal to 1"),
    Case("too many starts", "starts: 51", 4, "starts", "less than or equal to 50"),
    Case("everything identifiable", "identifiable_below: 0", 4, "identifiable_below", "greater than 0"),
    Case("NaN", "identifiable_below: .nan", 4, "identifiable_below", "finite"),
    Case("unknown hold-out", "cross_validation: {levels: true}", 4, "cross_validation.levels", "unknown key"),
    Case("number for yes", "cross_validation: {specimens: 1}", 4, "cross_validation.specimens", "valid boolean"),
    Case("surely significant", "significance: 1", 4, "significance", "less than 1"),
]
# fmt: on


def test_faults_of_the_study_are_located_and_explained(tmp_path: Path) -> None:
    chains().write(tmp_path)
    study = tmp_path / FILE
    head = study.read_text(encoding="utf-8")
    missed = dict[str, str]()
    for case in CASES:
        study.write_text(f"{head}{case.study}\n", encoding="utf-8")
        with pytest.raises(InputError) as caught:
            studies.check(tmp_path, STUDY)
        problems = caught.value.problems
        here = [p for p in problems if (p.file, p.row, p.column) == (FILE, case.row, case.key)]
        told = any(case.says in str(p) and case.remedy in p.remedy for p in here)
        if not told or not all(p.found and p.allowed and p.remedy for p in problems):
            missed[case.about] = "\n".join(map(str, problems))
    assert not missed


def test_weights_need_an_sd(tmp_path: Path) -> None:
    (problem,) = complaints(chains(sd=False), tmp_path)
    assert problem.column == "measurement_sd"
    assert "choose cost: published" in problem.remedy


def test_stiffness_is_fitted_to_motion(tmp_path: Path) -> None:
    made = chains()
    made.write(tmp_path)
    (tmp_path / "config" / "cohorts" / "chains" / "motion.csv").unlink()
    with pytest.raises(InputError, match=r"line 3, cohort: .*no motion.csv"):
        studies.check(tmp_path, STUDY)


@pytest.mark.parametrize(
    ("study", "zeroed", "columns", "where", "key", "found"),
    [
        ("", False, DEGREES, {"specimen": "b"}, "tests", "no motion of specimen 'b' in any"),
        ("free: [extension]\n", False, DEGREES[:1], {"specimen": "b"}, "tests", "specimen 'b'"),
        ("", True, DEGREES, {"specimen": "b"}, "tests", "specimen 'b'"),
        (
            "tests: [left_axial_rotation, flexion]\n",
            False,
            DEGREES,
            {"test": "flexion"},
            "tests.1",
            "test 'flexion', which has no motion",
        ),
    ],
)
def test_who_was_not_read_in_what_is_fitted_is_named(
    study: str,
    zeroed: bool,
    columns: Sequence[str],
    where: dict[str, str],
    key: str,
    found: str,
    tmp_path: Path,
) -> None:
    """Zeros that zeroing makes are no motion."""
    made = chains(study, zeroed=zeroed)
    here = made.where(**where) & (made.motion["step"] >= int(zeroed))
    made.motion.loc[here, list(columns)] = np.nan
    (problem,) = complaints(made, tmp_path)
    assert problem.column == key
    assert found in problem.found


def with_a_test_called(name: str, study: str = "") -> Chains:
    made = chains(study)
    for table in (made.loads, made.motion):
        table["test"] = table["test"].replace("left_lateral_bending", name)
    return made


def test_names_of_tests_that_results_could_not_bear(tmp_path: Path) -> None:
    for name in ("all", "nothing", "all_but_flexion"):
        (problem,) = complaints(with_a_test_called(name), tmp_path / name)
        assert (problem.file, problem.column) == ("chains/loads.csv", "test")
        assert problem.found == f"test {name!r}"
        assert "rename" in problem.remedy


def test_names_that_no_table_may_have(tmp_path: Path) -> None:
    for number, name in enumerate(("a/b", "a=b", "{a}", ".a", "a\x07b")):
        loads, motion = complaints(with_a_test_called(name), tmp_path / str(number))
        assert (loads.file, motion.file) == ("chains/loads.csv", "chains/motion.csv")
        if "\x07" in name:
            assert "control character" in loads.found
            continue
        assert loads.column == "test"
        assert f"'{name}'" in loads.found
        assert loads.allowed == ALLOWED
        assert "rename" in loads.remedy


def test_a_test_that_is_not_chosen_may_be_called_anything(tmp_path: Path) -> None:
    with_a_test_called("all", "tests: [flexion]\n").write(tmp_path)
    assert studies.check(tmp_path, STUDY)


def test_nobody_is_no_specimen(tmp_path: Path) -> None:
    (problem,) = complaints(Chains({"a": A, "nobody": A}), tmp_path)
    assert (problem.file, problem.found) == ("chains/specimens.csv", "'nobody'")


def test_faults_of_study_and_cohort_come_together(tmp_path: Path) -> None:
    made = chains(f"tests: [flexon]\nlevel_stiffness: {{L4L6: {LEVEL}}}\n", sd=False)
    keys = [problem.column for problem in complaints(made, tmp_path)]
    assert set(keys) >= {"tests.0", "level_stiffness.L4L6", "level_stiffness", "measurement_sd"}


def test_published_levels_that_the_cohort_lacks_are_no_fault(tmp_path: Path) -> None:
    """The paper's six joints stand in every study, whatever spine it is of."""
    chains().write(tmp_path)
    study, cohort = studies.check(tmp_path, STUDY)
    assert isinstance(study, CohortStiffness)
    assert not set(study.level_stiffness) <= set(cohort.joint_names)
    assert set(MOMENT_OF) == set(cohort.tests)


def test_every_field_is_described() -> None:
    schema = CohortStiffness.model_json_schema()
    for part in (schema, *schema["$defs"].values()):
        for name, field in part["properties"].items():
            assert field.get("description"), name
