"""Rows of the jobs of a small study: whole, and with whatever can go wrong as rows of their own."""

from pathlib import Path

import numpy as np
import pytest
from cohort_cases import Change, both, line
from tracked_cohort import Spoil, known_truth, lost, project, told_smaller
from tracked_study import Run

from spinepipe.motion.skeleton import BODIES, JOINTS
from spinepipe.studies.tracking import approaches, calibrate, profile
from spinepipe.studies.tracking.kind import KIND, TrackingFiles
from spinepipe.tables import read_frame

STUDY = """\
approaches: [ik, ik_constrained_christophy_2012, optk_generic, optk_calibrated, optk_from_both]
intervals: 10
profiles: {intervals: 10, ratios: [0.5, 1, 2]}
trade_off: [1, 10]
"""
FEW = "approaches: [ik]\nintervals: 10\nprofiles: {intervals: 10, ratios: [1]}\ntrade_off: [1]\n"
RATIOS = "ik_constrained_christophy_2012"
QUICK = f"{FEW.replace('[ik]', f'[{RATIOS}]')}drawn_approaches: [{RATIOS}]\n"
ANALYSES = ("ranges", "sharing", "similarity", "errors", "accuracy", "against_wang_2021")
STANCE, FLEXION, BENDING = 2, 3, 4
"""Lines of the trials."""


def run_of(folder: Path, study: str, *changes: Change, spoilt: tuple[Spoil, ...] = ()) -> Run:
    project(folder, study, *changes, spoilt=spoilt)
    return Run(folder)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """All jobs but those of profiles, of one person whose truth is known."""
    run = run_of(tmp_path_factory.mktemp("tracked"), STUDY, known_truth)
    for table in ("stiffness", "tracked", "clusters", "weights"):
        run.write(table)
    for table in run.files.made_of_jobs:
        if table not in ("profiles", "profile_points"):
            run.join(table)
    for name in ANALYSES:
        run.analyse(name)
    return run


def test_every_trial_and_approach_has_its_fit(whole: Run) -> None:
    """One posture has nothing to be calibrated on."""
    fits = whole.table("fits").set_index(["trial", "approach"])
    assert set(fits.index) == {key[1:] for key in whole.files.taken}
    assert len(fits) == 3 * 5 - 1
    assert ("stance", "optk_calibrated") not in fits.index
    assert set(fits.loc["stance"]["frames"]) == {1}
    assert set(fits.loc["flexion_extension"]["frames"]) == {11}
    without_loads = fits[fits["loads_cost"].isna()].index.get_level_values("approach")
    assert set(without_loads) == {"ik", "ik_constrained_christophy_2012"}
    steady = fits[~fits.index.get_level_values("approach").isin(["ik"])]
    assert set(steady["status"]) == {"converged"}
    assert fits.loc[("stance", "ik"), "marker_rmse_mm"] < 0.1


def test_tracked_rows_are_all_bodies_at_all_nodes(whole: Run) -> None:
    rows = whole.table("tracked")
    count = rows.groupby(["trial", "approach"]).size()
    assert set(count.loc["stance"]) == {len(BODIES)}
    assert set(count.loc["lateral_bending"]) == {11 * len(BODIES)}
    drawn = whole.table("drawn")
    assert set(drawn["approach"]) == {"ik", "optk_generic"}


def test_calibrations_are_those_that_motions_take_over(whole: Run) -> None:
    rows = whole.table("stiffness")
    laws = {"optk_from_flexion", "optk_from_bending", "optk_from_both"}
    assert set(rows["law"]) == laws == {law for _, law in whole.files.laws}
    assert len(rows) == 3 * len(JOINTS) * 6 * 2
    assert (rows["a"] > 0.0).all()
    fits = whole.table("fits")
    own = fits[fits["approach"] == "optk_calibrated"]
    assert set(own["trial"]) == {"flexion_extension", "lateral_bending"}


def test_exact_markers_give_the_true_motion(whole: Run) -> None:
    """Inverse kinematics of markers that are where they are: rounding of the files, 0.0001 mm."""
    errors = whole.table("errors")
    ik = errors[(errors["approach"] == "ik") & (errors["measure"] == "centre_mm")]
    assert set(ik["trial"]) == {"stance", "flexion_extension"}
    assert set(ik["level"]) == set(BODIES[1:-1])
    assert ik["largest"].max() < 0.1
    accuracy = whole.table("accuracy")
    assert set(accuracy["n_specimens"]) == {1}
    assert accuracy["low"].isna().all()


def test_a_study_of_one_person_is_said_to_tell_little(whole: Run) -> None:
    similar = whole.table("similarity")
    assert set(similar["status"]) == {"too_few"}
    against = whole.table("against_wang_2021").set_index("id")
    assert set(against["verdict"]) >= {"not_computed", "circular"}
    order = against.loc["order.W8.OptK_PE_generic.IK"]
    assert order["verdict"] == "not_computed"
    assert "fewer than 3 persons" in order["reason"]
    assert against.loc["results.n_subjects", "verdict"] == "outside"


def test_ranges_and_shares_are_of_motions_alone(whole: Run) -> None:
    ranges, sharing = whole.table("ranges"), whole.table("sharing")
    assert "stance" not in set(ranges["trial"]) | set(sharing["trial"])
    bent = ranges[(ranges["approach"] == "ik") & (ranges["trial"] == "flexion_extension")]
    extension = bent[bent["coordinate"] == "extension"].set_index("joint")["range"]
    np.testing.assert_allclose(extension, 45.0 / 17.0, atol=0.1)
    shares = sharing[(sharing["approach"] == "ik") & (sharing["window"] == "20-80")]
    np.testing.assert_allclose(shares["share"], 1.0 / 6.0, atol=0.02)


def test_weights_and_recordings_have_their_rows(whole: Run) -> None:
    weights = whole.table("weights")
    assert set(weights["ratio"]) == {1.0, 10.0}
    assert weights[weights["trial"] == "lateral_bending"]["centre_mm"].isna().all()
    assert set(whole.table("clusters")["status"]) == {"rigid"}
    sizes = whole.table("sizes")
    assert set(sizes["status"]) == {"told"}
    np.testing.assert_allclose(sizes["factor"], 1.0, atol=1e-4)
    assert sizes["rms_mm"].max() < 0.01
    assert whole.table("remarks").empty


def test_a_profile_has_a_point_for_each_ratio(whole: Run) -> None:
    folder = whole.path("results/profiled")
    names = {name: str(folder / f"{name}.parquet") for name in ("profiles", "profile_points")}
    place = {"specimen": "a", "region": "lumbar", "coordinate": "extension"}
    whole.job("profile", **place, **names)
    points = read_frame(names["profile_points"])
    assert list(points["ratio"]) == [0.5, 1.0, 2.0]
    assert points["cost_over_best"].min() == 0.0
    assert len(read_frame(names["profiles"])) == 1


def test_fits_that_fail_are_rows_with_a_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A calibration that fails, motions that would take it over, and a search that fails."""

    def fail(*_: object, **__: object) -> None:
        raise np.linalg.LinAlgError("singular matrix")

    run = run_of(tmp_path, STUDY.replace("[ik, ", "["))
    for module in (calibrate, profile, approaches):
        monkeypatch.setattr(module, "solve", fail)
    run.write("stiffness")
    run.join("stiffness")
    rows = run.table("stiffness")
    assert set(rows["status"]) == {"not_converged"}
    assert set(rows["message"]) == {"singular matrix"}
    assert rows["a"].isna().all()
    run.write("tracked")
    for table in ("tracked", "fits", "drawn"):
        run.join(table)
    fits = run.table("fits").set_index(["trial", "approach"])
    assert fits.loc[("flexion_extension", RATIOS), "status"] == "converged"
    for approach, why in (
        ("optk_generic", "singular matrix"),
        ("optk_calibrated", "no passive elements were calibrated"),
        ("optk_from_both", "no passive elements were calibrated"),
    ):
        row = fits.loc[("flexion_extension", approach)]
        assert (row["status"], row["message"], row["frames"]) == ("not_converged", why, 0)
    assert "optk_from_both" not in set(run.table("tracked")["approach"])
    run.write("weights")
    run.join("weights")
    assert "not_converged" in set(run.table("weights")["status"])
    run.export()
    empty = run.path("results/small/opensim/a/flexion_extension/optk_generic.mot").read_text()
    assert "nRows=0" in empty


def test_a_marker_that_a_file_lacks_is_left_out_of_its_trial(tmp_path: Path) -> None:
    run = run_of(tmp_path, QUICK, spoilt=(lost("T9", "flexion_extension"), lost("T1_a", "stance")))
    for table in ("tracked", "clusters"):
        run.write(table)
    for table in ("fits", "clusters", "remarks", "sizes", "drawn"):
        run.join(table)
    fits = run.table("fits")
    assert set(fits["status"]) == {"converged"}
    drawn = run.table("drawn")
    measured = drawn[(drawn["kind"] == "measured") & (drawn["name"] == "T9")]
    assert set(measured["trial"]) == {"stance", "lateral_bending"}
    clusters = run.table("clusters").set_index(["trial", "cluster"])["status"]
    assert clusters["stance", "T1"] == "too_few"
    assert clusters["stance", "T3"] == "rigid"
    assert set(run.table("sizes")["status"]) == {"told"}


def test_one_trial_alone_is_a_study(tmp_path: Path) -> None:
    """It is the static one too; what would need others is not tried."""
    alone = "a,flexion_extension,flexion_extension,flexion_extension.trc,,,x z -y,hanging,yes"
    study = STUDY.replace(", optk_from_both]", "]").replace("[ik, ", "[")
    others = both(line("trials.csv", BENDING, None), line("trials.csv", FLEXION, None))
    run = run_of(tmp_path, study, others, line("trials.csv", STANCE, alone))
    assert set(run.files.laws) == {("a", "optk_from_flexion")}
    assert {key[1] for key in run.files.taken} == {"flexion_extension"}
    run.write("stiffness")
    run.write("tracked")
    for table in ("stiffness", "tracked", "fits"):
        run.join(table)
    assert len(run.table("fits")) == 3
    run.write("clusters")
    run.join("sizes")
    for name in ("ranges", "sharing", "similarity", "errors", "accuracy"):
        run.analyse(name)
    assert run.table("errors").empty
    assert run.table("accuracy").empty


@pytest.mark.parametrize("scaling", ["none", "markers"])
def test_a_person_told_too_small_is_found_and_made_larger(tmp_path: Path, scaling: str) -> None:
    """Told 0.9 times as large: 1/0.9, and only then are markers and centres met."""
    study = f"{FEW}scaling: {scaling}\n"
    run = run_of(tmp_path, study, told_smaller(0.9), known_truth, line("trials.csv", BENDING, None))
    for table in ("tracked", "clusters", "weights"):
        run.write(table)
    for table in ("tracked", "fits", "sizes", "weights"):
        run.join(table)
    assert len(run.table("weights")) == 2
    run.analyse("errors")
    sizes = run.table("sizes")
    np.testing.assert_allclose(sizes["factor"], 1.0 / 0.9, rtol=1e-4)
    errors = run.table("errors")
    off = errors[errors["measure"] == "centre_mm"]["mean"].max()
    rmse = run.table("fits")["marker_rmse_mm"].max()
    if scaling == "markers":
        assert off < 0.1
        assert rmse < 0.1
    else:
        assert off > 3.0
        assert rmse > 3.0


def test_a_size_that_markers_do_not_tell_is_a_status(tmp_path: Path) -> None:
    """Told a third as large: none of a person; the skeleton stays, and a remark says so."""
    run = run_of(tmp_path, f"{QUICK}scaling: markers\n", told_smaller(0.33))
    run.write("clusters")
    for table in ("sizes", "remarks"):
        run.join(table)
    sizes = run.table("sizes")
    assert set(sizes["status"]) == {"not_told"}
    assert sizes["factor"].isna().all()
    (remark,) = run.table("remarks")["remark"]
    assert "times the generic one" in remark
    assert remark.endswith("the cohort's skeleton is taken as it is")
    run.write("tracked")
    run.join("fits")
    assert len(run.table("fits")) == 3


def test_every_declared_table_is_one_that_a_study_can_have(whole: Run) -> None:
    of_lifts = {"joint_moments", "moment_agreement"}
    assert {table.name for table in KIND.tables} - of_lifts == set(whole.files.tables)
    lifts = whole.files.study.model_copy(update={"marker_set": "plug_in_gait"})
    assert set(TrackingFiles.of(lifts, whole.expected.cohort).tables) == of_lifts
