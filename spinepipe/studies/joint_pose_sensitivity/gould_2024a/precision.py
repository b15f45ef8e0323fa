"""How precise landmarks must be for errors below 1 mm and 1 deg: abstract and section 4."""

from collections.abc import Callable, Iterator
from math import sqrt

import pandas as pd

from spinepipe.comparison.claim import Claim, Ours
from spinepipe.comparison.paper import PAPER
from spinepipe.comparison.ranges import IQR_PER_SD, Range, exactly
from spinepipe.comparison.run import NotComputed, Run
from spinepipe.units import TRANSLATIONS

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


def claims() -> Iterator[Claim]:
    """Required precision, shares of good poses, and what 2.9 mm can mean."""
    at_least = Range(
        PER_AXIS_MM, None,
        f"the paper holds {RESULTANT_MM:g} mm to be enough, {PER_AXIS_MM:.2f} mm per axis if that "
        "is a resultant: as large or larger",
    )  # fmt: skip
    yield Claim(
        "target.required_sd", _WHERE,
        "largest landmark SD per axis for errors below the limits, each pose with own stiffness",
        "mm", PER_AXIS_MM, at_least, _required, _TARGET,
    )  # fmt: skip
    for motion in ("translation", "rotation"):
        unit = {"translation": "mm", "rotation": "deg"}[motion]
        limit = float(PAPER["target_error"][f"{motion}_{unit}"])
        yield Claim(
            f"target.share_below.{motion}", _WHERE,
            f"poses with {motion} errors below {limit:g} {unit}, landmark SD nearest to "
            f"{PER_AXIS_MM:.2f} mm", "%", 100.0,
            Range(95.0, 100.0, "the paper says all poses; 95 % is allowed here"),
            _share(motion, limit), _TARGET,
        )  # fmt: skip
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
        "landmarks.largest_resultant_sd", "section 2.4.2, Table 7",
        "largest SD per axis of an endplate centre that Table 7 implies", "mm", PER_AXIS_MM,
        exactly(PER_AXIS_MM), lambda run: Ours(max(cells), min(cells), max(cells)), "",
        note="ours: from the paper's Table 7",
        contradicted=f"A20: {RESULTANT_MM:g} mm resultant would give origins an IQR of "
        f"{iqr:.2f} mm; Table 7 implies {min(cells):.2f} to {max(cells):.2f} mm per axis",
    )  # fmt: skip
