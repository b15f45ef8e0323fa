"""Does each joint move with the load? Flipped signs are found, and nowhere else.

Seen here: a flipped sign or a wrong unit that passes, or a sound joint that is accused.
"""

import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from chain_cases import JOINTS, STUDY, Chains, Written
from cohort_edge_cases import A

from spinepipe.jobs.inputs import study_of_kind
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness
from tests.generators.phantom import SEED, phantom, write


@pytest.fixture(scope="module")
def phantom_project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The phantom with one sign flipped: s03, left lateral bending, L2L3."""
    root = tmp_path_factory.mktemp("phantom")
    (root / "config" / "studies").mkdir(parents=True)
    head = f"study: {STUDY}\nkind: cohort_stiffness\ncohort: flipped\n"
    (root / "config" / "studies" / f"{STUDY}.yaml").write_text(head)
    folder = root / "config" / "cohorts" / "flipped"
    write(phantom(SEED), folder)
    motion = pd.read_csv(folder / "motion.csv")
    flip = 'specimen == "s03" and test == "left_lateral_bending" and joint == "L2L3"'
    motion.loc[motion.query(flip).index, "right_bending_deg"] *= -1.0
    gone = (motion["specimen"] == "s01") & (motion["joint"] == "L3L4")
    motion.loc[gone, motion.columns[5:]] = np.nan
    motion.to_csv(folder / "motion.csv", index=False)
    return root


def test_a_flipped_sign_is_found_where_it_is_and_nowhere_else(phantom_project: Path) -> None:
    _, cohort = study_of_kind(CohortStiffness, str(phantom_project), STUDY)
    project = Written(phantom_project)
    found = pd.concat(
        project.literature(name)["sign_checks"].assign(specimen=name)
        for name in cohort.specimen_names
    )
    assert len(found) == 6 * 3 * 6 - 3  # L3L4 of s01 was not measured
    flipped = found[found["verdict"] != "as_expected"]
    keys = ["specimen", "test", "joint", "coordinate", "verdict"]
    assert flipped[keys].to_numpy().tolist() == [
        ["s03", "left_lateral_bending", "L2L3", "right_bending", "flipped"]
    ]
    assert "the sign of this coordinate is most likely flipped in motion.csv" in (
        flipped["message"].item()
    )
    assert flipped["measured_over_expected"].item() < -0.5
    assert set(found.loc[found["verdict"] == "as_expected", "message"]) == {""}


def test_a_level_without_readings_in_a_curved_spine(phantom_project: Path) -> None:
    """Its stiffness shows in the others' motion, but hardly: no number runs over."""
    found = Written(phantom_project).fit("s01", "per_joint")
    identifiable = found["stiffness"].groupby("joint")["identifiable"].all()
    assert not identifiable["L3L4"]
    assert identifiable.drop("L3L4").all()


def test_a_flipped_sign_drives_a_joint_to_its_bound(phantom_project: Path) -> None:
    found = Written(phantom_project).fit("s03", "per_joint")["stiffness"]
    bound = found[found["at_bound"] != "no"]
    assert ["L2L3", "right_bending", "upper"] in (
        bound[["joint", "coordinate", "at_bound"]].to_numpy().tolist()
    )


def test_a_joint_that_does_not_move_is_undecided_though_zeroing_shifts_it(tmp_path: Path) -> None:
    """All readings of a cycle share the error of step 0, which looks like motion of one sign."""
    verdicts = []
    for seed in range(20):
        chains = Chains({"a": A}, ["flexion"], cycles=2, steps=11)
        noise = np.random.default_rng(seed).normal(0.0, 0.1, (2, 11, len(JOINTS)))
        read = noise - noise[:, :1]
        chains.motion["extension_deg"] = read.reshape(-1)
        chains.zeroed = True
        root = tmp_path / str(seed)
        verdicts += chains.write(root).literature("a")["sign_checks"]["verdict"].tolist()
    assert verdicts.count("undecided") >= 0.97 * len(verdicts)


def test_one_reading_tells_no_sign(tmp_path: Path) -> None:
    chains = Chains({"a": A}, ["flexion"], steps=2, zeroed=True)
    found = chains.write(tmp_path).literature("a")["sign_checks"]
    assert set(found["verdict"]) == {"undecided"}
    assert set(found["message"]) == {"one reading does not tell how sure it is"}
    assert found["standard_error"].isna().all()


def flexion_of_l5s1(residual: float, root: Path) -> pd.Series:
    """Measured extension -1 times the expected (0, 1, 2), plus (0, 2, -1) times ``residual``."""
    chains = Chains({"a": A}, ["flexion"], steps=3)
    expected = -np.rad2deg(np.arange(3) / 51.0)
    measured = -expected + residual * np.rad2deg(np.array([0.0, 2.0, -1.0]) / 51.0)
    chains.motion.loc[chains.motion["joint"] == "L5S1", "extension_deg"] = measured
    return chains.write(root).literature("a")["sign_checks"].set_index("joint").loc["L5S1"]


@pytest.mark.parametrize(("errors", "verdict"), [(5.0, "undecided"), (25.0, "flipped")])
def test_few_readings_need_more_than_three_standard_errors(
    errors: float, verdict: str, tmp_path: Path
) -> None:
    """Of two degrees of freedom, 0.135 % lie beyond 19.2 (tables of Student's t)."""
    row = flexion_of_l5s1(np.sqrt(2.0) / errors, tmp_path)
    assert row["measured_over_expected"] / row["standard_error"] == pytest.approx(-errors, rel=1e-3)
    assert row["verdict"] == verdict


def flipped(chains: Chains, **where: object) -> Chains:
    """Extension with the other sign where all of these columns have these values."""
    chains.motion.loc[chains.where(**where), "extension_deg"] *= -1.0
    return chains


def test_a_sign_flipped_in_one_cycle_is_not_averaged_away(tmp_path: Path) -> None:
    chains = Chains({"a": A}, ["flexion"], cycles=3, noise_deg=0.01)
    chains = flipped(chains, cycle=3, joint="L4L5")
    rows = chains.write(tmp_path).literature("a")["sign_checks"].set_index("joint")
    assert rows.loc["L4L5", "measured_over_expected"] == pytest.approx(0.0, abs=0.05)
    assert rows["verdict"].to_dict() == {
        "L5S1": "as_expected",
        "L4L5": "flipped",
        "L3L4": "as_expected",
    }
    assert "moves against the load in cycle 3: " in rows.loc["L4L5", "message"]


def test_a_whole_test_that_is_flipped_may_be_its_moment(tmp_path: Path) -> None:
    chains = flipped(Chains({"a": A}, noise_deg=0.01), test="flexion")
    rows = chains.write(tmp_path).literature("a")["sign_checks"]
    against = rows["verdict"] == "flipped"
    assert set(rows.loc[against, "test"]) == {"flexion"}
    assert against.sum() == 3
    assert rows.loc[against, "message"].str.contains("in all readings together").all()
    assert rows["message"].str.contains("loads.csv").tolist() == against.tolist()
    one = flipped(Chains({"a": A}, noise_deg=0.01), test="flexion", joint="L4L5")
    alone = one.write(tmp_path / "one").literature("a")["sign_checks"]
    assert (alone["verdict"] == "flipped").sum() == 1
    assert not alone["message"].str.contains("loads.csv").any()


def test_motion_in_radians_is_told_by_its_size(phantom_project: Path, tmp_path: Path) -> None:
    """The files are sound but for the unit; every loaded joint is told, and the unit named."""
    root = tmp_path / "project"
    shutil.copytree(phantom_project, root)
    file = root / "config" / "cohorts" / "flipped" / "motion.csv"
    motion = pd.read_csv(file)
    angles = [column for column in motion.columns if column.endswith("_deg")]
    motion[angles] = np.deg2rad(motion[angles])
    motion.to_csv(file, index=False)
    found = Written(root).literature("s02")["sign_checks"]
    assert set(found["verdict"]) == {"implausible"}
    assert found["message"].str.contains("angles in radians and not degrees").all()
