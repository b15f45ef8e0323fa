"""Stiffness and errors over all sampled poses, section 3.3."""

from collections.abc import Iterator
from functools import partial

from spinepipe.comparison import summary
from spinepipe.comparison.claim import Claim, Ours
from spinepipe.comparison.paper import (
    FITTED,
    MEASURED_JOINTS,
    MOTION_UNIT,
    NO_RAW_DATA,
    PAPER,
    STIFFNESS_KEY,
    STIFFNESS_UNIT,
)
from spinepipe.comparison.ranges import Range, at_most, factor_of_two
from spinepipe.comparison.run import NotComputed, Run

QUARTILES = ("quartile_25", "median", "quartile_75")
REDUCED_SET = {"part": "poses", "loading": "equilibrium", "dataset": "reduced"}
_ARM = (
    NO_RAW_DATA + "; flexion stiffness hangs on the lever arm of the load, for which the paper's "
    "numbers exclude each other (A1, A2)"
)


def claims() -> Iterator[Claim]:
    """Stiffness of the reduced dataset, its spread, and the bounds of its errors."""
    for name in FITTED:
        yield from _stiffness(name)
    yield _wider()
    for kind, name_of in (("translation_mm", "translation"), ("rotation_deg", "rotation")):
        bound = float(PAPER["reduced_error_bound"][kind])
        names = ("anterior", "superior") if name_of == "translation" else ("extension",)
        yield Claim(
            f"reduced.largest_error.{name_of}", "section 3.3, Fig 7",
            f"largest error of a {name_of} in the reduced dataset", MOTION_UNIT[names[0]], bound,
            at_most(bound), partial(_largest, names), NO_RAW_DATA,
            "the paper leaves outliers of its figure out; ours are all of the reduced dataset",
        )  # fmt: skip
    for joint in MEASURED_JOINTS:
        yield Claim(
            f"reduced.anterior_over_superior_error.{joint}", "section 3.3, Fig 7",
            f"median anterior error in superior errors at {joint}", "ratio", None,
            Range(1.0, None, "the paper's medians are largest in the anterior direction: above 1"),
            partial(_order, joint), NO_RAW_DATA,
        )  # fmt: skip


def _stiffness(name: str) -> Iterator[Claim]:
    low, middle, high = _quartiles(name)
    where = {**REDUCED_SET, "quantity": "stiffness", "joint": "*", "coordinate": name}
    unit, reason = STIFFNESS_UNIT[name], _ARM if name == "extension" else NO_RAW_DATA
    yield Claim(
        f"reduced.stiffness.{name}.median", "section 3.3, Fig 8", f"median {name} stiffness", unit,
        middle, Range(low, high, "the paper's IQR"), summary.median(**where), reason,
    )  # fmt: skip
    yield Claim(
        f"reduced.stiffness.{name}.iqr", "section 3.3, Fig 8", f"IQR of {name} stiffness", unit,
        high - low, factor_of_two(high - low), summary.statistic("iqr", **where), reason,
    )  # fmt: skip
    percent = _paper_percent(name)
    yield Claim(
        f"reduced.stiffness.{name}.iqr_percent", "section 3.3", f"IQR of {name} stiffness",
        "% of median", percent, factor_of_two(percent), summary.ratio_percent("iqr", **where),
        NO_RAW_DATA,
    )  # fmt: skip


def _quartiles(name: str) -> tuple[float, float, float]:
    """Lower quartile, median and upper quartile as printed."""
    printed, key = PAPER["reduced_stiffness"], STIFFNESS_KEY[name]
    low, middle, high = (float(printed[at][key]) for at in QUARTILES)
    return low, middle, high


def _wider() -> Claim:
    """Anterior stiffness is found far less precisely than flexion stiffness."""
    ratio = _paper_percent("anterior") / _paper_percent("extension")
    return Claim(
        "reduced.anterior_iqr_percent_over_extension", "section 3.3, Fig 8",
        "IQR in percent of the median, anterior in extension stiffness", "ratio", ratio,
        Range(1.0, None, "the paper's anterior stiffness scatters more: above 1"), _wider_by,
        NO_RAW_DATA,
    )  # fmt: skip


def _paper_percent(name: str) -> float:
    low, middle, high = _quartiles(name)
    return 100.0 * (high - low) / middle


def _wider_by(run: Run) -> Ours:
    anterior, extension = (
        summary.ratio_percent("iqr", **REDUCED_SET, quantity="stiffness", joint="*",
                              coordinate=name)(run).value
        for name in ("anterior", "extension")
    )  # fmt: skip
    if extension == 0.0:
        raise NotComputed("the IQR of extension stiffness is 0")
    return Ours(anterior / extension)


def _largest(names: tuple[str, ...], run: Run) -> Ours:
    return Ours(
        max(
            summary.value(run, "maximum", **REDUCED_SET, quantity="error", joint=joint,
                          coordinate=name)
            for joint in MEASURED_JOINTS
            for name in names
        )
    )  # fmt: skip


def _order(joint: str, run: Run) -> Ours:
    anterior, superior = (
        summary.value(run, "median", **REDUCED_SET, quantity="error", joint=joint, coordinate=name)
        for name in ("anterior", "superior")
    )
    if superior == 0.0:
        raise NotComputed("the median superior error is 0")
    return Ours(anterior / superior)
