"""A cohort stands beside the paper it was rebuilt from, in the kind of study that paper did."""

from pathlib import Path

import pytest
from identification_cases import identification
from study_cases import FIGURES, Size, drawn, project, results

from spinepipe import cohort as cohorts
from spinepipe.report import published
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


@pytest.mark.parametrize(
    ("kind", "cohort", "against"),
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


def test_numbers_of_a_paper_are_for_its_own_cohort_only() -> None:
    ours = published.paper_of("palanca_l1l4", "gould_2024a")
    assert ours is not None
    assert ours[1]["doi"] == "10.3389/fbioe.2024.1304334"
    assert published.paper_of("palanca_l1l4", "gould_2024b") is None
    assert published.paper_of("t12s1_phantom", "gould_2024a") is None
    assert published.paper_of("straight", "gould_2024a") is None


@pytest.mark.parametrize("name", FIGURES)
def test_joint_pose_figures_of_a_cohort_of_the_other_paper(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    size = Size(("a",), 2, 12)
    folder = results(project(tmp_path, size), size)
    identification(folder, size)
    alone = drawn(tmp_path, name).read_bytes()
    monkeypatch.setitem(published.PAPER_OF_COHORT, "straight", "gould_2024b")
    assert drawn(tmp_path, name).read_bytes() == alone


def test_tables_of_job_files_of_every_kind_are_joined() -> None:
    phantom = cohorts.read(COHORTS / "t12s1_phantom")
    asked = {"joint_pose_sensitivity": {"method_fits"}}  # by studies that ask for them
    for name in kind_names():
        files = kind_of(name).files.of(study_of(name, "t12s1_phantom"), phantom)
        made = {*files.made_of_jobs, *files.by_specimen} | asked.get(name, set())
        joined = kind_of(name).files.joined
        assert set(joined) == made, name
        assert len(joined) == len(set(joined)), "one rule joins them all"
