"""A cohort stands beside the paper it was rebuilt from, in the kind of study that paper did."""

from pathlib import Path

import pytest
from identification_cases import identification
from spinepipe.jobs.layouts import JOINED, files_of
from study_cases import STUDY, Size, project, results

from spinepipe import cohort as cohorts
from spinepipe.report import published
from spinepipe.studies.joint_pose_sensitivity import draw as figures
from spinepipe.studies.joint_pose_sensitivity.kind import FIGURES
from spinepipe.studies.read import KINDS
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
    return KINDS[kind](study="s", kind=kind, cohort=cohort, **needed.get(kind, {}))


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
    found = files_of(study_of(kind, cohort), cohorts.read(COHORTS / cohort))
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
    tables = [str(folder / f"{table}.parquet") for table in FIGURES[name]]
    svg, png = (folder / f"{name}.{kind}" for kind in ("svg", "png"))
    figures.run(str(tmp_path), STUDY, name, tables, str(svg), str(png))
    alone = svg.read_bytes()
    monkeypatch.setitem(published.PAPER_OF_COHORT, "straight", "gould_2024b")
    figures.run(str(tmp_path), STUDY, name, tables, str(svg), str(png))
    assert svg.read_bytes() == alone


def test_tables_of_job_files_of_every_kind_are_joined() -> None:
    phantom = cohorts.read(COHORTS / "t12s1_phantom")
    layouts = [files_of(study_of(kind, "t12s1_phantom"), phantom) for kind in KINDS]
    made = {table for layout in layouts for table in layout.made_of_jobs}
    assert set(JOINED) == made | {"method_fits"}  # of joint-pose studies that ask for them
    assert len(JOINED) == len(set(JOINED)), "one rule joins them all"
