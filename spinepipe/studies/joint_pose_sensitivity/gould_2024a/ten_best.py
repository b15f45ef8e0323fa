"""The ten best poses: Table 4, the best model, and what the discussion makes of them."""

from collections.abc import Callable, Iterator

from spinepipe.comparison import summary
from spinepipe.comparison.claim import Claim, Ours
from spinepipe.comparison.paper import (
    FITTED,
    MEASURED_JOINTS,
    MOTION_KEY,
    MOTION_UNIT,
    NO_RAW_DATA,
    PAPER,
    STIFFNESS_KEY,
    STIFFNESS_UNIT,
)
from spinepipe.comparison.ranges import exactly, factor_of_two, within_width

BEST = {"part": "poses", "loading": "equilibrium", "dataset": "best"}
_RANKED = "the best are ranked by cost here; the paper does not say by which error"


def claims() -> Iterator[Claim]:
    """Cells of Table 4, ratios of section 3.3, the summary of section 4."""
    for name in FITTED:
        for joint in MEASURED_JOINTS:
            where = {**BEST, "quantity": "error", "joint": joint, "coordinate": name}
            printed = PAPER["ten_best_error"][joint]
            numbers = {kind: float(printed[kind][MOTION_KEY[name]]) for kind in printed}
            words, unit = f"{name} error at {joint}", MOTION_UNIT[name]
            yield from _cells(f"ten_best.error.{joint}.{name}", words, unit, numbers, where)
        where = {**BEST, "quantity": "stiffness", "joint": "*", "coordinate": name}
        printed = PAPER["ten_best_stiffness"]
        numbers = {
            kind: float(printed[kind][STIFFNESS_KEY[name]]) for kind in ("median", "iqr", "range")
        }
        unit = STIFFNESS_UNIT[name]
        yield from _cells(f"ten_best.stiffness.{name}", f"{name} stiffness", unit, numbers, where)
    yield from _percent_of_median()
    yield from _in_discussion()


def _cells(
    key: str, words: str, unit: str, numbers: dict[str, float], where: dict[str, str]
) -> Iterator[Claim]:
    """Median, IQR and range of one quantity."""
    middle = within_width(numbers["median"], numbers["iqr"], "IQR")
    yield Claim(
        f"{key}.median", "Table 4", f"median {words}, ten best", unit, numbers["median"], middle,
        summary.median(**where), NO_RAW_DATA, _RANKED,
    )  # fmt: skip
    for kind in ("iqr", "range"):
        words_of = {"iqr": "IQR", "range": "range"}[kind]
        yield Claim(
            f"{key}.{kind}", "Table 4", f"{words_of} of {words}, ten best", unit, numbers[kind],
            factor_of_two(numbers[kind]), summary.statistic(kind, **where), NO_RAW_DATA, _RANKED,
        )  # fmt: skip


def _percent_of_median() -> Iterator[Claim]:
    for kind in ("iqr", "range"):
        paper = float(PAPER["ten_best_anterior_stiffness_percent_of_median"][kind])
        yield Claim(
            f"ten_best.anterior_{kind}_percent", "section 3.3",
            f"{kind} of anterior stiffness of the ten best", "% of median", paper,
            factor_of_two(paper),
            summary.ratio_percent(kind, **BEST, quantity="stiffness", joint="*",
                                  coordinate="anterior"),
            NO_RAW_DATA, _RANKED,
        )  # fmt: skip


def _in_discussion() -> Iterator[Claim]:
    for name, kind in (("anterior", "median"), ("superior", "median"), ("extension", "iqr")):
        paper = float(PAPER["ten_best_error_in_discussion"][kind][MOTION_KEY[name]])
        cells = [
            PAPER["ten_best_error"][joint][kind][MOTION_KEY[name]] for joint in MEASURED_JOINTS
        ]
        yield Claim(
            f"discussion.ten_best.{name}.{kind}", "section 4",
            f"{kind} of {name} error of the ten best, larger of two joints", MOTION_UNIT[name],
            paper, exactly(paper), _larger(kind, name), NO_RAW_DATA,
            contradicted=f"A18: Table 4 has {cells[0]:g} and {cells[1]:g}, section 4 {paper:g}",
        )  # fmt: skip


def _larger(kind: str, name: str) -> Callable[..., Ours]:
    return summary.largest(kind, MEASURED_JOINTS, **BEST, quantity="error", coordinate=name)
