"""Second, independent entry of the numbers of Gould et al. 2024b, and what they say of themselves.

Rows stand here as the paper prints them (right-left bending, axial rotation, flexion/extension;
specimens in their order; NS and NA in words), so that a slip in one entry does not repeat in the
other. The checks below them recompute printed numbers from other printed numbers.
"""

import math
from collections.abc import Mapping
from itertools import product
from typing import Any

import numpy as np
import pytest
from scipy import stats

from spinepipe.anatomy import published
from tests.published.test_anatomy import leaves, row

LOADS = ("left_lateral_bending", "left_axial_rotation", "flexion")
COORDINATES = ("right_bending", "left_rotation", "extension")
NM_PER_RAD = tuple(f"{name}_nm_per_rad" for name in COORDINATES)
N_PER_M = ("anterior_n_per_m", "superior_n_per_m", "right_n_per_m")
SPECIMENS = ("s01", "s02", "s03", "s04", "s05", "s06")
MODELS = ("per_specimen", "level_ratio")
STAGES = ("literature", "fitted", "left_out_specimen")

AGES = (57, 54, 56, 59, 44, 49)
SEXES = ("female",) * 5 + ("male",)
HEIGHTS = (1.57, 1.57, 1.72, 1.65, 1.63, 1.72)
MASSES = (59, 36, 48, 113, 49, 59)

TABLE_2 = """
T12L1  36.4  136.8  16.3
L1L2   43.6  128.1  27.5
L2L3   19.9  291.1  36.7
L3L4   12.4  291.1  49.5
L4L5   13.8  291.1  50.0
L5S1   68.8  183.4  51.0
"""

# Per load: lateral bending, axial rotation, flexion; without the column of initial values.
TABLE_3 = """
107.0  63.0   77.8   105.5  68.8   87.5
291.0  270.4  293.8  289.7  291.1  291.5
49.5   68.0   50.7   50.1   51.0   65.1
93.3   -      99.0   101.3  94.9   -
295.1  -      282.7  418.7  310.9  -
58.5   -      47.2   143.8  18.0   -
69.4   79.8   67.3   70.5   59.1   68.6
291.1  296.4  291.0  291.3  292.7  291.7
61.9   65.2   60.5   79     94.2   102.2
"""

# Median, IQR, percentage error: initial, then optimised.
TABLE_4 = """
2.0   0.9  30   1.1  1.3  16
0.6   0.1  27   0.5  0.2  24
3.2   1.6  44   1.2  0.7  17
16.5  1.7  247  1.6  0.6  25
1.0   0.3  38   0.9  0.4  33
5.3   1.6  75   2.4  0.9  33
"""

# Per load and model: joints, then specimens; literature, optimisation, cross-validation.
TABLE_5 = """
NS NS NS
NS NS NS
NS NS NS
NS NS NS
NS NS NS
NS NS NS
NS NS NS
NS NS NS
NS 0.003 0.047
NS NS 0.004
NS <0.001 0.001
NS NS 0.047
"""

# Pre- against post-optimisation, then post-optimisation against cross-validation.
TABLE_6 = """
<0.001 <0.001 0.026 <0.001 NS <0.001
NS NA NS NS NS NA
NS 0.040 NS NS NS NS
NS 0.050 NS 0.026 NS 0.050
NS <0.001 NS NS NS NS
NS NS NS NS 0.026 NS
<0.001 <0.001 0.050 <0.001 <0.001 0.002
NS NA NS NS NS NA
NS NS NS NS NS NS
NS 0.001 <0.001 0.001 NS 0.040
NS <0.001 NS NS NS NS
NS NS NS NS NS NS
"""

# Motion: lateral, axial, flexion, overall; p/H where p < 0.05, with the critical H 6.0.
TABLE_7 = """
NS NS NS NS
NS 0.04/4.1 NS NS
NS NS 0.04/4.3 0.04/4.3
"""

TEXT = {
    "load.largest_moment_nm": 7.5,
    "load.bending_rate_deg_per_s": 1.0,
    "load.axial_rotation_rate_deg_per_s": 0.5,
    "load.cycles": 3.5,
    **row("loaded_coordinate", LOADS, COORDINATES),
    "damping.translation_n_s_per_m": 1000,
    "damping.rotation_nm_s_per_rad": 2.3,
    "cost_coordinates.left_lateral_bending": ("extension", "right_bending"),
    "cost_coordinates.left_axial_rotation": ("extension", "right_bending", "left_rotation"),
    "cost_coordinates.flexion": ("extension", "right_bending"),
    **row("uniform_stiffness", NM_PER_RAD, (68.8, 291, 51.0)),
    **row("uniform_stiffness", N_PER_M, (149_000, 1_890_000, 135_000)),
    "fitted_range.left_lateral_bending.nm_per_rad": 44,
    "fitted_range.left_lateral_bending.percent_of_literature": 64,
    "fitted_range.left_axial_rotation.nm_per_rad": 136,
    "fitted_range.left_axial_rotation.percent_of_literature": 47,
    "fitted_range.flexion.nm_per_rad": 40,
    "fitted_range.flexion.percent_of_literature": 78,
    "not_converged.per_specimen.left_axial_rotation": ("s02", "s06"),
    "unchanged.per_specimen.left_lateral_bending": ("s05",),
    **row("mae_drop_points", LOADS, (14, 3, 27)),
    "rmse.largest_difference_between_specimens_percent": 37,
    "rmse.largest_difference_between_levels_percent": 33,
    "level_error.per_specimen_above_deg": 2,
    "level_error.per_specimen_below_deg": 0.1,
    "level_error.level_ratio_below_deg": 0.5,
    "literature_overpredicts.loads": ("left_lateral_bending", "flexion"),
    "level_ratio_range_larger.left_lateral_bending": ("T12L1", "L1L2", "L5S1"),
    "per_specimen_iqr_larger.left_lateral_bending": ("L2L3", "L3L4", "L4L5"),
    "per_specimen_iqr_larger.left_axial_rotation": (
        "T12L1",
        "L1L2",
        "L2L3",
        "L3L4",
        "L4L5",
        "L5S1",
    ),
    "per_specimen_iqr_larger.flexion": ("L1L2", "L2L3"),
    "rmse_larger_at_each_level.representation": "level_ratio",
    "significance.p_below": 0.05,
    "counts.specimens": 6,
    "counts.joints": 6,
    "counts.levels_tested": 5,
    "counts.fitted_parameters": 3,
    "counts.fitted_parameters_level_by_level": 18,
    "counts.cross_validations": 36,
    "counts.kruskal_wallis_tests": 36,
    "counts.signed_rank_tests": 72,
    "counts.signed_rank_family": 6,
    "counts.signed_rank_pairs": 15,
    "counts.representation_tests": 12,
    "counts.representation_values": 6,
    "counts.representation_values_in_axial_rotation": 4,
    "cost_of_a_fit.preliminary_hours_above": 8,
    "cost_of_a_fit.dynamic_iteration_hours_above": 1,
    "cost_of_a_fit.dynamic_iterations_above": 200,
    "per_specimen_against_level_ratio.critical_h": 6.0,
}


def cells(table: str) -> list[list[str]]:
    """The rows of a printed table."""
    return [line.split() for line in table.strip().splitlines()]


def printed_p(key: str, cell: str) -> dict[str, float]:
    """A printed p as a key; nothing for what is not printed as a number."""
    if cell in ("NS", "NA"):
        return {}
    return {f"{key}.p_below": float(cell[1:])} if cell[0] == "<" else {f"{key}.p": float(cell)}


def tables_1_to_4() -> dict[str, Any]:
    expected = {}
    for name, *values in zip(SPECIMENS, AGES, SEXES, HEIGHTS, MASSES, strict=True):
        expected |= row(f"specimens.{name}", ("age_years", "sex", "height_m", "mass_kg"), values)
    for joint, *numbers in cells(TABLE_2):
        expected |= row(f"level_stiffness.{joint}", NM_PER_RAD, tuple(map(float, numbers)))
    for (load, coordinate), numbers in zip(
        product(LOADS, COORDINATES), cells(TABLE_3), strict=True
    ):
        for name, number in zip(SPECIMENS, numbers, strict=True):
            if number != "-":
                expected[f"fitted_stiffness_nm_per_rad.{load}.{coordinate}.{name}"] = float(number)
    for (model, load), numbers in zip(product(MODELS, LOADS), cells(TABLE_4), strict=True):
        for stage, three in zip(STAGES, (numbers[:3], numbers[3:]), strict=False):
            names = ("median_deg", "iqr_deg", "median_percent")
            expected |= row(f"mae.{model}.{load}.{stage}", names, tuple(map(float, three)))
    return expected


def tables_5_to_7() -> dict[str, Any]:
    expected = {}
    rows = product(LOADS, MODELS, ("level", "specimen"))
    for (load, model, group), ps in zip(rows, cells(TABLE_5), strict=True):
        for stage, p in zip(STAGES, ps, strict=True):
            expected |= printed_p(f"kruskal_wallis.{load}.{model}.{group}.{stage}", p)
    stages = ("literature_against_fitted", "fitted_against_left_out_specimen")
    for (pair, model, load), ps in zip(product(stages, MODELS, LOADS), cells(TABLE_6), strict=True):
        for name, p in zip(SPECIMENS, ps, strict=True):
            expected |= printed_p(f"signed_rank.{pair}.{model}.{load}.{name}", p)
    for load, line in zip(LOADS, cells(TABLE_7), strict=True):
        for motion, cell in zip((*COORDINATES, "overall"), line, strict=True):
            if cell != "NS":
                key = f"per_specimen_against_level_ratio.{load}.{motion}"
                expected |= row(key, ("p", "h"), tuple(map(float, cell.split("/"))))
    return expected


def test_gould_2024b_is_entered_twice() -> None:
    expected = TEXT | tables_1_to_4() | tables_5_to_7()
    assert dict(leaves(published("gould_2024b"))) == expected


# What the printed numbers say of each other, beside what tests/comparison/test_recomputed.py has.

PAPER = published("gould_2024b")
FITTED = PAPER["fitted_stiffness_nm_per_rad"]


def literature(coordinate: str) -> float:
    """The start of every fit (N m/rad)."""
    return PAPER["uniform_stiffness"][f"{coordinate}_nm_per_rad"]


def spread(values: Mapping[str, float]) -> float:
    """Largest less smallest of the specimens."""
    return max(values.values()) - min(values.values())


def largest_motion_deg(maes: Mapping[str, Mapping[str, float]]) -> tuple[float, float]:
    """Ends of the largest mean motion that both stages' MAE and percentage leave, when rounded."""
    low = [(m["median_deg"] - 0.05) / (m["median_percent"] + 0.5) for m in maes.values()]
    high = [(m["median_deg"] + 0.05) / (m["median_percent"] - 0.5) for m in maes.values()]
    return 100 * max(low), 100 * min(high)


def level_motion_deg(coordinate: str, joints: tuple[str, ...]) -> float:
    """Mean rotation of single joints under the largest moment, at the published level stiffness."""
    moment = PAPER["load"]["largest_moment_nm"]
    stiffness = [PAPER["level_stiffness"][joint][f"{coordinate}_nm_per_rad"] for joint in joints]
    return float(np.mean([math.degrees(moment / value) for value in stiffness]))


@pytest.mark.parametrize("load", ["left_lateral_bending", "flexion"])
def test_both_models_give_the_same_largest_motion(load: str) -> None:
    ends = [largest_motion_deg(PAPER["mae"][model][load]) for model in MODELS]
    assert max(low for low, _ in ends) < min(high for _, high in ends)


def test_in_axial_rotation_the_models_were_compared_with_other_specimens() -> None:
    one, other = (
        largest_motion_deg(PAPER["mae"][model]["left_axial_rotation"]) for model in MODELS
    )
    assert one[0] < one[1] < other[0] < other[1]


def test_relative_to_the_start_the_loaded_coordinate_is_not_always_widest() -> None:
    for load in LOADS:
        loaded = PAPER["loaded_coordinate"][load]
        assert spread(FITTED[load][loaded]) == max(map(spread, FITTED[load].values()))
    axial = FITTED["left_axial_rotation"]
    assert spread(axial["extension"]) / literature("extension") == pytest.approx(2.47, abs=0.005)
    assert spread(axial["left_rotation"]) / literature("left_rotation") < 0.5


@pytest.mark.parametrize("load", LOADS)
def test_the_printed_drop_is_that_of_table_4(load: str) -> None:
    stages = PAPER["mae"]["per_specimen"][load]
    drop = stages["literature"]["median_percent"] - stages["fitted"]["median_percent"]
    assert drop == PAPER["mae_drop_points"][load]


@pytest.mark.parametrize("load", ["left_lateral_bending", "flexion"])
def test_the_level_left_out_is_probably_the_topmost(load: str) -> None:
    """Published stiffness overpredicts everywhere, so MAE is motion of the model less measured."""
    coordinate = PAPER["loaded_coordinate"][load]
    moment = PAPER["load"]["largest_moment_nm"]
    mae = {model: PAPER["mae"][model][load]["literature"]["median_deg"] for model in MODELS}
    joints = tuple(PAPER["level_stiffness"])[1:]  # without where
    measured = math.degrees(moment / literature(coordinate)) - mae["per_specimen"]
    lower, upper = (
        level_motion_deg(coordinate, five) - mae["level_ratio"]
        for five in (joints[1:], joints[:-1])
    )
    assert lower == pytest.approx(measured, abs=0.15)
    assert upper > measured + 1.0


def test_the_stiffest_level_keeps_the_uniform_stiffness() -> None:
    levels = [level for name, level in PAPER["level_stiffness"].items() if name != "where"]
    for name in NM_PER_RAD:
        assert max(level[name] for level in levels) == pytest.approx(
            PAPER["uniform_stiffness"][name], abs=0.11
        )
    ratio = PAPER["level_stiffness"]["L3L4"]["right_bending_nm_per_rad"] / 68.8
    assert ratio == pytest.approx(0.18, abs=0.001)  # though L3L4 is said to be the source


def test_missing_fits_are_those_that_did_not_converge() -> None:
    axial = FITTED["left_axial_rotation"]["left_rotation"]
    missing = tuple(name for name in SPECIMENS if name not in axial)
    assert missing == PAPER["not_converged"]["per_specimen"]["left_axial_rotation"]
    counted = PAPER["counts"]["representation_values_in_axial_rotation"]
    assert counted == len(axial) == len(SPECIMENS) - len(missing)
    bending = FITTED["left_lateral_bending"]
    for coordinate in COORDINATES:  # unchanged, to the digits printed
        assert bending[coordinate]["s05"] == pytest.approx(literature(coordinate), abs=0.11)


def test_counts_are_products_of_each_other() -> None:
    counts = PAPER["counts"]
    runs = counts["specimens"] * len(LOADS) * len(MODELS)
    assert counts["cross_validations"] == runs
    assert counts["signed_rank_tests"] == 2 * runs
    assert counts["signed_rank_pairs"] == 3 * counts["levels_tested"]
    assert counts["fitted_parameters_level_by_level"] == 3 * counts["joints"]
    assert counts["representation_tests"] == len(LOADS) * 4
    # both groupings of Table 5 together, where the text says specimens alone
    assert counts["kruskal_wallis_tests"] == len(LOADS) * len(MODELS) * 2 * len(STAGES)


def test_the_printed_critical_h_is_for_three_groups() -> None:
    table = PAPER["per_specimen_against_level_ratio"]
    assert table["critical_h"] == pytest.approx(stats.chi2.ppf(0.95, 2), abs=0.05)
    right = stats.chi2.ppf(0.95, 1)
    for load, motion in (
        ("left_axial_rotation", "left_rotation"),
        ("flexion", "extension"),
        ("flexion", "overall"),
    ):
        cell = table[load][motion]
        assert right < cell["h"] < table["critical_h"]
        # chi-squared with one degree of freedom, H rounded
        tail = math.erfc(math.sqrt(cell["h"] / 2))
        assert tail == pytest.approx(cell["p"], abs=0.005)


def test_printed_signed_rank_ps_are_exact_ones_of_fifteen_pairs_times_six() -> None:
    values = np.arange(1.0, PAPER["counts"]["signed_rank_pairs"] + 1)
    possible = []
    for below in range(16):  # so large is the rank sum of the other sign
        turned = np.where(values == below, -values, values)
        possible.append(6 * float(stats.wilcoxon(turned, method="exact").pvalue))
    assert possible[0] == pytest.approx(6 * 2**-14)
    assert possible[0] < 0.001
    printed = {value for key, value in tables_5_to_7().items() if key.startswith("signed_rank.")}
    for p in printed - {0.001}:
        assert min(abs(p - value) for value in possible) < 0.0005
