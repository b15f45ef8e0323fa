"""What follows from the paper's numbers by a formula."""

from collections.abc import Callable, Iterator
from math import sqrt

from spinepipe.comparison.best_model import carried_force
from spinepipe.comparison.claim import Claim, Ours, Verdict
from spinepipe.comparison.experiment import BEST, FORCE_N
from spinepipe.comparison.paper import (
    FITTED,
    JOINTS,
    MEASURED_JOINTS,
    P_BELOW,
    PAPER,
    REDUCED,
    measured,
)
from spinepipe.comparison.ranges import IQR_PER_SD, Range, spearman_p, spearman_threshold
from spinepipe.comparison.run import NotComputed, Run
from spinepipe.units import TRANSLATIONS

_MM_PER_M = 1000.0
_POINTS = 2.0
_GRAVITY_M_PER_S2 = 9.81
_STEEP = 0.95
"""Cosine of the tilt of a joint, about 18 degrees, that the check of the engine allows."""
_FORMULA = "the formula does not give the printed number"


def claims() -> Iterator[Claim]:
    """Compression, thresholds, ratios, spread of origins."""
    yield _compression()
    yield _carried()
    yield from _significance()
    yield from _ratios()
    yield _origin_spread()


def _fixed(name: str, where: str, quantity: str, unit: str, paper: float | None, allowed: Range,
           ours: float, note: str) -> Claim:  # fmt: skip
    """A number that the paper's own numbers give."""
    return Claim(f"closed_form.{name}", where, quantity, unit, paper, allowed,
                 lambda run: Ours(ours), _FORMULA, note,
                 evidence=Verdict.RECOMPUTED)  # fmt: skip


def _compression() -> Claim:
    stiffness = float(BEST["superior_n_per_m"])
    errors = (float(PAPER["best_model"]["superior_error_of_L2L3"]["error_mm"]),
              float(PAPER["best_model"]["largest_error"]["superior_mm"]))  # fmt: skip
    left = [measured(joint, "superior") - error
            for joint, error in zip(MEASURED_JOINTS, errors, strict=True)]  # fmt: skip
    return _fixed(
        "compression", "sections 3.1, 3.3", f"compression of a joint by {FORCE_N:g} N", "mm", None,
        Range(min(left), max(left), "printed motion of L2L3 and L3L4 less the best model's errors"),
        _MM_PER_M * FORCE_N / stiffness,
        f"ours: {FORCE_N:g} N / {stiffness:g} N/m, without weights and tilt (A4)",
    )  # fmt: skip


def _carried() -> Claim:
    """The engine's own joint force under all that stands on the top joint."""
    mass = float(PAPER["bodies"]["top_mass_kg"])
    force = FORCE_N + _GRAVITY_M_PER_S2 * mass
    what = f"{FORCE_N:g} N and the weight of {mass:g} kg; up to 5 % less where the joint is tilted"
    return Claim(
        "closed_form.compressive_force", "sections 2.1, 2.2",
        "superior stiffness times predicted superior motion of L1L2 in the best model", "N",
        force, Range(_STEEP * force, force, what), carried_force("L1L2"),
        "the formula leaves out tilt beyond 18 degrees, and a cohort without weight or zeroed",
    )  # fmt: skip


def _significance() -> Iterator[Claim]:
    printed = PAPER["error_stiffness_correlation"]
    smallest = min(abs(float(rho)) for error in FITTED for rho in printed[error].values())
    yield _fixed(
        "spearman_threshold", "Table 5", f"smallest significant rho of {REDUCED} pairs", "rho",
        None, Range(0.0, smallest, "up to the smallest coefficient printed as significant"),
        spearman_threshold(P_BELOW, REDUCED), "A23",
    )  # fmt: skip
    r, p = (float(PAPER["pose_correlation"][name]) for name in ("r", "p"))
    ends = spearman_p(r + 0.005, REDUCED), spearman_p(r - 0.005, REDUCED)
    yield _fixed(
        "pose_correlation_p", "section 3.3", f"p of r = {r:g} of {REDUCED} pairs", "p", p,
        Range(*ends, "p of the coefficients that round to the printed one"), spearman_p(r, REDUCED),
        "A22",
    )  # fmt: skip


def _ratios() -> Iterator[Claim]:
    stiffness = PAPER["ten_best_stiffness"]
    middle = float(stiffness["median"]["anterior_n_per_m"])
    for kind, check in (("iqr", "A8"), ("range", "A9")):
        paper = float(PAPER["ten_best_anterior_stiffness_percent_of_median"][kind])
        ours = 100.0 * float(stiffness[kind]["anterior_n_per_m"]) / middle
        yield _fixed(
            f"ten_best_anterior_{kind}_percent", "section 3.3, Table 4",
            f"{kind} of anterior stiffness of the ten best", "% of median", paper,
            Range(paper - _POINTS, paper + _POINTS, "two points either way, chosen here"),
            ours, check,
        )  # fmt: skip
    times = float(PAPER["success_rule"]["outlier_times_start"])
    outlier = float(PAPER["outlier"]["extension_nm_per_rad"])
    start = float(PAPER["start_stiffness"]["extension_nm_per_rad"])
    yield _fixed(
        "outlier", "section 3.2", "extension stiffness of the outlier in that of the start",
        "ratio", times, Range(times, None, "an order of magnitude or more"), outlier / start, "A33",
    )  # fmt: skip


def _origin_spread() -> Claim:
    """IQR of the midpoint of two points."""
    cells = [
        float(PAPER["joint_origin"]["complete"][joint]["iqr"][f"{name}_mm"])
        for joint in JOINTS
        for name in TRANSLATIONS
    ]
    return Claim(
        "closed_form.origin_iqr", "Table 7", "IQR of a joint origin midway between two landmarks",
        "mm", sum(cells) / len(cells), Range(min(cells), max(cells), "IQRs of Table 7, complete"),
        _midpoint_iqr(), "the landmark SD of this study is not the one that Table 7 implies (A20)",
    )  # fmt: skip


def _midpoint_iqr() -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        landmarks = run.rows("landmarks")
        centres = landmarks[landmarks["landmark"].str.contains("endplate")]["sd_mm"].unique()
        if len(centres) != 1:
            raise NotComputed("endplate centres have different SDs in this run, or none")
        sd = float(centres[0])
        return Ours(IQR_PER_SD * sd / sqrt(2.0), note=f"ours: {IQR_PER_SD:.3f} x {sd:g} / sqrt 2")

    return ours
