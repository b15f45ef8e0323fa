"""Jobs that set published numbers beside a run: which studies have them, what they hand on."""

import csv
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from papers.engine import claims_of, judge, rows_of
from papers.run import StudyRun
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.studies.scoliosis.against_jalalian_2017 import facts
from spinepipe.studies.scoliosis.kind import KIND, ScoliosisFiles
from spinepipe.studies.scoliosis.settings import Scoliosis
from spinepipe.studies.scoliosis.tables import JALALIAN_2017_COHORTS
from spinepipe.studies.tracking.against_wang_2021 import paper_settings as asked_of_tracking
from spinepipe.studies.tracking.settings import JointLimits, Tracking
from spinepipe.studies.trunk_loads.against_ghezelbash_2016 import asked_of as asked_of_trunk
from spinepipe.studies.trunk_loads.settings import TrunkLoads
from spinepipe.studies.trunk_loads.settings import reproduces as has_the_persons
from spinepipe.tables import read, read_frame
from tests.comparison.made_up import ASKED, ROOT


@pytest.mark.parametrize(
    ("kind", "paper", "study"),
    [
        ("joint_pose_sensitivity", "gould_2024a", "l1l4_joint_pose"),
        ("cohort_stiffness", "gould_2024b", "t12s1_cohort_stiffness"),
        ("scoliosis", "jalalian_2017", "ais18_scoliosis"),
        ("trunk_loads", "ghezelbash_2016", "trunk_volunteers"),
        ("tracking", "wang_2021", "tracking_phantom"),
    ],
)
def test_a_job_writes_the_table_with_its_origin(
    kind: str, paper: str, study: str, tmp_path: Path
) -> None:
    """Without results nothing of ours is called agreement."""
    output = tmp_path / f"against_{paper}.parquet"
    job = import_module(f"spinepipe.studies.{kind}.against_{paper}")
    job.run(str(ROOT), study, [], str(output))
    rows = read_frame(output)
    assert list(rows["id"]) == [claim.id for claim in claims_of(paper)]
    assert not rows["verdict"].eq("inside").any()
    assert read(output).schema.metadata[b"study"] == study.encode()


def test_the_table_is_made_where_the_cohort_stands_for_that_of_the_paper() -> None:
    settings, cohort = study_of_kind(Scoliosis, str(ROOT), "ais18_scoliosis")
    assert cohort.name in JALALIAN_2017_COHORTS
    made = ScoliosisFiles.of(settings, cohort).tables
    rebuilt = "t12s1_phantom" in JALALIAN_2017_COHORTS
    other = ScoliosisFiles(settings, cohort.specimen_names, rebuilt=rebuilt).tables
    assert set(made) - set(other) == {"against_jalalian_2017"}
    assert {"by_range", "statistics"} <= set(other) <= {one.name for one in KIND.tables}
    assert (has_the_persons("trunk_volunteers"), has_the_persons("t12s1_phantom")) == (True, False)


def test_settings_that_trunk_loads_hands_on() -> None:
    given = {"study": "one", "kind": "trunk_loads", "cohort": "trunk_volunteers"}
    study = TrunkLoads.model_validate(given | {"passive": {"joints_behind_mm": 0.0}})
    expected = ASKED["ghezelbash_2016"] | {"joints_behind_mm": 0.0}
    assert asked_of_trunk(study) == pytest.approx(expected)


@pytest.mark.parametrize(("means", "times"), [("added", 2.5), ("of_the_range", 1.5)])
def test_settings_that_tracking_hands_on(means: str, times: float) -> None:
    bounds = JointLimits(means=means)  # type: ignore[arg-type]
    settings = Tracking.model_construct(bounds=bounds, intervals=50, largest_deviation_mm=40.0)
    asked = asked_of_tracking(settings)
    assert (asked["times_the_range"], asked["intervals"]) == (times, 50)


# --- rows whose value is data of the shipped studies ----------------------------------------------


def test_the_shipped_phantom_has_the_patients_and_films_of_the_paper() -> None:
    """Five films each, read once in tenths of a mm and deg, from L4."""
    known = facts(study_of_kind(Scoliosis, str(ROOT), "ais18_scoliosis")[1])
    claims = {claim.id: claim for claim in claims_of("jalalian_2017")}
    built = ("table_1.", "results.cobb", "results.age")
    verdicts = [judge(one, StudyRun(known)) for one in claims.values() if one.id.startswith(built)]
    assert {row["verdict"] for row in verdicts} == {"circular"}
    films = known["films"]
    each = films.groupby(["specimen", "position"])
    places = films[["y_mm", "z_mm", "orientation_deg"]].to_numpy(float)
    tenths = 10.0 * places[np.isfinite(places)]
    found = {
        "xrays_per_patient": films.groupby("specimen")["position"].nunique().unique(),
        "observers": each["observer"].nunique().clip(1).unique(),
        "observers.repeats": each["repeat"].nunique().clip(1).unique(),
        "origin_frame": np.unique(np.abs(places[films["vertebra"] == "L4"])),
        "pixel_size": 0.1 * np.unique(np.round(np.abs(tenths - np.round(tenths)), 6) + 1.0),
    }
    for name, values in found.items():
        row = judge(claims[f"results.{name}"], StudyRun({}))
        assert [row["ours"]] == pytest.approx([float(one) for one in values]), name
    for name, ours in (
        ("equations.asymptote_right", 1.2),
        ("equations.asymptote_if_opposite", 1.2),
        ("results.bending_displacement_fraction_of_R", 1.0 / 1.2),
    ):
        assert judge(claims[name], StudyRun({}))["ours"] == pytest.approx(ours)


def test_the_shipped_volunteers_are_asked_what_the_rows_say() -> None:
    """Shares are made to sum to 100 %; pressures are those of tasks.csv."""
    claims = {claim.id: claim for claim in claims_of("ghezelbash_2016")}
    numbers = [row["id"] for row in rows_of("ghezelbash_2016") if row["selector"] == "number"]
    found = {name: judge(claims[name], StudyRun({}))["ours"] for name in numbers}
    for joint, flexion, sideways in (("T11T12", 6.0, 8.3), ("L4L5", 20.1, 25.6)):
        assert found[f"partition.{joint}.flexion_percent"] == pytest.approx(100 * flexion / 99.9)
        assert found[f"partition.{joint}.lateral_percent"] == pytest.approx(sideways)
    folder = ROOT / "config" / "cohorts" / "trunk_volunteers"
    with (folder / "tasks.csv").open(encoding="utf-8") as file:
        tasks = list(csv.DictReader(file))
    for number in (10, 11):
        (first, *_) = [row for row in tasks if row["number"] == str(number)]
        alike = [row for row in tasks if row["push_extension_nm"] == first["push_extension_nm"]]
        asked = {float(row["intra_abdominal_pressure_kpa"] or 0.0) for row in alike}
        cases = ("I", "II", "III", "IV", "V")
        assert {found[f"table_3.task_{number}.{case}.iap_kpa"] for case in cases} == asked
    assert found["equations.scale_coordinates"] == pytest.approx(173.9 / 173.0)
