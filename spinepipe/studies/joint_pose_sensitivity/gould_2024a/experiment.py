"""The load and the start values of the paper, where its numbers do not fit each other."""

from collections.abc import Iterator
from math import radians

from spinepipe.comparison.claim import Claim, Ours
from spinepipe.comparison.paper import MEASURED_JOINTS, PAPER, STIFFNESS_KEY, measured
from spinepipe.comparison.ranges import Range, exactly

_MM_PER_M = 1000.0
FORCE_N = float(PAPER["load"]["largest_compression_n"])
BEST = PAPER["best_model"]["stiffness"]


def claims() -> Iterator[Claim]:
    """Load, moment, lever arm, start values."""
    yield from _moments()
    for name in ("anterior", "right"):
        yield _outside_box("start_stiffness", "section 2.2, Table 1", "A6", name,
                           float(PAPER["start_stiffness"][STIFFNESS_KEY[name]]))  # fmt: skip
    yield _outside_box("best_model", "section 3.3, Table 1", "A7", "anterior",
                       float(BEST["anterior_n_per_m"]))  # fmt: skip


def _moments() -> Iterator[Claim]:
    printed = float(PAPER["load"]["flexion_moment_nm"])
    offset = float(PAPER["bodies"]["top_offset_mm"])
    moment = FORCE_N * offset / _MM_PER_M
    yield _closed(
        "load.moment", "sections 2.1, 2.2", f"moment of the load at {offset:g} mm", "N m", printed,
        moment, f"A1: {FORCE_N:g} N at {offset:g} mm make {moment:.2f} N m, "
        f"printed is about {printed:g} N m",
    )  # fmt: skip
    arm = _MM_PER_M * printed / FORCE_N
    yield _closed(
        "load.lever_arm", "sections 2.1, 2.2", "lever arm of the load", "mm", offset, arm,
        f"A2: {printed:g} N m of {FORCE_N:g} N need {arm:.1f} mm; printed are {offset:g} mm, and "
        f"{PAPER['load']['offset_percent_of_disc_depth']:g} % of a disc's depth",
    )  # fmt: skip
    spring = float(BEST["extension_nm_per_rad"])
    for joint in MEASURED_JOINTS:
        angle = measured(joint, "extension")
        carried = spring * radians(angle)
        yield _closed(
            f"load.spring_moment.{joint}", "sections 2.1, 3.1, 3.3",
            f"moment that the best model's spring carries at {joint}", "N m", printed, carried,
            f"A3: {spring:g} N m/rad turned by {angle:g} deg carry {carried:.2f} N m, "
            f"the load is said to be about {printed:g} N m",
        )  # fmt: skip


def _closed(
    name: str, where: str, quantity: str, unit: str, paper: float, ours: float, reason: str
) -> Claim:
    """Numbers of the paper alone that exclude each other."""
    return Claim(
        name, where, quantity, unit, paper, exactly(paper), lambda run: Ours(ours), "",
        note="ours: recomputed from the paper's other numbers", contradicted=reason,
    )  # fmt: skip


def _outside_box(of: str, where: str, check: str, name: str, value: float) -> Claim:
    box = PAPER["start_stiffness_box"]
    low, high = (float(box[end][STIFFNESS_KEY[name]]) for end in ("low", "high"))
    reason = f"{check}: {value:g} N/m lies outside Table 1, {low:g} to {high:g} N/m"
    return Claim(
        f"{of}.{name}_in_box", where, f"{name} stiffness against the box of start values", "N/m",
        value, Range(low, high, "the box of Table 1"), lambda run: Ours(value), "",
        note="ours: the paper's own number again", contradicted=reason,
    )  # fmt: skip
