"""Selectors for Gould et al. 2024: what its tests say that stiffness and error depend on.

Rank correlations, tests of normality and of differences, the two-factor tests of Table 6, and the
shares of pose and stiffness in regression trees and variance. The rest is in `gould_2024a`.
"""

from itertools import product
from typing import Any

import pandas as pd

from papers.ranges import spearman_interval, spearman_threshold
from papers.run import Computed, NotComputed, StudyRun
from papers.selectors import named, tested

MEASURED_JOINTS = ("L2L3", "L3L4")
FITTED = ("anterior", "superior", "extension")
"""Directions whose stiffness is fitted and whose error is reported."""

P_BELOW = 0.05
THRESHOLD = spearman_threshold(P_BELOW, 123)
"""Of the 123 poses of the reduced dataset."""


def rho(run: StudyRun, family: str, response: str, factor: str) -> Computed:
    """A rank correlation, with its own interval."""
    where = {"family": family, "response": response, "factor": factor}
    row = tested(run, "spearman", **where).iloc[0]
    found, n = float(row["effect"]), int(row["n"])
    spread = spearman_interval(found, n) if abs(found) < 1.0 else None
    low, high = (None, None) if spread is None else (spread.low, spread.high)
    return Computed(found, low, high, f"ours: n = {n}, p = {row['p']:.2g} uncorrected")


def depends_on_motion(run: StudyRun, joint: str, coordinate: str) -> Computed:
    """Whether an error correlates with the measured motion, which each frame sees otherwise."""
    where = {"joint": joint, "response": f"{coordinate}_error"}
    row = tested(run, "spearman", family="error against motion", **where).iloc[0]
    found = float(row["effect"])
    note = f"ours: rho {found:.2f}, n = {int(row['n'])}, p = {row['p']:.2g} uncorrected"
    return Computed(float(abs(found) > THRESHOLD), note=note)


def significant_pairs(run: StudyRun, family: str, of: str) -> Computed:
    """Pairs of stiffness or error and joint pose beyond the paper's threshold."""
    rows = tested(run, "spearman", family=family)
    rows = rows[rows["response"].isin([f"{name}_{of}" for name in FITTED])]
    if rows.empty:
        raise NotComputed("no such pair was tested")
    corrected = int((rows["p_bonferroni"] < P_BELOW).sum())
    note = f"ours: of {len(rows)} tested; {corrected} significant after Bonferroni"
    beyond = float((rows["effect"].abs() > THRESHOLD).sum())
    return Computed(beyond, note=f"{note} with n = {int(rows['n'].max())}")


def not_normal(run: StudyRun, responses: Any) -> Computed:
    """Distributions that are not normal (chi-squared)."""
    rows = tested(run, "chi", family="normality")
    rows = rows[rows["response"].isin(responses)]
    if rows.empty:
        raise NotComputed("no such distribution was tested")
    rejected = int((rows["p"] < P_BELOW).sum())
    return Computed(float(rejected), note=f"ours: {rejected} of {len(rows)} tested, uncorrected")


def _two_factor(run: StudyRun, kind: str, factor: str, joint: str, error: str) -> pd.DataFrame:
    """Tests of one cell of Table 6 that have a result."""
    test, against = {"orientation": ("kendall", "pose"), "stiffness": ("spearman", "stiffness")}[
        kind
    ]
    family = f"two-factor: {error}_error at {joint} against {against}"
    return tested(run, test, family=family, factor=f"{factor}_{kind}")


def any_significant(run: StudyRun, kind: str, factor: str, joint: str, error: str) -> Computed:
    """Whether any test of a cell is significant after Bonferroni."""
    rows = _two_factor(run, kind, factor, joint, error)
    count = int((rows["p_bonferroni"] < P_BELOW).sum())
    note = f"ours: {count} of {len(rows)} tests, family of {int(rows['family_size'].max())}"
    return Computed(float(count > 0), note=note)


def coefficient(run: StudyRun, kind: str, factor: str, joint: str, error: str) -> Computed:
    """Median coefficient of the significant tests of a cell."""
    rows = _two_factor(run, kind, factor, joint, error)
    found = rows.loc[rows["p_bonferroni"] < P_BELOW, "effect"]
    if found.empty:
        told = f"none of {len(rows)} tests is significant after Bonferroni"
        ends = f"{rows['effect'].min():.2f} to {rows['effect'].max():.2f}"
        raise NotComputed(f"{told}; their coefficients run from {ends}")
    note = f"ours: {int((found > 0.0).sum())} of {len(found)} significant ones are positive"
    return Computed(float(found.median()), float(found.min()), float(found.max()), note)


def number_significant(run: StudyRun, joint: str) -> Computed:
    """Stiffness sets in which the anterior error goes with the extension of the frames."""
    rows = _two_factor(run, "orientation", "extension", joint, "anterior")
    return Computed(float((rows["p_bonferroni"] < P_BELOW).sum()), note=f"ours: of {len(rows)}")


def largest_share(run: StudyRun, factor: str) -> Computed:
    """Poses in which a stiffness correlates with an error, the largest of six cells, percent."""
    cells = []
    for joint, error in product(MEASURED_JOINTS, FITTED):
        rows = _two_factor(run, "stiffness", factor, joint, error)
        cells.append(100.0 * float((rows["p_bonferroni"] < P_BELOW).mean()))
    return Computed(max(cells), min(cells), max(cells), "ours: smallest to largest of six cells")


def friedman(run: StudyRun, factor: str) -> Computed:
    """Largest p of tests of errors between levels of a factor."""
    rows = tested(run, "friedman", family="friedman", factor=factor)
    corrected = float(rows["p_bonferroni"].max())
    note = f"ours: {len(rows)} tests; after Bonferroni at most {corrected:.2g}"
    return Computed(float(rows["p"].max()), note=note)


def pose_in_tree(run: StudyRun, joint: str, coordinate: str) -> Computed:
    """Share of the joint pose in the regression tree of an error."""
    rows = run.rows("importance", joint=joint, coordinate=coordinate)
    known = rows.dropna(subset=["importance"])
    total = float(known["importance"].sum())
    if total <= 0.0:
        raise NotComputed(str(rows.iloc[0]["message"]) or "the pruned tree has no split")
    pose = float(known.loc[known["factor"] == "pose", "importance"].sum())
    first = known.iloc[0]
    return Computed(pose / total, note=f"ours: {int(first['leaves'])} leaves, r2 {first['r2']:.2f}")


def pose_in_variance(run: StudyRun, joint: str, coordinate: str) -> Computed:
    """Variance of an error due to the joint pose, of that due to pose or stiffness alone."""
    pose, stiffness = (
        run.number("variance_shares", "share", factor=one, joint=joint, coordinate=coordinate)
        for one in ("pose", "stiffness")
    )
    if pose + stiffness == 0.0:
        raise NotComputed("neither factor alone explains any variance")
    note = f"ours: pose {pose:.2f}, stiffness {stiffness:.2f}, rest interaction"
    return Computed(pose / (pose + stiffness), note=note)


SELECTORS = named(
    *(rho, depends_on_motion, significant_pairs, not_normal, any_significant, coefficient),
    *(number_significant, largest_share, friedman, pose_in_tree, pose_in_variance),
)
