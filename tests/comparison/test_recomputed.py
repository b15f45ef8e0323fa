"""What follows from a paper's own numbers, by its formulas as they are written down here."""

from itertools import product
from math import comb, degrees, pi, radians, sqrt, tan

import numpy as np
import pytest
from scipy import stats
from sweeps import sweep

from papers.engine import claims_of, judge
from papers.ranges import binomial, normal_iqr, spearman_interval, spearman_threshold
from papers.run import StudyRun
from spinepipe.anatomy import published
from spinepipe.muscles.disc_pressure import disc_pressure

A, B = published("gould_2024a"), published("gould_2024b")


def row_of(paper: str, name: str) -> dict[str, object]:
    (claim,) = [claim for claim in claims_of(paper) if claim.id == name]
    return judge(claim, StudyRun({}))


COBB = (49, 53, 46, 48, 53, 53, 48, 55, 59, 86, 62, 59)
"""Of the first twelve patients of Jalalian's Table 1; the others' sum to 337 deg."""

RECOMPUTED = {
    "jalalian_2017": {
        "J1.age_mean": 274 / 18,
        "J1.cobb_mean": (sum(COBB) + 337) / 18,
        "J1.cobb_median": 53,
        "J2.bending": 100 - 144 / 2.59,
        "J2.neutral_traction": 100 - 130 / 2.15,
        "J12.opposite_rotating_vertebrae": 100 - 131 / 2.65,
        "improvement.ferguson_angle.fig6_example": 62.5,
        "J4.bending.location_LOC": 0.83 / 0.45,
        "J4.neutral_traction.orientation_theta": 1.25 / 0.61,
        "J5": 5 / 6,
        "J6.load": tan(radians(75)),
        "J6.secant": tan(radians(75)) / radians(75),
        "J7.r_rmse": 1,
        "J7.tau_rmse": 10,
        "J7.A": 10,
        "J10.segments": 14,
        "J10.displacements": 504,
        "J11": 10,
        "B": pi / 2,
        "C": -pi / 2,
        "D": 0,
    },
    "ghezelbash_2016": {
        "G1": 99.9,
        "G2": 100,
        "G3": 75.1 / 1.73**2,
        "G4": 173,
        "G9.compression": 410 / 0.21,
        "G9.shear": 240,
        "G12": -0.01556,
        "G13.p_0.62": (0.01212 * 0.62 - 0.01243) / 0.003338,
        "G13.p_1.86": (0.01212 * 1.86 - 0.01243) / 0.003338,
        "G14": (-0.01556 + 1.255 * 1.86 + 0.03988 * 1.86**2) / (1.86 / 0.77),
        "G15.p_1.24": 1.24 * 1455,
    },
    "wang_2021": {"W6": -1},
    "gould_2024a": {
        "compression": 1000 * A["load"]["largest_compression_n"] / 437000,
        "outlier": A["outlier"]["extension_nm_per_rad"] / 37,
        # A22: p of r = 0.18 in 123 pairs; and what r needs
        "pose_correlation_p": 2 * stats.t.sf(0.18 * sqrt(121 / (1 - 0.18**2)), 121),
        "spearman_threshold": spearman_threshold(0.05, 123),
    },
    "gould_2024b": {
        "fitted_range.left_lateral_bending.nm_per_rad": 107 - 63,
        "fitted_range.left_lateral_bending.percent_of_literature": 100 * 44 / 68.8,
        "fitted_range.left_axial_rotation.percent_of_literature": 100 * (418.7 - 282.7) / 291,
        "mae_drop.per_specimen.flexion": 44 - 17,
        "table_7.flexion.overall.p": stats.chi2.sf(4.3, 1),
        "mean_motion.left_lateral_bending": 20.7 - 16.5,
        # B20: of 2^15 signs two are as extreme, all pairs up and all down; six tests
        "smallest_signed_rank_p": 6 * 2 / sum(comb(15, k) for k in range(16)),
        "counts.cross_validations": 6 * 3 * 2,
        "counts.signed_rank_pairs": 3 * 5,
    },
}

ROUNDED = {"mean_motion.left_lateral_bending": 0.05}
"""How far a value of ours may be off where the number it follows from is rounded."""

EXCLUDED = {
    "jalalian_2017": {
        "improvement.rotation_r.four_positions": 100
        * (1 - sqrt((1.44**2 + 1.30**2) / (2.59**2 + 2.15**2))),
        "improvement.ferguson_angle.four_positions.abstract": 200 / 3,
        "improvement.ferguson_angle.four_positions.section_4": 200 / 3,
        "equations.A_selection.unique": 0,
        "results.enlargements_tested.finite_at_0": 0,
        "equations.tangent": 0,
    },
    "ghezelbash_2016": {
        "results.sensitivity_angular_BH160": 100 * (0.94**2 * 160 / 173 - 1),
        "results.sensitivity_angular_BH190": 100 * (1.09**2 * 190 / 173 - 1),
        "results.sensitivity_axial_BH160": 100 * (sqrt(0.95 * 173 / 160) - 1),
        "results.sensitivity_axial_BH190": 100 * (sqrt(1.08 * 173 / 190) - 1),
        "closed_form.G5": 2,
        "closed_form.G10": 3,
        "closed_form.G11.3.4.least": 1.74,
        "closed_form.G16": 0,
    },
    "gould_2024a": {
        "load.moment": A["load"]["largest_compression_n"] * A["bodies"]["top_offset_mm"] / 1e3,
        "load.lever_arm": 1e3 * A["load"]["flexion_moment_nm"] / A["load"]["largest_compression_n"],
        "load.spring_moment.L3L4": 14.9 * radians(1.8),
    },
    "gould_2024b": {
        "fitted_range.flexion.nm_per_rad": 102.2 - 60.5,
        "fitted_range.flexion.percent_of_literature": 100 * (102.2 - 60.5) / 51,
        "table_7.critical_h": stats.chi2.ppf(0.95, 1),
        "table_5.tests_between_specimens": 3 * 2 * 3,
    },
}
"""What the paper's other numbers give in place of the printed one."""


@sweep("paper, name, ours", [(p, *one) for p, all_ in RECOMPUTED.items() for one in all_.items()])
def test_what_follows_from_the_paper_is_recomputed(paper: str, name: str, ours: float) -> None:
    row = row_of(paper, f"closed_form.{name}")
    assert row["ours"] == pytest.approx(ours, rel=1e-3, abs=ROUNDED.get(name, 1e-12))
    assert row["verdict"] == "recomputed"


@sweep("paper, name, ours", [(p, *one) for p, all_ in EXCLUDED.items() for one in all_.items()])
def test_what_the_paper_excludes_is_contradicted(paper: str, name: str, ours: float) -> None:
    row = row_of(paper, name)
    assert row["ours"] == pytest.approx(ours, rel=1e-3)
    assert row["verdict"] == "contradicted"


@sweep("p, theta", list(product([0, 0.62, 1.24, 1.86], [0, 2, 4, 6, 8, 10])))
def test_fig_4_of_ghezelbash_is_eq_6(p: float, theta: float) -> None:
    """And the product's own pressure is that of the formula."""
    squares = 0.03988 * p * p - 0.01212 * p * theta + 0.001669 * theta * theta
    row = row_of("ghezelbash_2016", f"idp.p_{p:g}.theta_{theta:g}")
    assert row["ours"] == pytest.approx(-0.01556 + 1.255 * p + 0.01243 * theta + squares, abs=1e-9)
    assert row["verdict"] == "recomputed"
    product_pa = disc_pressure(p * 1e6 * 1455e-6, 1455e-6, np.deg2rad(theta)).pa
    assert product_pa / 1e6 == pytest.approx(row["ours"], rel=1e-12)


def test_passive_elements_of_wang_at_a_load() -> None:
    """A (exp(B q) - 1) with 1.5 N m, 40 / rad and 0.03 rad; k = B (F + A)."""
    load = 1.5 * (np.exp(1.2) - 1.0)
    assert row_of("wang_2021", "equations.passive")["ours"] == pytest.approx(load)
    stiffness = row_of("wang_2021", "equations.tangent_stiffness")["ours"]
    assert stiffness == pytest.approx(40.0 * (load + 1.5))


@sweep(
    "name, stiffness",
    [
        ("uniform.left_lateral_bending", [68.8]),
        ("levels.left_lateral_bending", [43.6, 19.9, 12.4, 13.8, 68.8]),
        ("levels.left_lateral_bending.L3L4", [12.4]),
    ],
)
def test_published_rotation_is_moment_over_stiffness(name: str, stiffness: list[float]) -> None:
    """Of Table 2 of Gould 2024b, mean over levels (B2, B3); the window lies about it."""
    row = row_of("gould_2024b", f"closed_form.literature_rotation.{name}")
    middle = np.mean([row["paper_low"], row["paper_high"]])
    assert middle == pytest.approx(np.mean([degrees(7.5 / k) for k in stiffness]))


@sweep("test", ["left_lateral_bending", "left_axial_rotation", "flexion"])
def test_ends_of_other_specimens_follow_from_table_3(test: str) -> None:
    """The median is between the ends but in 2 of 2^n cases; ends are those of six log-normal."""
    for name, printed in B["fitted_stiffness_nm_per_rad"][test].items():
        values = np.array(list(printed.values()))
        rows = [
            row_of("gould_2024b", f"table_3.{test}.{name}.{what}")
            for what in ("smallest", "median", "largest", "range")
        ]
        law = stats.norm(np.log(values).mean(), np.log(values).std(ddof=1))
        ends = [
            [np.exp(law.isf((1.0 - p) ** (1 / 6))) for p in (0.025, 0.975)],
            [values.min(), values.max()],
            [np.exp(law.ppf(p ** (1 / 6))) for p in (0.025, 0.975)],
        ]
        found = [[row["paper_low"], row["paper_high"]] for row in rows[:3]]
        assert np.array(found, float) == pytest.approx(np.array(ends))
        assert f"{100.0 * (1 - 2 / 2 ** len(values)):.3g} %" in str(rows[1]["reason"])
        assert rows[3]["paper"] == pytest.approx(np.ptp(values))


# --- ranges of statistics -------------------------------------------------------------------------


@sweep("count, of", [(124, 500), (388, 504), (0, 6), (6, 6)])
def test_wilson_interval_by_its_formula(count: int, of: int) -> None:
    p, z = count / of, 1.959964
    reach = z * sqrt(p * (1 - p) / of + z**2 / (4 * of**2))
    ends = [100 * (p + z**2 / (2 * of) + sign * reach) / (1 + z**2 / of) for sign in (-1, 1)]
    found = binomial(count, of)
    assert [found.low, found.high] == pytest.approx(ends, rel=1e-6, abs=1e-9)
    assert found.holds(100 * p)


@sweep("rho, n", [(0.33, 123), (0.9, 18 * 5 * 14)])
def test_interval_of_a_rank_correlation_by_its_formula(rho: float, n: int) -> None:
    reach = 1.959964 * sqrt((1 + rho**2 / 2) / (n - 3))
    found = spearman_interval(rho, n)
    ends = np.tanh(np.arctanh(rho) + reach * np.array([-1, 1]))
    assert [found.low, found.high] == pytest.approx(ends.tolist(), rel=1e-5)


def test_a_coefficient_that_cannot_be_significant_is_told_with_its_p() -> None:
    """A24, A25: rho = 0.67 of 10 values, tau = 0.12 of 123."""
    notes = {claim.id: claim.note for claim in claims_of("gould_2024a")}
    rho = 2 * stats.t.sf(0.67 * sqrt(8 / (1 - 0.67**2)), 8)
    tau = 2 * stats.norm.sf(0.12 * sqrt(9 * 123 * 122 / (2 * 251)))
    cell = "table_6.extension_{}.L2L3.{}_error.coefficient"
    assert f"p = {rho:.2g}" in notes[cell.format("stiffness", "anterior")]
    assert f"p = {tau:.2g}" in notes[cell.format("orientation", "extension")]


def test_other_samples_keep_to_the_interval_of_an_iqr() -> None:
    """Of 4000 pairs of samples 95 % do: standard error 0.35 %, and the theory is asymptotic."""
    samples = np.random.default_rng(1).normal(size=(4000, 2, 123))
    low, high = np.percentile(samples, [25, 75], axis=-1)
    pairs = (high - low).tolist()
    kept = [normal_iqr(first, 123).holds(second) for first, second in pairs]
    assert np.mean(kept) == pytest.approx(0.95, abs=0.02)
