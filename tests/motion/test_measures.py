"""Rigidity of clusters, angles of neighbours and likeness of curves, against closed cases."""

import numpy as np
import pytest

from spinepipe.frames import rotation_zxy
from spinepipe.motion.marker_groups import rigidity
from spinepipe.motion.skeleton import MarkerSet, MarkerTrial
from spinepipe.statistics.waveforms import Likeness, multiple_correlation
from spinepipe.studies.tracking.error_metrics import angle_between, sagittal_angles
from spinepipe.studies.tracking.examine import cluster_rows
from spinepipe.studies.tracking.tables import CLUSTERS
from spinepipe.tables import from_rows


def test_distances_that_vary() -> None:
    """One distance that is 30, 31 and 32 mm, twice."""
    places = np.zeros((6, 2, 3))
    places[:, 1, 0] = [0.030, 0.031, 0.032] * 2
    found = rigidity(places, np.ones((6, 2), dtype=bool))
    sd = np.sqrt(4.0 / 5.0) * 1e-3
    assert found.variability_m == pytest.approx(sd)
    assert found.variability_percent == pytest.approx(100.0 * sd / 0.031)
    assert found.frames == 6


def test_frames_that_do_not_see_all_do_not_count() -> None:
    places = np.zeros((5, 2, 3))
    places[:, 1, 0] = [0.03, 9.0, 0.03, 0.03, 9.0]
    seen = np.ones((5, 2), dtype=bool)
    seen[[1, 4], 1] = False
    assert rigidity(places, seen).variability_m == pytest.approx(0.0, abs=1e-15)
    seen[0, 0] = False
    few = rigidity(places, seen)
    assert (few.variability_m, few.variability_percent, few.frames) == (None, None, 2)


def test_a_marker_by_itself_has_no_rigidity() -> None:
    found = rigidity(np.zeros((6, 1, 3)), np.ones((6, 1), dtype=bool))
    assert (found.variability_m, found.variability_percent, found.frames) == (None, None, 6)


def test_shares_are_means_of_each_pair_s_own() -> None:
    """0 and 30 mm apart from 31 to 33, and 100 mm on: three distances, two of which vary."""
    places = np.zeros((3, 3, 3))
    places[:, 1, 0], places[:, 2, 1] = [0.031, 0.032, 0.033], 0.1
    found = rigidity(places, np.ones((3, 3), dtype=bool))
    slanted = np.hypot(places[:, 1, 0], 0.1)
    spreads = [1e-3, 0.0, np.std(slanted, ddof=1)]
    assert found.variability_m == pytest.approx(np.mean(spreads))
    shares = [1e-3 / 0.032, 0.0, spreads[2] / slanted.mean()]
    assert found.variability_percent == pytest.approx(100.0 * np.mean(shares))


def test_rows_of_clusters() -> None:
    """A cluster that is rigid, one whose marker slides by 6 mm, and one that is hardly seen."""
    names = ("L4_a", "L4_b", "L2_a", "L2_b", "T5", "T1_a", "T1_b")
    clusters = ("L4", "L4", "L2", "L2", "", "T1", "T1")
    at = np.zeros((7, 3))
    at[[1, 3, 6], 0] = 0.03
    markers = MarkerSet(names, np.array([2, 2, 4, 4, 13, 17, 17]), at, np.ones(7), clusters)
    places = np.tile(at, (4, 1, 1))
    places[:, 3, 0] += [0.0, 0.002, 0.004, 0.006]
    seen = np.ones((4, 7), dtype=bool)
    seen[2:, 5] = False
    times = np.arange(4) * 0.1
    trial = MarkerTrial("bends", "flexion_extension", times, places, seen, "hanging")
    rows = list(cluster_rows("s01", markers, trial))
    from_rows(CLUSTERS, rows)
    told = {row["cluster"]: (row["status"], row["frames"]) for row in rows}
    assert told == {"L4": ("rigid", 4), "L2": ("not_rigid", 4), "T1": ("too_few", 2)}


def test_angles_of_neighbours_are_differences_in_one_plane() -> None:
    """Bodies turned about z alone, each by so much in ground."""
    in_ground = np.linspace(-0.4, 0.6, 18)
    turns = np.array([rotation_zxy(angle, 0.0, 0.0) for angle in in_ground])
    np.testing.assert_allclose(sagittal_angles(turns), np.diff(in_ground), atol=1e-12)


@pytest.mark.parametrize("angle", [1e-9, 1e-4, 0.3, 3.0])
def test_angle_of_one_rotation_to_another(angle: float) -> None:
    one = rotation_zxy(0.3, -0.2, 0.5)
    assert angle_between(one, one @ rotation_zxy(angle, 0.0, 0.0)) == pytest.approx(angle, rel=1e-6)


def test_half_a_turn_is_the_most_also_where_matrices_are_rounded() -> None:
    half = np.diag([-1.0, -1.0, 1.0])
    for larger in (1.0, 1.0 + 1e-9):
        assert angle_between(np.eye(3), larger * half) == pytest.approx(np.pi, abs=1e-4)


def test_likeness_by_hand() -> None:
    """Curves 0 1 2 and 1 2 3: about their mean curve 1.5 / 3, about their mean 5.5 / 5."""
    found = multiple_correlation(np.array([[0.0, 1.0, 2.0], [1.0, 2.0, 3.0]]))
    assert found.value == pytest.approx(np.sqrt(1.0 - 0.5 / 1.1))
    assert (found.curves, found.points, found.status) == (2, 3, Likeness.DONE)


def test_likeness_is_that_of_an_analysis_of_variance() -> None:
    """One way, points as groups: mean squares by scipy give the same."""
    from scipy.stats import f_oneway

    rng = np.random.default_rng(3)
    curves = np.sin(np.linspace(0.0, 3.0, 12)) + rng.normal(0.0, 0.2, (5, 12))
    f = f_oneway(*curves.T).statistic
    between, within = 11, 12 * 4
    expected = np.sqrt(1.0 - (between + within) / (between * f + within))
    assert multiple_correlation(curves).value == pytest.approx(expected)


def test_likeness_needs_numbers() -> None:
    with pytest.raises(ValueError, match="finite"):
        multiple_correlation(np.array([[0.0, np.nan], [1.0, 2.0]]))


def test_two_points_are_enough_and_one_is_not() -> None:
    """By hand: 1 - (0.02 / 2) / (1.23 / 3)."""
    found = multiple_correlation(np.array([[0.0, 1.0], [0.0, 1.2]]))
    assert found.value == pytest.approx(np.sqrt(1.0 - 0.01 / 0.41))
    assert multiple_correlation(np.array([[0.0], [1.0]])).status == Likeness.TOO_FEW
