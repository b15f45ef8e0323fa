"""Analysis jobs of the identification study on small tables, with numbers worked out by hand.

Would catch means, filters, tests, shares and trees that are not those of their definition, and what
fails without a reason told.
"""

import gc
import json
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy import stats
from study_cases import START, STUDY, TABLES, Size, project, results
from sweeps import sweep

from spinepipe.designs import sample_log_uniform
from spinepipe.schema import Table
from spinepipe.studies.joint_pose_sensitivity import (
    agreement,
    bootstrap,
    landmark_errors,
    landmark_precision,
    rank,
    significance,
    success,
    summary,
    two_factor,
)
from spinepipe.studies.joint_pose_sensitivity.inputs import study_and_cohort
from spinepipe.studies.joint_pose_sensitivity.landmark_precision import required_precision
from spinepipe.studies.joint_pose_sensitivity.landmarks import landmarks_of
from spinepipe.studies.joint_pose_sensitivity.settings import SETS_PER_BATCH
from spinepipe.studies.joint_pose_sensitivity.tables import BOOTSTRAP, PRECISION_ERRORS
from spinepipe.studies.joint_pose_sensitivity.variables import (
    absolute_error,
    complete_grid,
    measured_coordinates,
    measured_size,
    pose_factors,
    pose_parameters,
    readings,
)
from spinepipe.tables import read_frame, to_arrow, write
from spinepipe.units import COORDINATE_COLUMNS, STIFFNESS_COLUMNS

Change = Callable[[pd.DataFrame], pd.DataFrame]
NAN = np.nan


@pytest.fixture(autouse=True)
def _little_garbage() -> Iterator[None]:
    """Statsmodels collects garbage in every Holm correction, 0.1 s each with all modules in it."""
    gc.freeze()
    yield
    gc.unfreeze()


def write_rows(path: Path, table: Table, rows: list[dict]) -> str:
    """A table of rows; what they do not name is empty."""
    columns = {c.name: [row.get(c.name) for row in rows] for c in table.columns}
    write(to_arrow(table, columns), path, {})
    return str(path)


def run_row(values: dict[str, float | None], **key) -> dict:
    """A row of simulations; the prediction of every named coordinate is its error from 1.0.

    None: measured, but without a pose.
    """
    row = {"specimen": "a", "pose": 0, "stiffness": "calibrated", "joint": "J"} | key
    row = {"test": "flexion", "cycle": 1, "step": 1} | row
    for column in COORDINATE_COLUMNS:
        error = values.get(column, NAN)
        row[f"measured_{column}"] = 1.0 if column in values else NAN
        row[f"error_{column}"] = NAN if error is None else error
        row[f"predicted_{column}"] = row[f"error_{column}"] + row[f"measured_{column}"]
    return row


def test_errors_are_means_over_tests_cycles_and_steps() -> None:
    rows = [
        run_row({"extension_deg": 1.0, "anterior_mm": -0.5}, step=1),
        run_row({"extension_deg": -3.0}, step=2),
        run_row({"extension_deg": 2.0}, step=1, cycle=2),
        run_row({"extension_deg": 4.0, "anterior_mm": 0.1}, test="extension"),
        run_row({"extension_deg": 9.0}, joint="K"),
    ]
    found = absolute_error(pd.DataFrame(rows)).set_index("joint")
    assert found.loc["J", "extension"] == pytest.approx((1 + 3 + 2 + 4) / 4)
    assert found.loc["J", "anterior"] == pytest.approx((0.5 + 0.1) / 2)
    assert found.loc["K", "extension"] == 9.0
    assert np.isnan(found.loc["K", "anterior"])
    assert np.isnan(found["superior"]).all()


def test_a_run_that_lost_a_step_has_no_error_where_that_step_was_measured() -> None:
    rows = [
        run_row({"extension_deg": 1.0, "anterior_mm": 0.5}, step=1),
        run_row({"extension_deg": None}, step=2),
    ]
    found = absolute_error(pd.DataFrame(rows)).iloc[0]
    assert np.isnan(found["extension"])
    assert found["anterior"] == 0.5


def test_the_size_of_motion_is_that_of_all_readings() -> None:
    rows = pd.DataFrame([run_row({"extension_deg": 0.1}), run_row({"extension_deg": None}, step=2)])
    rows["measured_extension_deg"] = [-2.0, 5.0]
    assert measured_size(rows).iloc[0]["extension"] == 3.5
    assert np.isnan(measured_size(rows).iloc[0]["anterior"])


def test_step_0_is_a_reading_unless_it_was_subtracted() -> None:
    rows = pd.DataFrame({"step": [0, 1, 2, 0, 1]})
    assert readings(rows, zeroed_at_step_0=True)["step"].tolist() == [1, 2, 1]
    assert len(readings(rows, zeroed_at_step_0=False)) == 5


def test_measured_coordinates_are_those_with_any_error() -> None:
    rows = [
        run_row({"right_mm": 1.0}, joint="K"),
        run_row({"extension_deg": None, "right_mm": 0.2}, joint="J"),
        run_row({"extension_deg": 0.3, "anterior_mm": None}, joint="J", pose=1),
    ]
    found = measured_coordinates(absolute_error(pd.DataFrame(rows)))
    assert found == [("K", "right"), ("J", "right"), ("J", "extension")]


def test_the_grid_leaves_out_empty_sets_and_poses_that_lack_a_run() -> None:
    errors = pd.DataFrame(
        {
            "joint": ["J"] * 12 + ["K"],
            "pose": [*np.repeat([4, 7, 9], 4), 4],
            "stiffness": [*["calibrated", "best01", "best02", "best03"] * 3, "best01"],
            "extension": [0, 1, 2, NAN, 0, 3, 4, NAN, 0, 5, NAN, NAN, 99],
        }
    )
    grid = complete_grid(errors, "J", "extension")
    assert (grid.index.tolist(), grid.columns.tolist()) == ([4, 7], ["best01", "best02"])
    assert grid.to_numpy().tolist() == [[1.0, 2.0], [3.0, 4.0]]


def two_joint_poses() -> pd.DataFrame:
    columns = "pose joint x_mm y_mm z_mm extension_deg right_bending_deg left_rotation_deg"
    rows = [
        (2, "Q", 3.0, 0.0, 0.0, 1.0, 2.0, 0.0),
        (2, "P", 0.0, 4.0, 0.0, 3.0, -2.0, 1.0),
        (5, "Q", 1.0, 0.0, 0.0, 5.0, 0.0, 0.0),
        (5, "P", 0.0, 10.0, 8.0, 7.0, 0.0, -3.0),
        (9, "Q", 8.0, 0.0, 0.0, 0.0, 4.0, 0.0),
        (9, "P", 0.0, 7.0, 4.0, 0.0, 6.0, 0.0),
    ]
    return pd.DataFrame(rows, columns=columns.split())


def test_pose_factors_are_means_over_joints() -> None:
    """Origins lie 1, 3 and 4 mm (Q) and 5, 5 and 0 mm (P) off their means over the poses."""
    found = pose_factors(two_joint_poses())
    assert found.index.tolist() == [2, 5, 9]
    assert found["origin_distance"].tolist() == [3.0, 4.0, 2.0]
    assert found["extension_orientation"].tolist() == [2.0, 6.0, 0.0]
    assert found["right_bending_orientation"].tolist() == [0.0, 0.0, 5.0]
    assert found["left_rotation_orientation"].tolist() == [0.5, -1.5, 0.0]


def test_pose_parameters_are_six_columns_per_joint_in_their_order() -> None:
    found = pose_parameters(two_joint_poses())
    assert [name[:2] for name in found.columns] == ["Q_"] * 6 + ["P_"] * 6
    assert found.loc[5, ["P_superior_origin", "P_right_origin"]].tolist() == [10.0, 8.0]
    assert found.loc[2, ["Q_anterior_origin", "Q_right_bending_orientation"]].tolist() == [3.0, 2.0]


def test_precision_is_read_between_sampled_sds() -> None:
    """Of four samples 4, 3 and 1 are below the limit: three quarters up to 2, one half at 2.5."""
    sds = np.array([1.0, 2.0, 3.0])
    errors = np.array([[0.1] * 4, [0.1, 0.1, 0.1, np.inf], [0.1, 2.0, 1.0, np.inf]])
    found = required_precision(sds, errors, limit=1.0, share=0.5, bootstraps=200, seed=1)
    assert found.sd == pytest.approx(2.5)
    assert found.low <= 2.5 <= (found.high or np.inf)
    assert required_precision(sds, errors, 1.0, 0.75, 20, 1).sd == pytest.approx(2.0)
    assert required_precision(sds, errors, 1.0, 0.9, 20, 1).sd == pytest.approx(1.4)


@sweep(
    "error, message",
    [(0.5, "3 mm will do, the largest"), (np.inf, "1 mm will not do, the smallest")],
)
def test_precision_outside_the_sampled_sds(error: float, message: str) -> None:
    found = required_precision(np.array([1.0, 3.0]), np.full((2, 5), error), 1.0, 0.95, 50, 1)
    assert (found.sd, found.low, found.high) == (None, None, None)
    assert message in found.message


def test_an_interval_that_leaves_the_sampled_sds_says_so() -> None:
    """Half of six samples fail at the larger SD: some bootstraps draw none of them, and pass."""
    errors = np.array([[0.1] * 6, [0.1, 0.1, 0.1, 9.0, 9.0, 9.0]])
    found = required_precision(np.array([1.0, 3.0]), errors, 1.0, 0.6, 2000, 1)
    # down from 1 at 1 mm to 1/2 at 3 mm; 0.6 lies four fifths of the way down
    assert found.sd == pytest.approx(1.0 + 0.8 * 2.0)
    assert found.high is None
    assert found.message == "the interval ends above 3 mm"


def test_log_uniform_samples_fill_their_box_evenly() -> None:
    low, high = np.array([1.0, 50.0, 7.0]), np.array([1e4, 100.0, 7.0])
    found = sample_log_uniform(low, high, 64, seed=5)
    for column in (0, 1):  # a Latin hypercube: one point in each of 64 slices
        slices = 64 * np.log(found[:, column] / low[column]) / np.log(high[column] / low[column])
        assert sorted(np.floor(slices).astype(int)) == list(range(64))
    assert found[:, 2].tolist() == [7.0] * 64
    np.testing.assert_array_equal(found, sample_log_uniform(low, high, 64, seed=5))
    assert not np.array_equal(found, sample_log_uniform(low, high, 64, seed=6))


@sweep("low, high, n", [(0.0, 1.0, 4), (2.0, 1.0, 4), (1.0, 2.0, 1)])
def test_a_log_uniform_sample_of_nothing_is_refused(low: float, high: float, n: int) -> None:
    with pytest.raises(ValueError, match="positive ends in order and at least 2"):
        sample_log_uniform(np.array([low]), np.array([high]), n, seed=1)


def test_spread_and_share_of_measured() -> None:
    values = [4.0, NAN, 1.0, 2.0, 3.0, 10.0]
    found = summary.spread(values)
    low, high = stats.scoreatpercentile([1, 2, 3, 4, 10], [25, 75])
    assert (found["n"], found["median"], found["minimum"], found["range"]) == (5, 3.0, 1.0, 9.0)
    assert (found["low_quartile"], found["iqr"]) == (low, high - low)
    assert summary.percent(values, [NAN, -6.0, 12.0, 15.0]) == pytest.approx(25.0)
    nothing = summary.spread([NAN])
    assert nothing["n"] == 0
    assert nothing["median"] is None
    assert summary.percent([NAN], [1.0]) is summary.percent([1.0], [0.0]) is None


class Run:
    """A project with made-up results, changed before the jobs look at them."""

    def __init__(
        self, root: Path, size: Size, study: str = "", cohort: str = "", **changes: Change
    ) -> None:
        self.root, self.size = str(project(root, size)), size
        self.folder = results(root, size)
        for file, text in (
            (f"studies/{STUDY}.yaml", study),
            ("cohorts/straight/cohort.yaml", cohort),
        ):
            path = root / "config" / file
            path.write_text(path.read_text() + text)
        for name, change in changes.items():
            rows = change(read_frame(self.folder / f"{name}.parquet")).astype(object)
            rows = rows.where(rows.notna(), None)
            write_rows(self.folder / f"{name}.parquet", TABLES[name], rows.to_dict("records"))
        fits, judged = self._files("calibrations", "success")
        success.success(self.root, STUDY, [fits], judged)
        rank.run(self.root, STUDY, fits, self.best)

    @property
    def best(self) -> str:
        return str(self.folder / "best.json")

    def _files(self, *names: str) -> list[str]:
        return [str(self.folder / f"{name}.parquet") for name in names]

    def table(self, name: str) -> pd.DataFrame:
        """A table, made of the others if a job makes it."""
        base = self._files("simulations", "success", "poses", "calibrations")
        more = [f for f in self._files("bootstrap") if Path(f).exists()]
        output = self._files(name)[0]
        match name:
            case "counts":
                success.counts(self.root, STUDY, [*base, *more], output)
            case "summary":
                summary.run(self.root, STUDY, [*base, *more], self.best, output)
            case "statistics":
                significance.run(self.root, STUDY, base, self.best, output)
            case "variance_shares" | "importance":
                both = self._files("variance_shares", "importance")
                two_factor.run(self.root, STUDY, base, self.best, *both)
            case "agreement":
                agreement.run(self.root, STUDY, base, output)
        return read_frame(output)


ANALYSES = ("counts", "summary", "statistics", "variance_shares", "importance", "agreement")


def without_fit(which: Callable[[pd.DataFrame], pd.Series]) -> Change:
    """Calibrations of which some were refused."""

    def change(fits: pd.DataFrame) -> pd.DataFrame:
        lost = which(fits)
        fits[[*STIFFNESS_COLUMNS, "cost"]] = fits[[*STIFFNESS_COLUMNS, "cost"]].mask(lost)
        return fits.assign(status=fits["status"].mask(lost, "refused"))

    return change


def without_pose(which: Callable[[pd.DataFrame], pd.Series]) -> Change:
    """Simulations of which some have no pose."""

    def change(runs: pd.DataFrame) -> pd.DataFrame:
        lost = which(runs)
        columns = [
            f"{kind}_{name}" for kind in ("predicted", "error") for name in COORDINATE_COLUMNS
        ]
        runs[columns] = runs[columns].mask(lost)
        return runs.assign(status=runs["status"].mask(lost, "unstable"))

    return change


def at_start(fits: pd.DataFrame) -> pd.DataFrame:
    """All stiffness at its start but one: pose 1 has moved one, 2 both, 3 is an outlier."""
    fits[list(STIFFNESS_COLUMNS)] = START
    moved = fits["pose"].isin([1, 2])
    fits.loc[moved, "superior_n_per_m"] *= 0.7
    fits.loc[fits["pose"] == 2, "extension_nm_per_rad"] *= 1.02
    fits.loc[fits["pose"] == 3, "extension_nm_per_rad"] *= 10.0
    return fits


@sweep("rule, kept", [("all", [1, 2]), ("any", [2])])
def test_filters_of_the_study(tmp_path: Path, rule: str, kept: list[int]) -> None:
    size = Size(specimens=("a",), poses=6)
    study = f"success: {{failed_when: {rule}}}\n"
    run = Run(
        tmp_path,
        size,
        study,
        calibrations=lambda f: without_fit(lambda g: g["pose"] == 5)(at_start(f)),
    )
    judged = run.table("success").set_index("pose")
    assert judged.index[judged["reduced"]].tolist() == kept
    assert judged.index[judged["near_start_all"]].tolist() == [0, 4]
    assert judged.index[judged["near_start_any"]].tolist() == [0, 1, 3, 4]
    assert judged.index[judged["outlier"]].tolist() == [3]
    assert judged.index[~judged["solved"]].tolist() == [5]
    row = run.table("counts").iloc[0]
    names = ["fits", "solved", "near_start_any", "near_start_all", "outliers", "reduced"]
    assert row[names].tolist() == [6, 5, 4, 2, 1, len(kept)]


def test_one_joint_of_a_fit_that_is_an_outlier_takes_the_fit(tmp_path: Path) -> None:
    def change(fits: pd.DataFrame) -> pd.DataFrame:
        fits[list(STIFFNESS_COLUMNS)] = 2.0 * np.array(START)
        fits.loc[(fits["pose"] == 1) & (fits["joint"] == "V1V2"), "superior_n_per_m"] *= 5.0
        first = (fits["pose"] == 2) & (fits["joint"] == "V2V3")
        fits.loc[first, list(STIFFNESS_COLUMNS)] = START
        return fits

    size = Size(specimens=("a",), poses=4, grouping="per_joint")
    judged = Run(tmp_path, size, calibrations=change).table("success").set_index("pose")
    assert len(judged) == 4
    assert judged["reduced"].tolist() == [True, False, True, True]
    assert judged["near_start_any"].tolist() == [False, False, True, False]
    assert not judged["near_start_all"].any()


@sweep(
    "size, options",
    [
        pytest.param(Size(n_joints=1), {}, id="one joint"),
        pytest.param(Size(grouping="per_joint"), {}, id="per joint"),
        pytest.param(Size(solved=False), {}, id="nothing solved"),
        pytest.param(Size(), {"cohort": "zeroed_at_step_0: true\n"}, id="zeroed"),
        pytest.param(
            Size(),
            {
                "calibrations": without_fit(lambda f: f["specimen"] == "b"),
                "simulations": without_pose(lambda f: f["specimen"] == "b"),
            },
            id="one specimen without a fit",
        ),
        pytest.param(Size(), {"simulations": without_pose(lambda f: f["pose"] >= 0)}, id="no run"),
        pytest.param(
            Size(),
            {"simulations": without_pose(lambda f: f["stiffness"] != "calibrated")},
            id="no run with a best set",
        ),
        pytest.param(Size(), {"calibrations": without_fit(lambda f: f["pose"] > 0)}, id="one fit"),
        pytest.param(
            Size(),
            {"study": "success: {outlier_times_start: 1.0001, failed_when: any}\n"},
            id="few in the reduced dataset",
        ),
    ],
)
def test_what_fails_is_data(tmp_path: Path, size: Size, options: dict) -> None:
    """Every table keeps its schema, and what has no number says why."""
    run = Run(tmp_path, size, **options)
    tables = {name: run.table(name) for name in ANALYSES}
    assert set(tables["counts"]["specimen"]) == {"a", "b"}
    for name in ("statistics", "variance_shares", "importance", "agreement"):
        rows = tables[name]
        without = rows[rows["status"] != "done"]
        assert (without["message"] != "").all(), name
    for table, number in (("statistics", "p"), ("variance_shares", "share"), ("agreement", "bias")):
        rows = tables[table]
        assert rows.loc[rows["status"] == "done", number].notna().all()


def test_a_specimen_without_a_fit_leaves_the_other_alone(tmp_path: Path) -> None:
    lost = {
        "calibrations": without_fit(lambda f: f["specimen"] == "b"),
        "simulations": without_pose(lambda f: f["specimen"] == "b"),
    }
    whole, half = Run(tmp_path / "whole", Size()), Run(tmp_path / "half", Size(), **lost)
    for name in ("summary", "statistics", "importance", "agreement"):
        one, other = (run.table(name) for run in (whole, half))
        one, other = (t[t["specimen"] == "a"].reset_index(drop=True) for t in (one, other))
        pd.testing.assert_frame_equal(one, other)
    assert json.loads(Path(half.best).read_text())["b"] == []


def test_summary_medians_are_those_of_pandas(tmp_path: Path) -> None:
    run = Run(tmp_path, Size(specimens=("a",)))
    rows = run.table("summary").set_index(["dataset", "quantity", "joint", "coordinate"])
    fits, runs, judged = (run.table(n) for n in ("calibrations", "simulations", "success"))
    kept = judged.loc[judged["reduced"], "pose"]
    assert 0 < len(kept) < len(judged)
    for dataset, poses in (("all", judged["pose"]), ("reduced", kept)):
        chosen = fits.loc[fits["pose"].isin(poses), "superior_n_per_m"]
        row = rows.loc[(dataset, "stiffness", "*", "superior")]
        assert (row["n"], row["median"]) == (len(chosen), chosen.median())
        assert row["iqr"] == pytest.approx(chosen.quantile(0.75) - chosen.quantile(0.25))
        own = runs[(runs["stiffness"] == "calibrated") & (runs["joint"] == "V1V2")]
        # step 0 carries no reading
        error = own.loc[own["pose"].isin(poses) & (own["step"] == 1), "error_extension_deg"].abs()
        row = rows.loc[(dataset, "error", "V1V2", "extension")]
        assert row["median"] == pytest.approx(error.median())
        assert row["percent_of_measured"] == pytest.approx(100.0 * error.median())  # of 1 degree
    ranking = json.loads(Path(run.best).read_text())["a"]
    assert rows.loc[("best", "stiffness", "*", "extension"), "n"] == len(ranking) == 2
    assert ("all", "error", "V1V2", "anterior") not in rows.index


def test_a_refused_fit_makes_no_joint_of_its_own(tmp_path: Path) -> None:
    def change(fits: pd.DataFrame) -> pd.DataFrame:
        fits = without_fit(lambda f: f["pose"] == 3)(fits)
        once = (fits["pose"] != 3) | (fits["joint"] == "V1V2")
        fits = fits[once].copy()
        fits.loc[fits["pose"] == 3, "joint"] = "*"
        return fits

    size = Size(specimens=("a",), poses=6, grouping="per_joint")
    rows = Run(tmp_path, size, calibrations=change).table("summary")
    stiffness = rows[(rows["quantity"] == "stiffness") & (rows["dataset"] == "all")]
    assert set(stiffness["joint"]) == {"V1V2", "V2V3"}
    assert set(stiffness["n"]) == {5}


def test_correlations_are_those_of_scipy(tmp_path: Path) -> None:
    run = Run(tmp_path, Size(specimens=("a",)))
    rows = run.table("statistics")
    fits, runs, judged = (run.table(n) for n in ("calibrations", "simulations", "success"))
    kept = judged.loc[judged["reduced"], "pose"]
    stiffness = fits.set_index("pose").loc[kept, "extension_nm_per_rad"]
    own = runs[(runs["stiffness"] == "calibrated") & (runs["step"] == 1)]
    error = own.assign(size=own["error_extension_deg"].abs()).groupby("pose")["size"].mean()
    row = rows[
        (rows["family"] == "error against stiffness")
        & (rows["response"] == "extension_error")
        & (rows["factor"] == "extension_stiffness")
    ].iloc[0]
    expected = stats.spearmanr(stiffness, error.loc[kept])
    assert (row["n"], row["statistic"]) == (len(kept), pytest.approx(expected.statistic))
    family = rows[(rows["family"] == row["family"]) & (rows["test"] == row["test"])]
    assert set(family["family_size"]) == {len(family)} == {4}
    assert family["p_bonferroni"].tolist() == pytest.approx(np.minimum(1.0, 4 * family["p"]))


def test_best_stiffness_of_a_joint_is_that_joints_own(tmp_path: Path) -> None:
    size = Size(specimens=("a",), poses=8, grouping="per_joint", best=6)
    run = Run(tmp_path, size)
    rows, runs = run.table("statistics"), run.table("simulations")
    ranking = json.loads(Path(run.best).read_text())["a"]
    tested = rows[rows["family"] == "two-factor: extension_error at V1V2 against stiffness"]
    tested = tested[tested["status"] == "done"]
    row = tested[tested["factor"] == "superior_stiffness"].iloc[0]
    own = runs[(runs["pose"] == int(row["stratum"])) & (runs["joint"] == "V1V2")]
    error = own[own["step"] == 1].set_index("stiffness")["error_extension_deg"].abs()
    chosen = [one for one in ranking if np.isfinite(error[one["name"]])]
    assert row["n"] == len(chosen)
    values = [one["stiffness"][1][1] for one in chosen]  # V1V2 is the upper joint
    expected = stats.spearmanr(values, error[[one["name"] for one in chosen]]).statistic
    assert row["statistic"] == pytest.approx(expected)


def test_an_error_that_hangs_on_the_pose_is_the_poses_share(tmp_path: Path) -> None:
    """Errors are the pose's number plus a little for the set: nothing is left for both together."""

    def change(runs: pd.DataFrame) -> pd.DataFrame:
        runs = runs[runs["step"] == 1].copy()
        sets = runs["stiffness"].map(
            {"calibrated": 0.0, "best01": 0.1, "best02": 0.2, "best03": 0.3}
        )
        runs["error_extension_deg"] = 1.0 + runs["pose"] + sets
        return runs

    size = Size(specimens=("a",), poses=14, best=3)
    run = Run(tmp_path, size, simulations=change)
    n = int(run.table("success")["reduced"].sum())
    shares = run.table("variance_shares")
    own = shares[(shares["joint"] == "V1V2") & (shares["coordinate"] == "extension")]
    own = own.set_index("factor")
    assert (set(own["n_poses"]), set(own["n_stiffness"])) == ({n}, {3})
    poses = run.table("success").query("reduced")["pose"]
    by_pose, by_set = poses.var(), np.var([0.1, 0.2, 0.3], ddof=1)
    assert own.loc["pose", "share"] == pytest.approx(by_pose / (by_pose + by_set), abs=1e-9)
    assert own.loc["interaction", "share"] == pytest.approx(0.0, abs=1e-9)
    grown = run.table("importance")
    names = grown[(grown["joint"] == "V1V2") & (grown["coordinate"] == "extension")]["predictor"]
    assert names.tolist()[-2:] == ["superior_stiffness", "extension_stiffness"]
    assert len(names) == 6 * 2 + 2


def test_agreement_is_predicted_less_measured(tmp_path: Path) -> None:
    run = Run(tmp_path, Size(specimens=("a",)))
    rows = run.table("agreement").set_index(["dataset", "joint", "coordinate"])
    runs, judged = run.table("simulations"), run.table("success")
    kept = judged.loc[judged["reduced"], "pose"]
    own = runs[
        (runs["stiffness"] == "calibrated") & (runs["joint"] == "V1V2") & (runs["step"] == 1)
    ]
    for dataset, poses in (("all", judged["pose"]), ("reduced", kept)):
        part = own[own["pose"].isin(poses)]
        difference = part["predicted_extension_deg"] - part["measured_extension_deg"]
        row = rows.loc[(dataset, "V1V2", "extension")]
        assert row["n"] == len(part)
        assert row["bias"] == pytest.approx(difference.mean())
        assert row["upper_limit"] == pytest.approx(difference.mean() + 1.96 * difference.std())
    assert "anterior" not in rows.index.get_level_values("coordinate")


@sweep("scale, told", [(1.0, "told"), (0.01, "not_meaningful")])
def test_no_correlation_is_told_of_motion_that_hardly_varies(
    tmp_path: Path, scale: float, told: str
) -> None:
    """Measured motion varies like the predicted one, or a hundredth of it."""

    def change(runs: pd.DataFrame) -> pd.DataFrame:
        pose = runs["pose"].astype(float)
        return runs.assign(
            predicted_extension_deg=-5.0 + np.sin(1.7 * pose),
            measured_extension_deg=-5.0 + scale * np.cos(pose),
        )

    run = Run(tmp_path, Size(specimens=("a",), poses=14), simulations=change)
    rows = run.table("agreement").query("coordinate == 'extension' and dataset == 'all'")
    assert set(rows["proportional"]) == {told}
    assert rows["proportional_rho"].notna().all() == (told == "told")
    assert rows["proportional_p"].notna().all() == (told == "told")
    assert (rows["predicted_sd"] > 50.0 * rows["measured_sd"]).all() == (told != "told")


def test_errors_are_held_against_the_motion_that_each_pose_sees(tmp_path: Path) -> None:
    """Errors that grow with the measured motion: rank correlation 1 by every pose's own fit."""

    def change(runs: pd.DataFrame) -> pd.DataFrame:
        runs = runs[runs["step"] == 1]
        pose = runs["pose"].astype(float)
        return runs.assign(measured_extension_deg=-3.0 - 0.1 * pose, error_extension_deg=-pose)

    run = Run(tmp_path, Size(specimens=("a",), poses=14), simulations=change)
    rows = run.table("statistics").query("family == 'error against motion'")
    own = rows[rows["response"] == "extension_error"]
    assert set(own["factor"]) == {"extension_measured"}
    assert own["effect"].tolist() == pytest.approx([1.0] * len(own))
    assert len(own) == len(set(own["joint"])) > 0


def bootstrap_rows(sizes: dict[int, float | None]) -> list[dict]:
    """Fits of a start bootstrap of two joints that ended at that many times their start."""
    rows = []
    for number, (times, joint) in enumerate(
        (t, j) for t in sizes.values() for j in ("V2V3", "V1V2")
    ):
        start = np.array(START) * (1 + number // 2)
        key = {"specimen": "a", "bootstrap": "start", "loading": "dynamic", "set": number // 2}
        row = {**key, "joint": joint, "evaluations": 3, "message": ""}
        row |= dict(zip((f"start_{n}" for n in STIFFNESS_COLUMNS), start, strict=True))
        row |= {"damping_translation_n_s_per_m": 1e3, "damping_rotation_nm_s_per_rad": 1.4}
        row["status"] = "refused" if times is None else "converged"
        if times is not None:
            row |= dict(zip(STIFFNESS_COLUMNS, times * start, strict=True))
            row |= {"cost": 1.0, "extension_error_deg": 0.3 if joint == "V2V3" else 0.6}
        rows.append(row)
    return rows


def test_bootstrap_fits_are_judged_by_their_own_start(tmp_path: Path) -> None:
    run = Run(tmp_path, Size(specimens=("a",)))
    rows = bootstrap_rows({0: 1.0, 1: 0.5, 2: 5.0, 3: 10.0, 4: None})
    write_rows(run.folder / "bootstrap.parquet", BOOTSTRAP, rows)
    counted = run.table("counts").set_index("part").loc["start_bootstrap"]
    names = ["fits", "solved", "near_start_any", "near_start_all", "outliers", "reduced"]
    assert counted[names].tolist() == [5, 4, 1, 1, 1, 2]
    assert counted["loading"] == "dynamic"
    rows = run.table("summary")
    rows = rows[rows["part"] == "start_bootstrap"].set_index(
        ["dataset", "quantity", "joint", "coordinate"]
    )
    # ended at 1, 1, 15 and 40 times the first start; the filters keep sets 1 and 2
    row = rows.loc[("all", "stiffness", "*", "extension")]
    assert (row["n"], row["minimum"], row["maximum"]) == (4, 37.0, 40 * 37.0)
    row = rows.loc[("reduced", "stiffness", "*", "extension")]
    assert (row["n"], row["minimum"], row["maximum"]) == (2, 37.0, 15 * 37.0)
    row = rows.loc[("reduced", "error", "V1V2", "extension")]
    assert (row["n"], row["median"]) == (2, 0.6)
    assert row["percent_of_measured"] == pytest.approx(40.0)  # of 1.5 degrees


def test_sampled_starts_and_damping(tmp_path: Path) -> None:
    root = str(project(tmp_path, Size()))
    settings, _ = study_and_cohort(root, STUDY)
    ten = settings.damping_bootstrap.model_copy(update={"sets": 10})
    settings = settings.model_copy(update={"damping_bootstrap": ten})
    starts = bootstrap.sample_sets(settings, "a", "start")
    assert len(starts) == 100
    low, high = settings.start_bootstrap.lowest, settings.start_bootstrap.highest
    for start, damping in starts:
        assert (start >= low.in_order()).all()
        assert (start <= high.in_order()).all()
        assert damping.tolist() == [1000.0] * 3 + [1.4] * 3
    damped = bootstrap.sample_sets(settings, "a", "damping")
    assert len(damped) == 10
    for start, damping in damped:
        assert start.tolist() == list(START)
        assert set(damping[:3]) == {damping[0]}
        assert set(damping[3:]) == {damping[5]}
        assert 100.0 <= damping[0] <= 10000.0
        assert 0.14 <= damping[5] <= 14.0
    assert len({damping[0] for _, damping in damped}) == 10
    other = bootstrap.sample_sets(settings, "b", "damping")
    assert other[0][1][0] != damped[0][1][0]


@sweep("loading", ["quasi_static", "dynamic"])
def test_a_bootstrap_of_a_cohort_without_mass_is_refused(tmp_path: Path, loading: str) -> None:
    root, output = str(project(tmp_path, Size())), str(tmp_path / "fit.parquet")
    bootstrap.run(root, STUDY, "a", "start", loading, "00001", output)
    rows = read_frame(output)
    assert rows["joint"].tolist() == ["V2V3", "V1V2"] * SETS_PER_BATCH
    assert sorted(set(rows["set"])) == list(range(SETS_PER_BATCH, 100)), "the second batch of two"
    assert set(rows["status"]) == {"refused"}
    assert rows["message"].str.contains("mass and inertia").all()
    assert rows["extension_nm_per_rad"].isna().all()


@sweep("size", [Size(n_joints=1), Size(grouping="per_joint")])
def test_a_straight_spine_in_compression_and_flexion_in_closed_form(
    tmp_path: Path, size: Size
) -> None:
    """1 N m turns each joint by 1.5 degrees, 20 N (all but cos 1.5) shorten it by 0.2 mm."""
    root, output = str(project(tmp_path, size)), str(tmp_path / "fit.parquet")
    bootstrap.run(root, STUDY, "a", "start", "equilibrium", "00000", output)
    rows = read_frame(output)
    assert rows["superior_n_per_m"].tolist() == pytest.approx([20.0 / 0.2e-3] * len(rows), rel=2e-3)
    assert set(rows["status"]) == {"converged"}
    assert (rows["superior_error_mm"] < 1e-9).all()
    assert rows["anterior_error_mm"].isna().all()


Grids = dict[str, list[list[float | None]]]


def with_study(tmp_path: Path, size: Size, text: str) -> Path:
    """A project whose study file has more keys."""
    root = project(tmp_path, size)
    study = root / "config" / "studies" / f"{STUDY}.yaml"
    study.write_text(study.read_text() + text)
    return root


def precision_tables(
    tmp_path: Path, grids: Grids, nominal: float | None = 0.05, study: str = ""
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Tables of errors of poses at 1 and 2 mm, by kind of motion; None without result."""
    root = with_study(tmp_path, Size(specimens=("a",)), study)
    rows = []
    for level, sd in enumerate((1.0, 2.0)):
        for pose in range(len(next(iter(grids.values()))[level])):
            found = {name: grid[level][pose] for name, grid in grids.items()}
            lost = all(value is None for value in found.values())
            row = {"specimen": "a", "sd_mm": sd, "pose": pose, "stiffness": "calibrated"} | found
            row |= {f"nominal_{name}": nominal for name in grids}
            rows.append({**row, "status": "unstable" if lost else "converged", "message": ""})
    errors = write_rows(root / "precision_errors.parquet", PRECISION_ERRORS, rows)
    files = [str(root / f"{name}.parquet") for name in ("precision", "required")]
    landmark_precision.run(str(root), STUDY, [errors], *files)
    spread, required = (read_frame(file) for file in files)
    return spread.set_index(["motion", "sd_mm"]), required.set_index("motion")


def test_precision_counts_lost_poses_as_above_the_limit(tmp_path: Path) -> None:
    grids = {
        "translation_error_mm": [[0.1, 0.2, 0.3, 0.4], [0.5, 1.5, None, 0.7]],
        "rotation_error_deg": [[0.1, 0.2, 0.3, 2.0], [3.0, 0.2, None, 4.0]],
    }
    study = "landmark_precision: {share: 0.5}\n"
    spread, required = precision_tables(tmp_path, grids, study=study)
    row = spread.loc[("translation", 2.0)]
    assert (row["n"], row["without_result"], row["below"]) == (4, 1, 0.5)
    assert (row["median"], row["largest"]) == (0.7, 1.5)
    # Wilson (1927): centre 1/2, half width z sqrt(n + z2) / (n + z2) / 2 for a half of n
    z = stats.norm.ppf(0.975)
    assert row["below_high"] == pytest.approx(0.5 + 0.5 * z / np.sqrt(4 + z**2))
    # rotations: 3 of 4 at 1 mm, 1 of 4 at 2 mm; both: no pose at 2 mm is below both limits
    assert required.loc["rotation", "sd_mm"] == pytest.approx(1.5)
    assert required.loc["both", "sd_mm"] == pytest.approx(1.0 + 0.25 / 0.75)
    assert np.isnan(required.loc["translation", "sd_mm"])
    assert "2 mm will do" in required.loc["translation", "message"]


def test_precision_of_one_kind_of_motion(tmp_path: Path) -> None:
    grids = {"rotation_error_deg": [[0.1, 0.2], [0.3, 0.4]]}
    spread, required = precision_tables(tmp_path, grids)
    assert set(spread.index.get_level_values("motion")) == {"rotation"}
    assert required.index.tolist() == ["rotation"]


def test_precision_where_every_pose_is_lost_is_not_silence(tmp_path: Path) -> None:
    grids = {"translation_error_mm": [[None] * 3] * 2, "rotation_error_deg": [[None] * 3] * 2}
    spread, required = precision_tables(tmp_path, grids)
    assert len(spread) == 4
    assert (spread["below"] == 0.0).all()
    assert (spread["without_result"] == 3).all()
    assert required["message"].str.contains("1 mm will not do").all()


@sweep(
    "nominal, says",
    [(2.5, "misses by 2.5 times the limit"), (None, "own joint pose has no fit")],
)
def test_no_precision_is_told_where_the_nominal_pose_does_not_fit(
    tmp_path: Path, nominal: float | None, says: str
) -> None:
    """The limit is 1 deg; 4 of 5 poses are below it, which says nothing of landmarks then."""
    grids = {"rotation_error_deg": [[0.1] * 5, [0.1] * 4 + [3.0]]}
    _, required = precision_tables(tmp_path, grids, nominal)
    row = required.loc["rotation"]
    assert row[["sd_mm", "sd_low_mm", "sd_high_mm"]].isna().all()
    assert says in row["message"]
    assert np.isnan(row["nominal_share"]) if nominal is None else row["nominal_share"] == 2.5


def test_landmark_errors_of_every_sd_draw_the_same_directions(tmp_path: Path) -> None:
    root = str(project(tmp_path, Size(specimens=("a",))))
    settings, cohort = study_and_cohort(root, STUDY)
    exact = cohort.landmarks.iloc[0]
    offsets = []
    for sd in (0.5, 2.0):
        sets = landmarks_of(cohort, "a").with_sd(sd, 20, settings.seed, "precision/a")
        point = [s[exact["vertebra"]][exact["landmark"]] for s in sets]
        offsets.append(1000.0 * np.array(point) - exact[["x_mm", "y_mm", "z_mm"]].to_numpy(float))
    assert len(offsets[0]) == 20
    np.testing.assert_allclose(offsets[1], 4.0 * offsets[0], rtol=0, atol=1e-9)
    assert np.abs(offsets[1]).std() > 0.5


@pytest.mark.full
def test_landmark_errors_say_why_there_are_none(tmp_path: Path) -> None:
    """A joint without any stiffness in flexion tips over, in the cohort's own pose too."""
    soft = (
        "stiffness: {extension_nm_per_rad: 0.001}\nlandmark_precision: {sd_mm: [1.0], poses: 1}\n"
    )
    root = with_study(tmp_path, Size(specimens=("a",), free=("superior",)), soft)
    output = str(tmp_path / "errors.parquet")
    landmark_errors.run(str(root), STUDY, "a", "1", output)
    rows = read_frame(output).set_index("stiffness")
    assert rows["status"].to_dict() == {"calibrated": "unstable", "nominal": "refused"}
    assert "cohort's own pose was not calibrated" in rows.loc["nominal", "message"]
    assert rows["rotation_error_deg"].isna().all()
