"""A cohort stands beside the paper it was rebuilt from, in the kind of study that paper did.

Would catch a comparison that other cohorts get, or another kind of study, and a paper's numbers in
figures of another cohort.
"""

from dataclasses import replace
from pathlib import Path

import pose_tables
import pytest
from study_cases import FIGURES, STUDY, Size, drawing, project
from sweeps import sweep

from spinepipe import cohort as cohorts
from spinepipe.comparison import papers
from spinepipe.studies.cohort_stiffness.settings import GOULD_2024B
from spinepipe.studies.joint_pose_sensitivity.gould_2024a import GOULD_2024A
from spinepipe.studies.joint_pose_sensitivity.inputs import study_and_cohort
from spinepipe.studies.registry import kind_names, kind_of
from spinepipe.studies.study import Study

COHORTS = Path(__file__).resolve().parents[3] / "config" / "cohorts"


def study_of(kind: str, cohort: str) -> Study:
    """A study of a kind, all else left to the defaults where there are any."""
    times = {"low": 0.5, "high": 2.0}
    stiffness = {"of": "stiffness", "coordinate": "extension", "times": times}
    needed = {
        "discrepancy": {"base": {"stiffness": "per_specimen"}},
        "global_sensitivity": {
            "factors": [stiffness, {"of": "load_size", "times": times}],
            "outputs": {"stiffness": True},
        },
    }
    return kind_of(kind).settings(study="s", kind=kind, cohort=cohort, **needed.get(kind, {}))


@sweep(
    "kind, cohort, against",
    [
        ("joint_pose_sensitivity", "palanca_l1l4", ["against_gould_2024a"]),
        ("joint_pose_sensitivity", "t12s1_phantom", []),
        ("cohort_stiffness", "palanca_l1l4", []),
        ("cohort_stiffness", "t12s1_phantom", ["against_gould_2024b"]),
        ("range_of_motion", "palanca_l1l4", []),
        ("range_of_motion", "t12s1_phantom", []),
    ],
)
def test_results_are_held_against_the_paper_of_cohort_and_question(
    kind: str, cohort: str, against: list[str]
) -> None:
    found = kind_of(kind).files.of(study_of(kind, cohort), cohorts.read(COHORTS / cohort))
    assert [name for name in found.tables if name.startswith("against")] == against


@pytest.mark.parametrize("kind", ["joint_pose_sensitivity", "tracking"])
def test_without_the_folder_of_papers_the_comparison_is_left_out_and_told(
    kind: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    cohort = {"tracking": "tracking_phantom"}.get(kind, "palanca_l1l4")
    forms = kind_of(kind).forms if kind == "tracking" else ()
    read = cohorts.read(COHORTS / cohort, forms)
    whole = set(kind_of(kind).files.of(study_of(kind, cohort), read).tables)
    assert papers.left_out("the paper") == ()
    monkeypatch.setattr(papers, "FOLDER", tmp_path)
    rest = set(kind_of(kind).files.of(study_of(kind, cohort), read).tables)
    assert [name.startswith("against_") for name in whole - rest] == [True]
    (told,) = papers.left_out("the paper")
    assert "the folder papers" in told
    assert papers.left_out("the paper", wanted=False) == ()


def test_numbers_of_a_paper_are_for_its_own_cohort_only() -> None:
    ours = GOULD_2024A.beside("palanca_l1l4")
    assert ours is not None
    assert ours[1]["doi"] == "10.3389/fbioe.2024.1304334"
    assert GOULD_2024B.beside("palanca_l1l4") is None
    assert GOULD_2024A.beside("t12s1_phantom") is None
    assert GOULD_2024A.beside("straight") is None


@pytest.mark.full
@sweep("name", FIGURES)
def test_joint_pose_figures_of_a_cohort_of_the_other_paper(name: str, tmp_path: Path) -> None:
    study, cohort = study_and_cohort(str(project(tmp_path, Size(("a",)))), STUDY)
    tables = pose_tables.frames(pose_tables.whole())
    alone, other = (
        drawing(name)(study, one, tables).svg()
        for one in (cohort, replace(cohort, name=GOULD_2024B.cohort))
    )
    assert other == alone


def test_tables_of_job_files_of_every_kind_are_joined() -> None:
    # by kinds that ask the cohort for files of their own
    own = {"tracking": "tracking_phantom", "trunk_loads": "trunk_volunteers"}
    asked = {
        "cohort_stiffness": {"nuisances"},
        "joint_pose_sensitivity": {
            *("method_fits", "posterior", "posterior_motion", "pose_weights"),
            "stiffness_over_load_point",
        },
        "trunk_loads": {"responses", "lift_loads", "lift_frames", "lift_bands", "lift_paths"},
    }  # by studies that ask for them
    for name in kind_names():
        cohort = own.get(name, "t12s1_phantom")
        read = cohorts.read(COHORTS / cohort, kind_of(name).forms if name in own else ())
        files = kind_of(name).files.of(study_of(name, cohort), read)
        made = {*files.made_of_jobs, *files.by_specimen} | asked.get(name, set())
        joined = kind_of(name).files.joined
        assert set(joined) == made, name
        assert len(joined) == len(set(joined)), "one rule joins them all"
