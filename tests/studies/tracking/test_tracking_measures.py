"""Errors, ranges, sharing and likeness of motions, against sizes that the cases were made with."""

import numpy as np
import pandas as pd
import pytest
from moving_spine import spine
from scipy.spatial.transform import Rotation

from spinepipe.motion.skeleton import BODIES, JOINTS, body_poses
from spinepipe.studies.tracking.accuracy import accuracy_rows
from spinepipe.studies.tracking.error_metrics import truths
from spinepipe.studies.tracking.errors import error_rows
from spinepipe.studies.tracking.profile import verdict
from spinepipe.studies.tracking.ranges import range_rows
from spinepipe.studies.tracking.sharing import sharing_rows, similarity_rows
from spinepipe.studies.tracking.tables import (
    ACCURACY,
    ERRORS,
    RANGES,
    SHARING,
    SIMILARITY,
)
from spinepipe.studies.tracking.tracked_motions import IN_ORDER, motions
from spinepipe.tables import from_rows
from spinepipe.units import COORDINATE_COLUMNS, DEG_PER_RAD, DISPLAY_PER_SI, MM_PER_M

FRAMES = 51
TRIAL, APPROACH = "bends", "ik"
KINDS = {(who, TRIAL): "flexion_extension" for who in ("s01", "s02", "s03")}
L4L5 = 2
"""Place of L4 among bodies."""


def still(frames: int = FRAMES) -> np.ndarray:
    return np.zeros((frames, 18, 6))


def tracked(q: np.ndarray, specimen: str = "s01", span_s: float = 2.0) -> pd.DataFrame:
    """Rows of the table, in a random order."""
    frames = len(q)
    shown = (q * DISPLAY_PER_SI).reshape(-1, 6)
    rows = pd.DataFrame(shown, columns=list(COORDINATE_COLUMNS))
    rows["joint"] = list(IN_ORDER) * frames
    rows["frame"] = np.repeat(np.arange(frames), 18)
    rows["time_s"] = np.repeat(np.linspace(0.0, span_s, frames), 18)
    told = rows.assign(specimen=specimen, trial=TRIAL, approach=APPROACH)
    return told.sample(frac=1.0, random_state=0)


def truth(q: np.ndarray, centres: np.ndarray, span_s: float = 2.0) -> dict[str, pd.DataFrame]:
    """Rows of `truth_centres.csv`, each rotation as scipy takes it from its matrix."""
    turns, places = body_poses(spine(), q)
    rows = []
    for frame, time in enumerate(np.linspace(0.0, span_s, len(q))):
        for body, name in enumerate(BODIES):
            turn = turns[frame, body]
            at = MM_PER_M * (places[frame, body] + turn @ centres[body])
            angles = Rotation.from_matrix(turn).as_euler("ZXY", degrees=True)
            rows.append(("s01", TRIAL, time, name, *at, *angles))
    names = ["specimen", "trial", "time_s", "vertebra", "x_mm", "y_mm", "z_mm"]
    turned = ["extension_deg", "right_bending_deg", "left_rotation_deg"]
    return {"truth_centres": pd.DataFrame(rows, columns=[*names, *turned])}


CENTRES = np.tile([0.004, 0.015, 0.0], (18, 1))


def errors(
    q: np.ndarray, true: np.ndarray, kind: str = "flexion_extension", **spans: float
) -> pd.DataFrame:
    known = list(truths(truth(true, CENTRES, **spans)))
    kinds = {("s01", TRIAL): kind}
    rows = list(error_rows(tracked(q), known, {"s01": (spine(), CENTRES)}, kinds))
    from_rows(ERRORS, rows)
    return pd.DataFrame(rows).set_index(["measure", "level"])


def test_a_motion_is_read_back_from_its_rows() -> None:
    q = np.random.default_rng(0).normal(0.0, 0.1, (4, 18, 6))
    (moved,) = motions(tracked(q))
    np.testing.assert_allclose(moved.q, q, atol=1e-15)
    np.testing.assert_allclose(moved.time_s, np.linspace(0.0, 2.0, 4))
    half_way = moved.at(np.array([1.0]))[0]
    np.testing.assert_allclose(half_way, 0.5 * (q[1] + q[2]), atol=1e-15)
    (one,) = motions(tracked(q[:1]))  # one frame holds for all times
    np.testing.assert_allclose(one.at(np.array([0.0, 9.0])), q[[0, 0]], atol=1e-15)


def test_a_motion_without_error_has_none() -> None:
    q = still()
    q[:, :, 3:] = np.random.default_rng(1).normal(0.0, 0.1, (FRAMES, 18, 3))
    found = errors(q, q)
    assert found["largest"].max() < 1e-9
    assert list(found.loc["centre_mm"].index) == list(BODIES[1:])
    assert list(found.loc["angle_deg"].index) == list(JOINTS[1:11])
    assert found.index.get_level_values(1)[-1] == "T1T2"


def test_a_pelvis_off_takes_all_centres_along() -> None:
    q = still()
    q[:, 0, :3] = [0.002, 0.0, 0.001]
    found = errors(q, still())
    np.testing.assert_allclose(found.loc["centre_mm"]["mean"], np.sqrt(5.0), atol=1e-9)
    assert found.loc["angle_deg"]["largest"].max() < 1e-9


def test_a_joint_off_moves_what_is_above() -> None:
    """Chords about the joint that is off; the angle of that joint alone; no change over time."""
    q, by = still(), np.deg2rad(2.0)
    q[:, L4L5, 3] = by
    found = errors(q, still())
    chord = 2.0 * np.sin(by / 2.0) * np.hypot(*CENTRES[0, :2])
    assert found.loc[("centre_mm", "L4"), "mean"] == pytest.approx(MM_PER_M * chord)
    assert found.loc[("centre_mm", "L5"), "mean"] == pytest.approx(0.0, abs=1e-9)
    angles = found.loc["angle_deg"]["mean"]
    assert angles["L4L5"] == pytest.approx(2.0)
    assert angles.drop("L4L5").abs().max() < 1e-9
    assert found.loc["joint_angle_deg"]["largest"].max() < 1e-7


def test_a_joint_that_goes_off_has_the_angle_of_its_rotation() -> None:
    """Off by 0 to 3 deg about a slanted axis: mean over instants after the first, 95th, largest."""
    q, share = still(), np.linspace(0.0, 1.0, FRAMES)
    axis = np.array([1.0, 2.0, 2.0]) / 3.0
    turns = Rotation.from_rotvec(np.deg2rad(3.0) * share[:, None] * axis)
    q[:, L4L5, 3:] = turns.as_euler("ZXY")
    found = errors(q, still()).loc[("joint_angle_deg", "L4L5")]
    expected = 3.0 * share[1:]
    assert found["mean"] == pytest.approx(expected.mean())
    assert found["largest"] == pytest.approx(3.0)
    assert found["p95"] == pytest.approx(3.0 * 0.951)
    assert found["n"] == FRAMES - 1


def test_truth_between_frames_and_of_a_stance() -> None:
    """Five instants of a motion at a constant rate; one posture held against many instants."""
    q, true = still(), still(5)
    q[:, 0, 0], true[:, 0, 0] = np.linspace(0.0, 0.1, FRAMES), np.linspace(0.0, 0.1, 5)
    found = errors(q, true)
    assert found["largest"].max() < 1e-9
    assert set(found.loc["centre_mm"]["n"]) == {5}
    standing = errors(still(1), true, "stance")
    assert standing.loc[("centre_mm", "L4"), "mean"] == pytest.approx(50.0)
    assert "joint_angle_deg" not in standing.index.get_level_values(0)


def test_centres_alone_give_no_angles() -> None:
    further = truth(still(), CENTRES)
    rows = further["truth_centres"]
    rows[[name for name in rows if name.endswith("_deg")]] = np.nan
    rows = rows[rows["vertebra"].isin(["L4", "L5"])]
    known = list(truths({"truth_centres": rows}))
    found = list(error_rows(tracked(still()), known, {"s01": (spine(), CENTRES)}, KINDS))
    named = [(row["measure"], row["level"]) for row in found]
    assert named == [("centre_mm", "L5"), ("centre_mm", "L4")]
    assert list(truths({})) == []


def test_persons_count_once_in_accuracy() -> None:
    """Means of 2, 4 and 9 mm: 5, and t(2 df) times 3.6056 / sqrt(3) either way."""
    common = {"trial": TRIAL, "approach": APPROACH, "measure": "centre_mm"}
    values = {"s01": [1.0, 3.0], "s02": [4.0], "s03": [8.0, 9.0, 10.0]}
    rows = [
        {**common, "specimen": who, "level": str(k), "mean": value}
        for who, of_person in values.items()
        for k, value in enumerate(of_person)
    ]
    (found,) = accuracy_rows(pd.DataFrame(rows))
    from_rows(ACCURACY, [found])
    assert found["mean"] == pytest.approx(5.0)
    reach = 4.302653 * np.sqrt(13.0 / 3.0)
    assert found["low"] == pytest.approx(5.0 - reach, abs=1e-5)
    assert found["high"] == pytest.approx(5.0 + reach, abs=1e-5)
    (alone,) = accuracy_rows(pd.DataFrame(rows[:2]))
    assert (alone["mean"], alone["low"], alone["n_specimens"]) == (2.0, None, 1)


def test_ranges_are_largest_less_smallest() -> None:
    q = still()
    q[:, 3, 3] = 0.1 * np.sin(np.linspace(0.0, 2.0 * np.pi, FRAMES))
    q[:, 3, 0] = np.linspace(-0.001, 0.002, FRAMES)
    rows = list(range_rows(tracked(q)))
    from_rows(RANGES, rows)
    found = {(row["joint"], row["coordinate"]): row for row in rows}
    assert len(found) == 17 * 6
    largest = 0.2 * np.sin(2.0 * np.pi * 0.26) * DEG_PER_RAD
    assert found["L3L4", "extension"]["range"] == pytest.approx(largest, rel=1e-3)
    assert found["L3L4", "anterior"]["range"] == pytest.approx(3.0)
    assert found["L3L4", "anterior"]["unit"] == "mm"
    assert list(range_rows(tracked(still(1)))) == []


def bent(shares: list[float], largest_deg: float, axis: int = 3) -> np.ndarray:
    """Lumbar joints that share a rotation which grows to the middle and shrinks again."""
    q, whole = still(), np.deg2rad(largest_deg) * np.sin(np.linspace(0.0, np.pi, FRAMES))
    q[:, 1:7, axis] = -whole[:, None] * np.array(shares)
    return q


FROM_BELOW = [0.1, 0.15, 0.2, 0.2, 0.2, 0.15]


def test_joints_share_as_they_were_made_to() -> None:
    rows = list(sharing_rows(tracked(bent(FROM_BELOW, 40.0)), KINDS))
    from_rows(SHARING, rows)
    found = pd.DataFrame(rows).set_index(["window", "joint"])
    for joint, share in zip(JOINTS[:6], FROM_BELOW, strict=True):
        assert found.loc[("20-80", joint), "share"] == pytest.approx(share)
    assert found.loc[("20-80", "L5S1"), "frames_used"] == 31
    assert found.loc[("60-80", "L5S1"), "frames_used"] == 11
    assert len(found) == 4 * 6


def test_shares_of_a_bend_are_of_its_own_axis() -> None:
    """Right bending shared evenly beside extension of one joint alone."""
    q = bent([1 / 6] * 6, 30.0, axis=4) + bent([1.0, 0, 0, 0, 0, 0], 30.0)
    rows = list(sharing_rows(tracked(q), {("s01", TRIAL): "lateral_bending"}))
    assert {round(row["share"], 9) for row in rows} == {round(1 / 6, 9)}
    assert list(sharing_rows(tracked(q), {("s01", TRIAL): "stance"})) == []


def test_a_lumbar_spine_that_hardly_turns_has_no_shares() -> None:
    """1.9 deg in all; and 4 deg, of which the middle third of the cycle alone has 3.9 or more."""
    rows = list(sharing_rows(tracked(bent(FROM_BELOW, 1.9)), KINDS))
    from_rows(SHARING, rows)
    assert {row["status"] for row in rows} == {"too_small"}
    assert {row["share"] for row in rows} == {None}
    some = pd.DataFrame(list(sharing_rows(tracked(bent(FROM_BELOW, 2.3)), KINDS)))
    used = some.drop_duplicates("window").set_index("window")["frames_used"]
    inside = np.abs(np.sin(np.linspace(0.0, np.pi, FRAMES))) * 2.3 >= 2.0
    assert used["20-80"] == inside.sum() < 31
    assert used["40-60"] == 11


def test_a_window_without_a_frame_says_so() -> None:
    q = bent(FROM_BELOW, 40.0)[[0, 25, 50]]
    rows = pd.DataFrame(list(sharing_rows(tracked(q), KINDS)))
    of_window = rows.drop_duplicates("window").set_index("window")["status"]
    assert list(of_window[["20-80", "20-40", "40-60", "60-80"]]) == [*("done", "too_few")] * 2


def alike(*persons: np.ndarray) -> pd.DataFrame:
    rows = pd.concat([tracked(q, f"s0{k + 1}") for k, q in enumerate(persons)])
    found = list(similarity_rows(rows, KINDS))
    from_rows(SIMILARITY, found)
    return pd.DataFrame(found).set_index("window")


def test_persons_that_share_alike_have_one() -> None:
    found = alike(bent(FROM_BELOW, 40.0), bent(FROM_BELOW, 20.0), bent(FROM_BELOW, 60.0))
    np.testing.assert_allclose(found["cmc"].astype(float), 1.0)
    assert set(found["n_specimens"]) == {3}


def test_likeness_of_two_persons_is_that_of_its_formula() -> None:
    """Shares constant over 61 instants: sums over the six joints by hand."""
    other = [0.15, 0.2, 0.2, 0.2, 0.15, 0.1]
    found = alike(bent(FROM_BELOW, 40.0), bent(other, 40.0)).loc["20-80"]
    one, two = np.array(FROM_BELOW), np.array(other)
    about_mean_curve = 61 * 2 * np.sum(((one - two) / 2.0) ** 2) / (6 * 61 * 1)
    about_mean = 61 * np.sum((one - 1 / 6) ** 2 + (two - 1 / 6) ** 2) / (2 * 6 * 61 - 1)
    assert found["cmc"] == pytest.approx(np.sqrt(1.0 - about_mean_curve / about_mean))


def test_persons_that_share_unlike_have_no_coefficient() -> None:
    found = alike(bent(FROM_BELOW, 40.0), bent([0.4, 0.2, 0.1, 0.1, 0.1, 0.1], 40.0)).loc["20-80"]
    assert found["status"] == "undefined"
    assert found["cmc"] is None
    assert "more than they vary" in found["message"]


def test_persons_that_hardly_turn_are_left_out_and_told_of() -> None:
    found = alike(bent(FROM_BELOW, 40.0), bent(FROM_BELOW, 1.0)).loc["20-80"]
    assert (found["status"], found["n_specimens"]) == ("too_few", 1)
    assert "1 persons turned too little" in found["message"]


def test_a_cost_that_falls_to_the_end_of_what_was_tried_tells_no_stiffness() -> None:
    """A minimum inside closes ends; one at an end closes none, however steep the cost is."""
    ratios = np.array([0.25, 0.5, 1.0, 2.0, 4.0])
    inside = verdict(ratios, np.array([9.0, 1.0, 0.0, 1.0, 9.0]))
    assert inside["verdict"] == "told"
    share = (3.84 - 1.0) / 8.0  # straight in logarithms between 1 and 9
    assert inside["low"] == pytest.approx(0.5 * 0.5**share)
    assert inside["high"] == pytest.approx(2.0 * 2.0**share)
    for costs, edge in (([0, 9, 20, 30, 40], "softest"), ([40, 30, 20, 9, 0], "stiffest")):
        found = verdict(ratios, np.array(costs, dtype=float))
        assert (found["low"], found["high"], found["verdict"]) == (None, None, "not_told")
        # the other end is not open: all that was tried there is excluded
        assert (found["open_below"], found["open_above"]) == (edge == "softest", edge != "softest")
        assert found["best_ratio"] == (0.25 if edge == "softest" else 4.0)
        assert edge in found["message"]
    for end in (0.1, 0.3, 10.0):  # exp(log(x)) is not x
        tried = np.array(sorted({end, 1.0}))
        assert verdict(tried, np.where(tried == end, 0.0, 9.0))["best_ratio"] == end
    flat = verdict(ratios, np.array([0.0, 0.1, 0.2, 0.3, 0.4]))
    assert (flat["open_below"], flat["open_above"]) == (True, True)
    lost = verdict(ratios, np.array([np.inf, 0.0, 1.0, 9.0, 20.0]))
    assert lost["verdict"] == "not_told"  # the least that settled is the end
    assert "1 of 5 fits did not settle" in lost["message"]
