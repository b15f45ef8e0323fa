"""Table 4: mean absolute errors in the loaded coordinate, and the order they have."""

from collections.abc import Callable, Iterator
from itertools import product

from spinepipe.comparison.claim import (
    Claim,
    NotComputed,
    Ours,
    Range,
    Run,
    Verdict,
    factor_of_two,
    within_width,
)
from spinepipe.studies.cohort_stiffness.gould_2024b.paper import (
    LOAD,
    LOADED,
    MODELS,
    PAPER,
    PHANTOM,
    PUT_IN,
    TESTS,
    of_stage,
    table_4,
    yes_or_no,
)

WHERE = "Table 4"
_STAGES = ("literature", "fitted")

_COMPUTED_FROM = (
    f"an error of published stiffness follows from the moment and the phantom's stiffness, and "
    f"{PUT_IN}"
)

_FITTED = (
    PHANTOM + "; what a fit leaves over is the phantom's invented difference between joints, with "
    "none of a real spine's nonlinearity"
)

_PUBLISHED = (
    PHANTOM + "; ours has all six joints (the paper's five probably leave T12L1 out, B5) and the "
    "weight of a pot"
)

_OUTSIDE = {"literature": _PUBLISHED, "fitted": _FITTED}


def claims_of_mean_errors() -> Iterator[Claim]:
    """Cells of Table 4, then their order and differences."""
    for model, test, stage in product(MODELS, TESTS, _STAGES):
        yield from _cell(model, test, stage)
    for test in TESTS:
        yield _drop(test)
    yield from _order()


def _cell(model: str, test: str, stage: str) -> Iterator[Claim]:
    median, iqr, percent = (
        table_4(model, test, stage, what) for what in ("median_deg", "iqr_deg", "median_percent")
    )
    key = f"mae.{model}.{test}.{stage}"
    words = f"absolute {LOADED[test]} error under {LOAD[test]}, {model}, {stage}"
    relative = within_width(percent, percent * iqr / median, "IQR in percent")
    cells = (
        ("median", "median", "deg", median, within_width(median, iqr, "IQR"), _median),
        ("iqr", "IQR", "deg", iqr, factor_of_two(iqr), _iqr),
        ("percent", "median", "% of the largest mean motion", percent, relative, _percent),
    )
    for name, of, unit, paper, allowed, ours in cells:
        yield Claim(
            f"{key}.{name}",
            WHERE,
            f"{of} over specimens of the mean {words}",
            unit,
            paper,
            allowed,
            ours(model, test, stage),
            _OUTSIDE[stage],
            _COMPUTED_FROM if stage == "literature" else "",
            evidence=Verdict.CIRCULAR if stage == "literature" else Verdict.INSIDE,
        )


def _number(run: Run, column: str, model: str, test: str, stage: str) -> float:
    return run.number("mae", column, **of_stage(model, stage, test), test=test, steps="peak")


def _median(model: str, test: str, stage: str) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        columns = ("mae", "low_quartile", "high_quartile")
        middle, low, high = (_number(run, column, model, test, stage) for column in columns)
        return Ours(middle, low, high)

    return ours


def _iqr(model: str, test: str, stage: str) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        low, high = (_number(run, f"{end}_quartile", model, test, stage) for end in ("low", "high"))
        return Ours(high - low)

    return ours


def _percent(model: str, test: str, stage: str) -> Callable[[Run], Ours]:
    return lambda run: Ours(_number(run, "mae_percent", model, test, stage))


def _points(run: Run, model: str, test: str) -> float:
    """Fall of the percentage from literature to fitted."""
    before, after = (_number(run, "mae_percent", model, test, stage) for stage in _STAGES)
    return before - after


def _drop(test: str) -> Claim:
    paper = float(PAPER["mae_drop_points"][test])
    return Claim(
        f"mae_drop.per_specimen.{test}",
        "section 3.2.1",
        f"fall of the percentage under {LOAD[test]} from literature to fitted, per_specimen",
        "percentage points",
        paper,
        factor_of_two(paper),
        lambda run: Ours(_points(run, "per_specimen", test)),
        _FITTED,
        _COMPUTED_FROM,
        evidence=Verdict.CIRCULAR,
    )


def _order() -> Iterator[Claim]:
    for model, test in product(MODELS, TESTS):
        yield _ratio(
            f"mae_order.fitted_below_literature.{model}.{test}",
            f"fitted error in that of the literature, {model}, {LOAD[test]}",
            (model, test, "fitted"),
            (model, test, "literature"),
            "",
        )
    for test, stage in product(TESTS, _STAGES):
        yield _ratio(
            f"mae_order.per_specimen_below_level_ratio.{test}.{stage}",
            f"error of per_specimen in that of level_ratio, {stage}, {LOAD[test]}",
            ("per_specimen", test, stage),
            ("level_ratio", test, stage),
            "the phantom's levels do not follow Table 2's ratios: had they done, the order would "
            "turn",
        )
    for test in TESTS:
        yield yes_or_no(
            f"mae_order.level_ratio_gains_more.{test}",
            "section 3.2.2, Table 4",
            f"under {LOAD[test]} fitting lowers the percentage of level_ratio more than that of "
            "per_specimen",
            True,
            _gains_more(test),
        )


def _ratio(
    key: str,
    quantity: str,
    smaller: tuple[str, str, str],
    larger: tuple[str, str, str],
    note: str,
) -> Claim:
    def ours(run: Run) -> Ours:
        whole = _number(run, "mae", *larger)
        if whole == 0.0:
            raise NotComputed("the larger error is 0")
        return Ours(_number(run, "mae", *smaller) / whole)

    paper = table_4(*smaller, "median_deg") / table_4(*larger, "median_deg")
    return Claim(
        key,
        "sections 3.1, 3.4, Table 4",
        quantity,
        "ratio",
        paper,
        Range(None, 1.0, "the paper's order: below 1"),
        ours,
        PHANTOM,
        note,
    )


def _gains_more(test: str) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        uniform, levels = (_points(run, model, test) for model in MODELS)
        return Ours(float(levels > uniform), note=f"ours: {levels:.0f} and {uniform:.0f} points")

    return ours
