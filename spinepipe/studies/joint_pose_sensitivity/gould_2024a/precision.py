"""How precise landmarks must be (abstract, section 4), and what the paper's numbers imply."""

from collections.abc import Callable, Iterator
from math import sqrt

import pandas as pd

from spinepipe.comparison.claim import (
    IQR_PER_SD,
    Claim,
    NotComputed,
    Ours,
    Range,
    Run,
    Verdict,
    exactly,
    spearman_p,
    spearman_threshold,
)
from spinepipe.studies.joint_pose_sensitivity.gould_2024a.best_models import carried_force
from spinepipe.studies.joint_pose_sensitivity.gould_2024a.counts import BEST_STIFFNESS, FORCE_N
from spinepipe.studies.joint_pose_sensitivity.gould_2024a.paper import (
    FITTED,
    JOINTS,
    MEASURED_JOINTS,
    P_BELOW,
    PAPER,
    REDUCED,
    measured,
)
from spinepipe.units import MM_PER_M, TRANSLATIONS

RESULTANT_MM = float(PAPER["landmarks"]["largest_resultant_sd_mm"])

PER_AXIS_MM = RESULTANT_MM / sqrt(3.0)
"""SD per axis if 2.9 mm is that of the resultant of three equal axes."""

_ENDS = ("sd_low_mm", "sd_high_mm")

_ENOUGH = "will do"
"""What the message of a run says where even the largest sampled SD keeps the limits."""

_WHERE = "abstract, section 4"
_TARGET = (
    "the paper looked at one precision only and left failed fits out; here every pose counts, "
    "without result as above the limit"
)

_POINTS = 2.0
_GRAVITY_M_PER_S2 = 9.81
_STEEP = 0.95
"""Cosine of the tilt of a joint, about 18 degrees, that the check of the engine allows."""

_FORMULA = "the formula does not give the printed number"


def claims_of_precision() -> Iterator[Claim]:
    """Required precision, shares of good poses, and what 2.9 mm can mean."""
    at_least = Range(
        PER_AXIS_MM,
        None,
        f"the paper holds {RESULTANT_MM:g} mm to be enough, {PER_AXIS_MM:.2f} mm per axis if that "
        "is a resultant: as large or larger",
    )
    yield Claim(
        "target.required_sd",
        _WHERE,
        "largest landmark SD per axis for errors below the limits, each pose with own stiffness",
        "mm",
        PER_AXIS_MM,
        at_least,
        _required,
        _TARGET,
    )
    for motion in ("translation", "rotation"):
        unit = {"translation": "mm", "rotation": "deg"}[motion]
        limit = float(PAPER["target_error"][f"{motion}_{unit}"])
        yield Claim(
            f"target.share_below.{motion}",
            _WHERE,
            f"poses with {motion} errors below {limit:g} {unit}, landmark SD nearest to "
            f"{PER_AXIS_MM:.2f} mm",
            "%",
            100.0,
            Range(95.0, None, "the paper says all poses; 95 % is allowed here"),
            _share(motion, limit),
            _TARGET,
        )
    yield _meaning()


def _required(run: Run) -> Ours:
    row = run.row("required_precision", stiffness="calibrated", motion="both")
    if pd.isna(row["sd_mm"]):
        return _beyond_the_sampled(run, str(row["message"]))
    low, high = (None if pd.isna(row[key]) else float(row[key]) for key in _ENDS)
    return Ours(float(row["sd_mm"]), low, high, f"ours: for {100.0 * row['share']:g} % of poses")


def _beyond_the_sampled(run: Run, message: str) -> Ours:
    """The largest sampled SD where even that will do, the smallest where that already will not."""
    sampled = run.rows("landmark_precision", stiffness="calibrated")["sd_mm"]
    if _ENOUGH in message:
        return Ours(float(sampled.max()), note=f"ours is a lower end: {message}")
    if sampled.min() >= PER_AXIS_MM:
        raise NotComputed(message)
    return Ours(float(sampled.min()), note=f"ours is an upper end: {message}")


def _share(motion: str, limit: float) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        rows = run.rows("landmark_precision", stiffness="calibrated", motion=motion)
        row = rows.iloc[int((rows["sd_mm"] - PER_AXIS_MM).abs().to_numpy().argmin())]
        if row["limit"] != limit:
            raise NotComputed(f"this study's limit is {row['limit']:g}")
        share, low, high = (100.0 * float(row[n]) for n in ("below", "below_low", "below_high"))
        return Ours(share, low, high, f"ours: SD {row['sd_mm']:g} mm, {int(row['n'])} poses")

    return ours


def _meaning() -> Claim:
    """Which SD the spread of joint origins implies: an origin is midway between two landmarks."""
    cells = [
        float(PAPER["joint_origin"]["complete"][joint]["iqr"][f"{name}_mm"])
        * sqrt(2.0)
        / IQR_PER_SD
        for joint in ("L1L2", "L2L3", "L3L4")
        for name in TRANSLATIONS
    ]
    iqr = IQR_PER_SD * PER_AXIS_MM / sqrt(2.0)
    return Claim(
        "landmarks.largest_resultant_sd",
        "section 2.4.2, Table 7",
        "largest SD per axis of an endplate centre that Table 7 implies",
        "mm",
        PER_AXIS_MM,
        exactly(PER_AXIS_MM),
        lambda run: Ours(max(cells), min(cells), max(cells)),
        "",
        note="ours: from the paper's Table 7",
        contradicted=f"A20: {RESULTANT_MM:g} mm resultant would give origins an IQR of "
        f"{iqr:.2f} mm; Table 7 implies {min(cells):.2f} to {max(cells):.2f} mm per axis",
    )


def claims_of_closed_forms() -> Iterator[Claim]:
    """Compression, thresholds, ratios, spread of origins."""
    yield _compression()
    yield _carried()
    yield from _significance()
    yield from _ratios()
    yield _origin_spread()


def _compression() -> Claim:
    stiffness = float(BEST_STIFFNESS["superior_n_per_m"])
    errors = (
        float(PAPER["best_model"]["superior_error_of_L2L3"]["error_mm"]),
        float(PAPER["best_model"]["largest_error"]["superior_mm"]),
    )
    left = [
        measured(joint, "superior") - error
        for joint, error in zip(MEASURED_JOINTS, errors, strict=True)
    ]
    return _fixed(
        "compression",
        "sections 3.1, 3.3",
        f"compression of a joint by {FORCE_N:g} N",
        "mm",
        None,
        Range(min(left), max(left), "printed motion of L2L3 and L3L4 less the best model's errors"),
        MM_PER_M * FORCE_N / stiffness,
        f"ours: {FORCE_N:g} N / {stiffness:g} N/m, without weights and tilt (A4)",
    )


def _carried() -> Claim:
    """The engine's own joint force under all that stands on the top joint."""
    mass = float(PAPER["bodies"]["top_mass_kg"])
    force = FORCE_N + _GRAVITY_M_PER_S2 * mass
    what = f"{FORCE_N:g} N and the weight of {mass:g} kg; up to 5 % less where the joint is tilted"
    return Claim(
        "closed_form.compressive_force",
        "sections 2.1, 2.2",
        "superior stiffness times predicted superior motion of L1L2 in the best model",
        "N",
        force,
        Range(_STEEP * force, force, what),
        carried_force("L1L2"),
        "the formula leaves out tilt beyond 18 degrees, and a cohort without weight or zeroed",
    )


def _significance() -> Iterator[Claim]:
    printed = PAPER["error_stiffness_correlation"]
    smallest = min(abs(float(rho)) for error in FITTED for rho in printed[error].values())
    yield _fixed(
        "spearman_threshold",
        "Table 5",
        f"smallest significant rho of {REDUCED} pairs",
        "rho",
        None,
        Range(None, smallest, "up to the smallest coefficient printed as significant"),
        spearman_threshold(P_BELOW, REDUCED),
        "A23",
    )
    r, p = (float(PAPER["pose_correlation"][name]) for name in ("r", "p"))
    ends = spearman_p(r + 0.005, REDUCED), spearman_p(r - 0.005, REDUCED)
    yield _fixed(
        "pose_correlation_p",
        "section 3.3",
        f"p of r = {r:g} of {REDUCED} pairs",
        "p",
        p,
        Range(*ends, "p of the coefficients that round to the printed one"),
        spearman_p(r, REDUCED),
        "A22",
    )


def _ratios() -> Iterator[Claim]:
    stiffness = PAPER["ten_best_stiffness"]
    middle = float(stiffness["median"]["anterior_n_per_m"])
    for kind, check in (("iqr", "A8"), ("range", "A9")):
        paper = float(PAPER["ten_best_anterior_stiffness_percent_of_median"][kind])
        ours = 100.0 * float(stiffness[kind]["anterior_n_per_m"]) / middle
        yield _fixed(
            f"ten_best_anterior_{kind}_percent",
            "section 3.3, Table 4",
            f"{kind} of anterior stiffness of the ten best",
            "% of median",
            paper,
            Range(paper - _POINTS, paper + _POINTS, "two points either way, chosen here", True),
            ours,
            check,
        )
    times = float(PAPER["success_rule"]["outlier_times_start"])
    outlier = float(PAPER["outlier"]["extension_nm_per_rad"])
    start = float(PAPER["start_stiffness"]["extension_nm_per_rad"])
    yield _fixed(
        "outlier",
        "section 3.2",
        "extension stiffness of the outlier in that of the start",
        "ratio",
        times,
        Range(times, None, "an order of magnitude or more"),
        outlier / start,
        "A33",
    )


def _fixed(
    name: str,
    where: str,
    quantity: str,
    unit: str,
    paper: float | None,
    allowed: Range,
    ours: float,
    note: str,
) -> Claim:
    """A number that the paper's own numbers give."""
    return Claim(
        f"closed_form.{name}",
        where,
        quantity,
        unit,
        paper,
        allowed,
        lambda run: Ours(ours),
        _FORMULA,
        note,
        evidence=Verdict.RECOMPUTED,
    )


def _origin_spread() -> Claim:
    """IQR of the midpoint of two points."""
    cells = [
        float(PAPER["joint_origin"]["complete"][joint]["iqr"][f"{name}_mm"])
        for joint in JOINTS
        for name in TRANSLATIONS
    ]
    return Claim(
        "closed_form.origin_iqr",
        "Table 7",
        "IQR of a joint origin midway between two landmarks",
        "mm",
        sum(cells) / len(cells),
        Range(min(cells), max(cells), "IQRs of Table 7, complete"),
        _midpoint_iqr(),
        "the landmark SD of this study is not the one that Table 7 implies (A20)",
    )


def _midpoint_iqr() -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        landmarks = run.rows("landmarks")
        centres = landmarks[landmarks["landmark"].str.contains("endplate")]["sd_mm"].unique()
        if len(centres) != 1:
            raise NotComputed("endplate centres have different SDs in this run, or none")
        sd = float(centres[0])
        return Ours(IQR_PER_SD * sd / sqrt(2.0), note=f"ours: {IQR_PER_SD:.3f} x {sd:g} / sqrt 2")

    return ours
