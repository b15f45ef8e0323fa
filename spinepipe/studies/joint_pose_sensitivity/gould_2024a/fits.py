"""Errors of the start-value and damping bootstraps: Tables 2 and 3."""

from collections.abc import Iterator
from itertools import product

from spinepipe.comparison import summary
from spinepipe.comparison.claim import Claim, Ours
from spinepipe.comparison.paper import (
    FITTED,
    MEASURED_JOINTS,
    MOTION_KEY,
    MOTION_UNIT,
    NO_RAW_DATA,
    PAPER,
    measured,
)
from spinepipe.comparison.ranges import exactly, factor_of_two, within_width
from spinepipe.comparison.run import Run
from spinepipe.comparison.settling import SPREAD

TABLE = {"damping": "Table 2", "start": "Table 3"}
SETS = {"damping": "sets of damping", "start": "start values"}
LOADINGS = ("quasi_static", "dynamic")
CONTRADICTED_PERCENT = {
    **{(what, load, "anterior"): "A12" for what, load in product(TABLE, LOADINGS)},
    **{("damping", load, "superior"): "A13" for load in LOADINGS},
    ("damping", "dynamic", "extension"): "A14",
}
"""Printed percentages that the printed errors and motion do not give."""


def claims() -> Iterator[Claim]:
    """Cells of both tables, then their pattern."""
    for what, loading in product(TABLE, LOADINGS):
        for joint, name in product(MEASURED_JOINTS, FITTED):
            yield from _cell(what, loading, joint, name)
        for name in FITTED:
            yield _percent(what, loading, name)
    yield _lower_when_quasi_static()


def _cell(what: str, loading: str, joint: str, name: str) -> Iterator[Claim]:
    """Median and range of one error."""
    printed = PAPER[f"{what}_bootstrap_error"][loading][joint]
    median, width = (float(printed[kind][MOTION_KEY[name]]) for kind in ("median", "range"))
    where = {**where_of(what, loading), "quantity": "error", "joint": joint, "coordinate": name}
    words, key = f"{name} error at {joint}, {loading}", f"{what}_bootstrap.{loading}.{joint}.{name}"
    yield Claim(
        f"{key}.median", TABLE[what], f"median {words}, over {SETS[what]}", MOTION_UNIT[name],
        median, within_width(median, width, "range"), summary.median(**where), NO_RAW_DATA,
    )  # fmt: skip
    yield Claim(
        f"{key}.range", TABLE[what], f"range of {words}, over {SETS[what]}", MOTION_UNIT[name],
        width, factor_of_two(width), summary.statistic("range", **where),
        SPREAD[what, loading],
    )  # fmt: skip


def where_of(what: str, loading: str, dataset: str = "all") -> dict[str, str]:
    """Keys of the summary's rows of one bootstrap."""
    return {"part": f"{what}_bootstrap", "loading": loading, "dataset": dataset}


def _percent(what: str, loading: str, name: str) -> Claim:
    printed = PAPER[f"{what}_bootstrap_error"][loading]
    paper = float(printed["largest_percent"][name])
    check = CONTRADICTED_PERCENT.get((what, loading, name))
    return Claim(
        f"{what}_bootstrap.{loading}.{name}.largest_percent", TABLE[what],
        f"largest median {name} error of a joint, {loading}, over {SETS[what]}",
        "% of measured", paper, factor_of_two(paper),
        summary.largest("percent_of_measured", MEASURED_JOINTS, **where_of(what, loading),
                        quantity="error", coordinate=name),
        NO_RAW_DATA,
        contradicted="" if check is None else f"{check}: {_implied(what, loading, name)}",
    )  # fmt: skip


def _implied(what: str, loading: str, name: str) -> str:
    """What the printed errors make of the printed motion."""
    printed = PAPER[f"{what}_bootstrap_error"][loading]
    percents = [
        100.0 * float(printed[joint]["median"][MOTION_KEY[name]]) / measured(joint, name)
        for joint in MEASURED_JOINTS
    ]
    return (
        f"the printed medians are {percents[0]:.0f} and {percents[1]:.0f} % of the motion of "
        f"section 3.1, printed is {float(printed['largest_percent'][name]):g} %"
    )


def _lower_when_quasi_static() -> Claim:
    """Errors and ranges said to be lower under quasi-static loading."""
    return Claim(
        "bootstraps.quasi_static_is_lower", "section 3.1, Tables 2, 3",
        "share of medians and ranges of error that are lower quasi-static than dynamic", "%",
        100.0, exactly(100.0), _share_lower, NO_RAW_DATA,
        contradicted=f"A16: in Tables 2 and 3 themselves {_printed_lower():.0f} % are",
    )  # fmt: skip


def _cells() -> Iterator[tuple[str, str, str, str]]:
    yield from product(TABLE, MEASURED_JOINTS, FITTED, ("median", "range"))


def _printed_lower() -> float:
    lower = []
    for what, joint, name, kind in _cells():
        tables = [PAPER[f"{what}_bootstrap_error"][loading] for loading in LOADINGS]
        quasi_static, dynamic = (table[joint][kind][MOTION_KEY[name]] for table in tables)
        lower.append(quasi_static < dynamic)
    return 100.0 * sum(lower) / len(lower)


def _share_lower(run: Run) -> Ours:
    lower = []
    for what, joint, name, kind in _cells():
        where = {"quantity": "error", "joint": joint, "coordinate": name}
        quasi_static, dynamic = (
            summary.value(run, kind, **where_of(what, loading), **where) for loading in LOADINGS
        )
        lower.append(quasi_static < dynamic)
    return Ours(100.0 * sum(lower) / len(lower))
