"""Studies: defaults, places, and every fault of a study file located and explained.

Catches a study file's fault that is accepted or told at another place.
"""

from dataclasses import dataclass
from pathlib import Path

import pytest
from cohort_cases import Change, cell, joints, line, swap, text, without, write
from sweeps import sweep

from spinepipe import cohort
from spinepipe.problems import InputError, InputProblem
from spinepipe.studies import read as studies
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity

STUDY = """\
study: probe
kind: joint_pose_sensitivity
cohort: small
poses: 20
tests: [flexion]
calibration:
  free: [extension, superior]
  weights: {anterior: 10, superior: 1, right: 0}
"""

FILE = "config/studies/probe.yaml"


def project(root: Path, study: str = STUDY, *changes: Change) -> Path:
    """A project folder with one study and one cohort."""
    (root / "config" / "studies").mkdir(parents=True)
    (root / FILE).write_text(study)
    (root / "config" / "config.yaml").write_text("studies: [probe]\n")
    write(root / "config" / "cohorts" / "small", *changes)
    return root


def complaints(root: Path) -> tuple[InputProblem, ...]:
    """What checking the study complains about."""
    with pytest.raises(InputError) as caught:
        studies.check(root, "probe")
    return caught.value.problems


@dataclass(frozen=True)
class Case:
    """A fault of the study file: one replacement in it (None: added at the end), what is said."""

    about: str
    old: str | None
    new: str
    row: int | None
    key: str | None
    says: str


# One fault a line, however long: this is a table to look things up in.
# fmt: off
ALONE = [
    Case("empty", STUDY, "", None, None, "an empty file"),
    Case("broken YAML", "[flexion]", "[flexion", 5, None, "no YAML"),
    Case("repeated key", None, "poses: 30", 9, "poses", "the same key twice"),
    Case("repeated inside", "right: 0}", "right: 0, right: 1}", 8, "calibration.weights.right", "twice"),
    Case("unknown key", "poses:", "posses:", 4, "posses", "did you mean 'poses'"),
    Case("unknown inside", "free:", "fre:", 7, "calibration.fre", "did you mean 'free'"),
    Case("no study", "study: probe\n", "", None, "study", "add `study:`"),
    Case("no kind", "kind: joint_pose_sensitivity\n", "", None, "kind", "the key is missing"),
    Case("unknown kind", "joint_pose_sens", "joint_sens", 2, "kind", "did you mean 'joint_pose_sensitivity'"),
    Case("no cohort", "cohort: small\n", "", None, "cohort", "add `cohort:`"),
    Case("other name", "study: probe", "study: prob", 1, "study", "the file's name, 'probe'"),
    Case("bad name", "study: probe", "study: Probe 1", 1, "study", "equal to the file's"),
    Case("unknown cohort", "cohort: small", "cohort: smal", 3, "cohort", "did you mean 'small'"),
    Case("text for a number", "poses: 20", "poses: many", 4, "poses", "valid integer"),
    Case("broken number", "poses: 20", "poses: 2.5", 4, "poses", "valid integer"),
    Case("yes for a number", "poses: 20", "poses: yes", 4, "poses", "valid integer"),
    Case("one pose", "poses: 20", "poses: 1", 4, "poses", "greater than or equal to 2"),
    Case("too many poses", "poses: 20", "poses: 20001", 4, "poses", "less than or equal to 20000"),
    Case("negative seed", None, "seed: -1", 9, "seed", "greater than or equal to 0"),
    Case("no tests", "[flexion]", "[]", 5, "tests", "at least 1 of them"),
    Case("test twice", "[flexion]", "[flexion, flexion]", 5, "tests", "'flexion' stands there twice"),
    Case("SD of zero", None, "landmark_sd_mm: 0", 9, "landmark_sd_mm", "greater than 0"),
    Case("NaN", None, "landmark_sd_mm: .nan", 9, "landmark_sd_mm", "finite"),
    Case("no stiffness", None, "stiffness: {right_n_per_m: 0}", 9, "stiffness.right_n_per_m", "greater than or equal to 1"),
    Case("stiffness without unit", None, "stiffness: {anterior: 5}", 9, "stiffness.anterior", "did you mean 'anterior_n_per_m'"),
    Case("negative damping", None, "damping: {rotation_nm_s_per_rad: -1}", 9, "damping.rotation_nm_s_per_rad", "greater than 0"),
    Case("far shift", None, "load_point_shift_mm: {anterior: 900}", 9, "load_point_shift_mm.anterior", "equal to 200"),
    Case("unknown loading", None, "loading: settled", 9, "loading", "did you mean 'settle'"),
    Case("no time", None, "settle_time_s: 0", 9, "settle_time_s", "greater than 0"),
    Case("unknown coordinate", "superior]", "flexion]", 7, "calibration.free.1", "'extension'"),
    Case("coordinate twice", "superior]", "extension]", 7, "calibration.free", "'extension' stands there twice"),
    Case("nothing free", "[extension, superior]", "[]", 7, "calibration.free", "at least 1 of them"),
    Case("unknown grouping", None, "  grouping: per_level", 9, "calibration.grouping", "'per_specimen' or 'per_joint'"),
    Case("weight of nothing", "anterior: 10", "pitch: 10", 8, "calibration.weights.pitch", "unknown key"),
    Case("all weights zero", "{anterior: 10, superior: 1, right: 0}", "{anterior: 0, superior: 0, right: 0, extension: 0}", 8, "calibration.weights", "at least one weight"),
    Case("bounds of one", None, "  bound_factor: 1", 9, "calibration.bound_factor", "greater than 1"),
    Case("no start", None, "  starts: 0", 9, "calibration.starts", "greater than or equal to 1"),
    Case("calibration is a list", STUDY[STUDY.index("calibration"):], "calibration: [1]\n", 6, "calibration", "write keys below it"),
]

WITH_COHORT = [
    Case("unknown test", "[flexion]", "[flexion, flexon]", 5, "tests.1", "did you mean 'flexion'"),
    Case("more best than poses", "poses: 20", "poses: 5", None, "best_models", "at most the number of poses, 5"),
    Case("weight on nothing", "anterior: 10, superior: 1, right: 0", "anterior: 0, superior: 0, right: 1, extension: 0", 8, "calibration.weights", "no weight on anything that was measured"),
]

COHORT_CASES = [
    ("no landmarks", [without("landmarks.csv"), text("joints.csv", joints())], "cohort", "the study samples landmarks"),
    ("no motion", [without("motion.csv")], "cohort", "the study calibrates on motion"),
    ("no SD", [cell("landmarks.csv", 5, "sd_mm", "")], "landmark_sd_mm", "1 of 24 landmarks without sd_mm (first: a, L4, right_pedicle_base)"),
    ("specimen not measured", [line("motion.csv", n, None) for n in range(13, 7, -1)], "tests", "no motion of specimen 'b'"),
    ("motion of another test", [text("motion.csv", "specimen,test,step,joint,extension_deg\na,flexion,0,L3L4,\n")], "tests", "no motion in any chosen test"),
]
# fmt: on


@sweep("case", [*ALONE, *WITH_COHORT], lambda c: c.about.replace(" ", "-"))
def test_fault_of_the_study_is_located_and_explained(case: Case, tmp_path: Path) -> None:
    assert case.old is None or case.old in STUDY
    study = STUDY + case.new + "\n" if case.old is None else STUDY.replace(case.old, case.new, 1)
    problems = complaints(project(tmp_path, study))
    listing = "\n".join(map(str, problems))
    here = [p for p in problems if (p.file, p.row, p.column) == (FILE, case.row, case.key)]
    assert any(case.says in str(problem) for problem in here), listing


def test_a_run_that_was_started_elsewhere_is_sent_to_the_project(tmp_path: Path) -> None:
    with pytest.raises(
        InputError, match=rf"no such file in {tmp_path}, nor.*`snakemake -d FOLDER`"
    ):
        studies.read_selection(tmp_path)
    (tmp_path / "config").mkdir()
    with pytest.raises(InputError, match=r"found no such file; allowed: .*; add it$"):
        studies.read_selection(tmp_path)


def test_a_folder_that_no_cohort_can_be_is_to_be_renamed(tmp_path: Path) -> None:
    root = project(tmp_path, STUDY.replace("cohort: small", "cohort: My-Cohort"))
    (root / "config/cohorts/small").rename(root / "config/cohorts/My-Cohort")
    (problem,) = complaints(root)
    assert problem.found == "'My-Cohort', a folder whose name no cohort can have"
    assert problem.allowed == "none, or the path of a folder"
    assert problem.remedy.startswith("rename it with a-z, 0-9 and _ alone")
    with pytest.raises(InputError, match=r"found 'small'.*rename the folder: names of cohorts are"):
        cohort.read(root / "config/cohorts/My-Cohort")


@sweep("about, changes, key, says", COHORT_CASES)
def test_cohort_that_does_not_serve_the_study(
    about: str, changes: list[Change], key: str, says: str, tmp_path: Path
) -> None:
    problems = complaints(project(tmp_path, STUDY, *changes))
    assert [p.column for p in problems] == [key], about
    assert says in str(problems[0])


def test_settling_needs_inertia_of_every_vertebra(tmp_path: Path) -> None:
    """Specimen b of the small cohort has masses only."""
    (problem,) = complaints(project(tmp_path, STUDY + "loading: settle\n"))
    assert problem.column == "loading"
    assert "no inertia in bodies.csv for L3 of b, L2 of b" in problem.found


def test_settling_needs_masses(tmp_path: Path) -> None:
    weightless = swap("cohort.yaml", "gravity: true", "gravity: false")
    root = project(tmp_path, STUDY + "loading: settle\n", weightless, without("bodies.csv"))
    (problem,) = complaints(root)
    assert problem.column == "loading"


def test_landmarks_must_suffice_even_beside_joint_poses(tmp_path: Path) -> None:
    change = line("landmarks.csv", 14, None)
    (problem,) = complaints(project(tmp_path, STUDY, change, text("joints.csv", joints())))
    assert "L3L4 of specimen 'b'" in problem.found


def test_faults_of_study_and_cohort_come_in_one_error(tmp_path: Path) -> None:
    study = STUDY.replace("poses: 20", "poses: 1") + "colour: red\n"
    root = project(tmp_path, study, cell("motion.csv", 2, "extension_deg", "x"))
    files = [problem.file for problem in complaints(root)]
    assert sorted(files) == [FILE, FILE, "small/motion.csv"]


def test_defaults(tmp_path: Path) -> None:
    root = project(
        tmp_path, "study: probe\nkind: joint_pose_sensitivity\ncohort: small\nstiffness: {}\n"
    )
    study = studies.read(root / FILE, root)
    assert isinstance(study, JointPoseSensitivity)
    assert (study.seed, study.tests, study.poses, study.block) == (2024, None, 500, 25)
    assert study.stiffness.in_order() == (24600.0, 110000.0, 13500.0, 37.0, 64.0, 268.0)
    assert study.damping.in_order() == (1000.0, 1000.0, 1000.0, 1.4, 1.4, 1.4)
    assert study.calibration.weights.in_order() == (10.0, 100.0, 1.0, 1.0, 0.0, 0.0)
    assert study.calibration.free == ("auto",)
    assert study.load_point_shift_mm.in_order() == (0.0, 0.0, 0.0)


def test_absent_study_is_named_with_those_that_exist(tmp_path: Path) -> None:
    root = project(tmp_path)
    with pytest.raises(InputError, match="did you mean 'probe'"):
        studies.check(root, "prob")


def test_cohort_by_name_by_relative_and_by_absolute_path(tmp_path: Path) -> None:
    def folder(name: str) -> Path:
        study = JointPoseSensitivity(study="s", kind="joint_pose_sensitivity", cohort=name)
        return study.cohort_folder(tmp_path)

    assert folder("small") == tmp_path / "config" / "cohorts" / "small"
    assert folder("../data/small") == tmp_path / "../data/small"
    assert folder("/data/small") == Path("/data/small")


def test_every_field_of_a_study_is_described() -> None:
    def undescribed(schema: dict[str, dict[str, dict[str, str]]]) -> list[str]:
        return [
            name for name, field in schema["properties"].items() if not field.get("description")
        ]

    schema = JointPoseSensitivity.model_json_schema()
    assert undescribed(schema) == []
    for part in schema["$defs"].values():
        assert undescribed(part) == []


@sweep(
    "content, key, says",
    [
        ("studies: [prob]\n", "studies.0", "did you mean 'probe'"),
        ("studies: probe\n", "studies", "a list"),
        ("study: [probe]\n", "study", "did you mean 'studies'"),
        ("studies: [probe]\nfull: [probe]\n", "full.0", "again"),
        ("studies: [probe]\nstudies: [probe]\n", "studies", "the same key twice"),
    ],
)
def test_fault_of_the_selection(content: str, key: str, says: str, tmp_path: Path) -> None:
    root = project(tmp_path)
    (root / "config" / "config.yaml").write_text(content)
    with pytest.raises(InputError) as caught:
        studies.read_selection(root)
    here = [p for p in caught.value.problems if (p.file, p.column) == ("config/config.yaml", key)]
    assert any(says in str(problem) for problem in here), str(caught.value)


def test_shipped_studies_are_valid() -> None:
    root = Path(__file__).parents[2]
    selection = studies.read_selection(root)
    for name in (*selection.studies, *selection.full):
        assert studies.read(root / "config" / "studies" / f"{name}.yaml", root).study == name
