"""Second, independent entry of every number of Gould et al. 2024a, in the layout of the paper.

Column order here is the paper's own (anterior-posterior, inferior-superior, right-left; right-left
bending, axial rotation, flexion-extension), so that a slip in one entry does not repeat in the
other. The comparison covers every key: a number cannot enter the package without its twin here.
"""

from collections.abc import Iterator, Mapping
from typing import Any

import pytest
from sweeps import sweep

from spinepipe.anatomy import PAPERS, published

MM = ("anterior_mm", "superior_mm", "right_mm")
DEG = ("right_bending_deg", "left_rotation_deg", "extension_deg")
N_PER_M = ("anterior_n_per_m", "superior_n_per_m", "right_n_per_m")
NM_PER_RAD = ("right_bending_nm_per_rad", "left_rotation_nm_per_rad", "extension_nm_per_rad")
FITTED_COORDINATES = ("anterior", "superior", "extension")
FITTED_STIFFNESS = ("anterior_n_per_m", "superior_n_per_m", "extension_nm_per_rad")
SAGITTAL = ("anterior_mm", "superior_mm", "extension_deg")


def row(prefix: str, names: tuple[str, ...], values: tuple[float, ...]) -> dict[str, Any]:
    """One printed row as ``{dotted key: number}``."""
    return {f"{prefix}.{name}": value for name, value in zip(names, values, strict=True)}


def leaves(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Dotted key and value of everything but the sources."""
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from leaves(value, f"{prefix}{key}.")
        elif key not in ("where", "doi", "title"):
            yield f"{prefix}{key}", value


SECTIONS_2024A = {
    "specimen.segment": "L1-L4",
    "specimen.age_years": 73,
    "specimen.sex": "female",
    "specimen.mass_kg": 72.6,
    "load.offset_percent_of_disc_depth": 10,
    "load.cycles": 3,
    "load.largest_compression_n": 54,
    "load.flexion_moment_nm": 1,
    "bodies.bone_density_g_per_cm3": 1.14,
    "bodies.top_mass_kg": 1,
    "bodies.top_offset_mm": 50,
    **row("start_stiffness", N_PER_M + NM_PER_RAD, (24_600, 110_000, 13_500, 64, 268, 37)),
    "damping.translation_n_s_per_m": 1000,
    "damping.rotation_nm_s_per_rad": 1.4,
    "settling.time_s": 1.5,
    **row("cost_weights", ("anterior", "superior", "right", "extension"), (10, 100, 1, 1)),
    "landmarks.palpations": 5,
    "landmarks.largest_resultant_sd_mm": 2.9,
    "success_rule.failed_within_percent_of_start": 1,
    "success_rule.outlier_times_start": 10,
    "outlier.extension_nm_per_rad": 470,
    "outlier.extension_error_percent": 97,
    "significance.p_below": 0.05,
    "counts.pose_samples": 500,
    "counts.pose_samples_successful": 124,
    "counts.pose_samples_reduced": 123,
    "counts.best_models": 10,
    "counts.damping_sets": 10,
    "counts.damping_sets_successful": 4,
    "counts.start_stiffness_sets": 100,
    "counts.start_stiffness_sets_successful": 66,
}

TABLE_1 = {
    **row("start_stiffness_box.low", N_PER_M + NM_PER_RAD, (31_600, 108_000, 53_000, 9.0, 43, 12)),
    **row(
        "start_stiffness_box.high",
        N_PER_M + NM_PER_RAD,
        (857_000, 3_330_000, 584_000, 249, 1_250, 750),
    ),
}

# The paper prints magnitudes of compression and flexion; both are negative coordinates here.
SECTION_3 = {
    **row("measured_motion.L2L3", SAGITTAL, (0.34, -0.14, -1.4)),
    **row("measured_motion.L3L4", SAGITTAL, (0.33, -0.25, -1.8)),
    **row("measurement_uncertainty", SAGITTAL[:2], (0.0013, 8.1e-4)),
    **row("nominal_model_error", SAGITTAL, (0.32, 0.05, 0.26)),
    **row("nominal_model_error_percent", FITTED_COORDINATES, (93, 37, 12)),
    **row("best_model.largest_error_percent", FITTED_COORDINATES, (5, 41, 5.3)),
    "best_model.superior_error_of_L2L3.error_mm": 0.02,
    "best_model.superior_error_of_L2L3.percent": 15,
    **row("bootstrap_stiffness_range.damping", FITTED_STIFFNESS, (12_000, 230_000, 0.5)),
    **row("bootstrap_stiffness_range.start", FITTED_STIFFNESS, (550_000, 390_000, 3528)),
    **row(
        "bootstrap_stiffness_range.start_without_outliers",
        FITTED_STIFFNESS,
        (233_000, 390_000, 4.4),
    ),
    "ten_best_anterior_stiffness_percent_of_median.iqr": 72,
    "ten_best_anterior_stiffness_percent_of_median.range": 112,
    **row("best_model.stiffness", FITTED_STIFFNESS, (11_900, 437_000, 14.9)),
    **row("best_model.largest_error", SAGITTAL, (0.033, 0.11, 0.077)),
    **row("reduced_stiffness.median", FITTED_STIFFNESS, (28_900, 365_000, 13.4)),
    **row("reduced_stiffness.quartile_25", FITTED_STIFFNESS, (10_100, 314_000, 12.4)),
    **row("reduced_stiffness.quartile_75", FITTED_STIFFNESS, (46_000, 428_000, 14.3)),
    "reduced_error_bound.translation_mm": 0.8,
    "reduced_error_bound.rotation_deg": 0.8,
    "error_depends_on_motion.anterior": True,
    "error_depends_on_motion.superior": False,
    "error_depends_on_motion.extension": True,
    "pose_correlation.p": 0.045,
    "pose_correlation.r": 0.18,
    "pose_correlation.significant_pairs_with_stiffness": 1,
    "pose_correlation.significant_pairs_with_error": 0,
    "friedman.p_below": 0.05,
    "tree.more_influential": "pose",
    "tree.less_influential": "stiffness",
    "reduced_against_complete.origin_median_mm": 1,
    "reduced_against_complete.origin_iqr_mm": 0.2,
    "reduced_against_complete.orientation_deg": 1,
    "reduced_against_complete.extension_iqr_drop_deg.L1L2": 5.6,
    "reduced_against_complete.extension_iqr_drop_deg.L3L4": 4.3,
}

SECTION_4 = {
    "spread_bound.origin_iqr_mm": 1.25,
    "spread_bound.bending_and_rotation_iqr_deg": 3.6,
    "spread_bound.extension_iqr_deg": 8.5,
    **row("ten_best_error_in_discussion.median", SAGITTAL, (0.15, 0.12, 0.15)),
    **row("ten_best_error_in_discussion.iqr", SAGITTAL, (0.18, 0.06, 0.15)),
    "target_error.translation_mm": 1,
    "target_error.rotation_deg": 1,
}

# Rows of Tables 2 and 3: per direction (L2 median, range, L3 median, range, largest percent).
BOOTSTRAP_ROWS = {
    ("damping", "quasi_static"): (
        (0.42, 0.01, 0.19, 0.07, 102),
        (5e-4, 0.35, 0.1, 0.16, 35),
        (0.14, 0.05, 0.25, 0.12, 13),
    ),
    ("damping", "dynamic"): (
        (0.45, 0.06, 0.28, 0.1, 110),
        (0.06, 0.14, 0.05, 0.06, 35),
        (0.48, 1.2, 0.52, 1.5, 29),
    ),
    ("start", "quasi_static"): (
        (0.42, 0.24, 0.31, 0.41, 102),
        (4e-4, 0.36, 0.09, 0.26, 35),
        (0.03, 1.5, 0.07, 1.9, 4),
    ),
    ("start", "dynamic"): (
        (0.41, 0.11, 0.31, 0.34, 102),
        (9e-4, 0.36, 0.09, 0.27, 35),
        (0.04, 1.5, 0.09, 1.9, 5),
    ),
}

# Cells of Table 6 that are not NA: row, then error, then the printed ends.
TABLE_6 = {
    "two_factor_correlation.orientation.L3L4.left_rotation.extension": (0.18, 0.20),
    "two_factor_correlation.orientation.L2L3.extension.anterior": (0.19, 0.22),
    "two_factor_correlation.orientation.L2L3.extension.extension": (-0.18, -0.12),
    "two_factor_correlation.orientation.L3L4.extension.anterior": (-0.49, -0.47),
    "two_factor_correlation.orientation.L3L4.extension.superior": (0.47, 0.48),
    "two_factor_correlation.orientation.L3L4.extension.extension": (-0.16, -0.12),
    "two_factor_correlation.stiffness.L2L3.anterior.anterior": (-0.99, -0.95),
    "two_factor_correlation.stiffness.L2L3.extension.anterior": (-0.98, -0.67),
    "two_factor_correlation.stiffness.L2L3.extension.extension": (0.67, 1.00),
    "two_factor_correlation.stiffness.L3L4.extension.extension": (0.85, 1.00),
    "two_factor_correlation.p_below_of_caption": 0.5,
    "two_factor_correlation.anterior_stiffness_fewer_models_than": 38,
    "two_factor_correlation.extension_stiffness_fewer_models_than": 60,
    "two_factor_correlation.extension_orientation_stiffness_sets": 2,
}

# Rows of Table 4: errors as (L2 median, IQR, range), (L3 median, IQR, range), then the stiffness.
TABLE_4_ROWS = {
    "anterior_mm": ((0.075, 0.22, 0.31), (0.14, 0.18, 0.29), (12_200, 8_960, 13_700)),
    "superior_mm": ((0.016, 0.026, 0.052), (0.11, 0.055, 0.13), (454_000, 72_000, 397_000)),
    "extension_deg": ((0.15, 0.062, 0.20), (0.095, 0.11, 0.20), (14.5, 2.16, 4.90)),
}

# Table 5: rows error, columns stiffness.
TABLE_5 = {
    "error_stiffness_correlation.anterior.anterior": 0.33,
    "error_stiffness_correlation.anterior.superior": -0.39,
    "error_stiffness_correlation.superior.anterior": -0.58,
    "error_stiffness_correlation.superior.superior": 0.29,
    "error_stiffness_correlation.extension.anterior": -0.45,
    "error_stiffness_correlation.extension.extension": -0.42,
}

# Rows of Tables 7 and 8: three medians, three IQRs, in the papers' columns.
TABLE_7_ROWS = {
    ("complete", "L1L2"): (2.40, 95.82, 11.48, 0.88, 0.92, 0.97),
    ("complete", "L2L3"): (4.88, 56.61, 7.80, 1.00, 0.90, 1.04),
    ("complete", "L3L4"): (3.93, 20.61, 4.16, 1.01, 0.93, 0.92),
    ("reduced", "L1L2"): (2.31, 95.78, 11.47, 0.95, 0.95, 1.00),
    ("reduced", "L2L3"): (4.87, 56.52, 8.03, 0.85, 0.81, 1.23),
    ("reduced", "L3L4"): (3.86, 20.64, 4.12, 1.04, 0.87, 0.96),
}
TABLE_8_ROWS = {
    ("complete", "L1L2"): (1.51, 3.28, 6.90, 3.00, 2.84, 8.44),
    ("complete", "L2L3"): (5.13, 6.10, 2.63, 2.90, 2.96, 3.60),
    ("complete", "L3L4"): (6.51, 8.60, -7.04, 3.00, 2.98, 7.24),
    ("reduced", "L1L2"): (1.66, 3.14, 6.97, 2.76, 2.84, 2.84),
    ("reduced", "L2L3"): (5.44, 5.99, 2.27, 3.47, 2.73, 2.73),
    ("reduced", "L3L4"): (6.71, 8.54, -6.21, 3.54, 2.95, 2.95),
}


def table_4() -> dict[str, Any]:
    """Table 4 turned from printed rows into keys."""
    expected = {}
    for (name, (*errors, stiffness)), spring in zip(
        TABLE_4_ROWS.items(), FITTED_STIFFNESS, strict=True
    ):
        for joint, numbers in zip(("L2L3", "L3L4"), errors, strict=True):
            for statistic, value in zip(("median", "iqr", "range"), numbers, strict=True):
                expected[f"ten_best_error.{joint}.{statistic}.{name}"] = value
        for statistic, value in zip(("median", "iqr", "range"), stiffness, strict=True):
            expected[f"ten_best_stiffness.{statistic}.{spring}"] = value
    return expected


def bootstrap_tables() -> dict[str, Any]:
    """Tables 2 and 3 turned from printed rows into keys."""
    expected = {}
    for (what, loading), directions in BOOTSTRAP_ROWS.items():
        prefix = f"{what}_bootstrap_error.{loading}"
        for name, direction, numbers in zip(SAGITTAL, FITTED_COORDINATES, directions, strict=True):
            expected[f"{prefix}.L2L3.median.{name}"] = numbers[0]
            expected[f"{prefix}.L2L3.range.{name}"] = numbers[1]
            expected[f"{prefix}.L3L4.median.{name}"] = numbers[2]
            expected[f"{prefix}.L3L4.range.{name}"] = numbers[3]
            expected[f"{prefix}.largest_percent.{direction}"] = numbers[4]
    return expected


def pose_table(name: str, columns: tuple[str, ...], rows: Mapping[Any, Any]) -> dict[str, Any]:
    """Table 7 or 8 turned from printed rows into keys."""
    expected = {}
    for (models, joint), numbers in rows.items():
        expected |= row(f"{name}.{models}.{joint}.median", columns, numbers[:3])
        expected |= row(f"{name}.{models}.{joint}.iqr", columns, numbers[3:])
    return expected


def test_gould_2024a_is_entered_twice() -> None:
    expected = SECTIONS_2024A | TABLE_1 | SECTION_3 | SECTION_4
    expected |= bootstrap_tables() | table_4() | TABLE_5 | TABLE_6
    expected |= pose_table("joint_origin", MM, TABLE_7_ROWS)
    expected |= pose_table("joint_orientation", DEG, TABLE_8_ROWS)
    assert dict(leaves(published("gould_2024a"))) == expected


@sweep(
    "name, doi",
    [("gould_2024a", "10.3389/fbioe.2024.1304334"), ("gould_2024b", "10.3389/fbioe.2024.1372088")],
)
def test_every_table_names_its_source(name: str, doi: str) -> None:
    paper = published(name)
    assert paper["doi"] == doi
    assert all("where" in table for table in paper.values() if isinstance(table, Mapping))


def test_values_cannot_be_changed() -> None:
    with pytest.raises(TypeError):
        published("gould_2024a")["damping"]["rotation_nm_s_per_rad"] = 2.3  # type: ignore[index]


def test_unknown_paper_says_what_is_there() -> None:
    with pytest.raises(ValueError, match="gould_2024a, gould_2024b"):
        published("gould_2024c")
    assert PAPERS == ("gould_2024a", "gould_2024b")
