"""Table 4: mean absolute errors in the loaded coordinate, and the order they have.

Which errors section 3 says to be the larger ones.

What sections 3 and 4 say of the size and sign of errors.
"""

from collections.abc import Callable, Iterator
from itertools import product

from spinepipe.comparison.claim import (
    Claim,
    NotComputed,
    Ours,
    Range,
    Run,
    Verdict,
    exactly,
    factor_of_two,
    within_width,
)
from spinepipe.studies.cohort_stiffness.gould_2024b.paper import (
    COORDINATES,
    LOAD,
    LOADED,
    MODELS,
    PAPER,
    PHANTOM,
    PUT_IN,
    TESTS,
    errors,
    largest_motion,
    of_stage,
    over_prediction,
    rms,
    table_4,
    whole_rms,
    yes_or_no,
)

_OTHERS = {"literature": "the literature", "left_out_specimen": "a left-out specimen"}


def claims_of_error_orders() -> Iterator[Claim]:
    """Stages, coordinates and models in order."""
    for model, other in product(MODELS, _OTHERS):
        yield _lower_everywhere(model, other)
    for model, test in product(MODELS, TESTS):
        yield _gain_when_loaded(model, test)
        yield _highest_when_loaded(model, test)
    for test in TESTS:
        yield _larger_at_each_level(test)
        yield _largest_error(test)


def _both(run: Run, model: str, other: str, test: str, name: str) -> tuple[float, float]:
    """Error of the fit and of another stage, deg."""
    fitted, beside = (
        whole_rms(errors(run, model, stage, test, name)) for stage in ("fitted", other)
    )
    return fitted, beside


def _lower_everywhere(model: str, other: str) -> Claim:
    def ours(run: Run) -> Ours:
        cells = {
            (test, name): _both(run, model, other, test, name)
            for test, name in product(TESTS, COORDINATES)
        }
        higher = [
            f"{name} under {LOAD[test]}"
            for (test, name), (fitted, beside) in cells.items()
            if fitted >= beside
        ]
        share = 100.0 * (1.0 - len(higher) / len(cells))
        return Ours(share, note=f"ours: not {', '.join(higher)}" if higher else "")

    return Claim(
        f"errors.fitted_below_{other}.{model}",
        "section 3.1",
        f"loads and rotations whose fitted error is below that of {_OTHERS[other]}, {model}",
        "%",
        100.0,
        exactly(100.0),
        ours,
        PHANTOM + "; a fit lowers the sum of squares, not the error of each coordinate",
    )


def _gain_when_loaded(model: str, test: str) -> Claim:
    def ours(run: Run) -> Ours:
        pairs = {name: _both(run, model, "literature", test, name) for name in COORDINATES}
        gains = {name: before - after for name, (after, before) in pairs.items()}
        told = ", ".join(f"{name} {gain:.2g}" for name, gain in gains.items())
        best = max(gains, key=lambda name: gains[name])
        return Ours(float(best == LOADED[test]), note=f"ours: {told} deg")

    return yes_or_no(
        f"errors.gain_largest_when_loaded.{model}.{test}",
        "section 3.1",
        f"fitting to {LOAD[test]} lowers the error of {LOADED[test]} most, {model}",
        True,
        ours,
    )


def _highest_when_loaded(model: str, test: str) -> Claim:
    def ours(run: Run) -> Ours:
        sizes = {name: whole_rms(errors(run, model, "fitted", test, name)) for name in COORDINATES}
        told = ", ".join(f"{name} {size:.2g}" for name, size in sizes.items())
        worst = max(sizes, key=lambda name: sizes[name])
        return Ours(float(worst == LOADED[test]), note=f"ours: {told} deg")

    return yes_or_no(
        f"errors.highest_when_loaded.{model}.{test}",
        "section 3.4, Fig 9",
        f"under {LOAD[test]} the fitted error of {LOADED[test]} is the highest, {model}",
        True,
        ours,
    )


def _larger_at_each_level(test: str) -> Claim:
    def ours(run: Run) -> Ours:
        uniform, levels = (rms(errors(run, model, "fitted", test), "joint") for model in MODELS)
        larger = (levels > uniform).reindex(levels.index)
        lower = ", ".join(str(name) for name in larger.index[~larger])
        return Ours(100.0 * float(larger.mean()), note=f"ours: not at {lower}" if lower else "")

    return Claim(
        f"errors.level_ratio_above_per_specimen.{test}",
        "section 3.4, Fig 9",
        f"levels where the fitted error under {LOAD[test]} is larger of level_ratio than of "
        "per_specimen",
        "%",
        100.0,
        exactly(100.0),
        ours,
        PHANTOM,
    )


def _largest_error(test: str) -> Claim:
    def ours(run: Run) -> Ours:
        uniform, levels = (
            float(errors(run, model, "fitted", test)["peak_error"].abs().max()) for model in MODELS
        )
        return Ours(float(levels > uniform), note=f"ours: {levels:.2g} and {uniform:.2g} deg")

    return yes_or_no(
        f"errors.largest_of_level_ratio.{test}",
        "section 3.2.2, Figs 6-8",
        f"the largest fitted error under {LOAD[test]} is larger of level_ratio than of "
        "per_specimen",
        True,
        ours,
    )


_FITTED_LEVELS = PHANTOM + "; what a fit leaves over is its invented difference between joints"


def claims_of_error_patterns() -> Iterator[Claim]:
    """Differences, extremes and signs of errors at the largest load."""
    for by in ("specimens", "levels"):
        yield _difference(by)
    yield from _extremes()
    for test in PAPER["literature_overpredicts"]["loads"]:
        yield from _signs(test)


def _difference(by: str) -> Claim:
    paper = float(PAPER["rmse"][f"largest_difference_between_{by}_percent"])
    group = {"specimens": "specimen", "levels": "joint"}[by]

    def ours(run: Run) -> Ours:
        found = {}
        for test in TESTS:
            seen = errors(run, MODELS[0], "fitted", test)
            sizes = rms(seen, group)
            found[test] = 100.0 * float(sizes.max() - sizes.min()) / largest_motion(seen)
        worst = max(found, key=lambda test: found[test])
        return Ours(found[worst], note=f"ours: under {LOAD[worst]}")

    return Claim(
        f"rmse.difference_between_{by}",
        "sections 3.2.1, 3.3.1",
        f"largest difference of fitted errors (root mean square) between {by}, per_specimen",
        "% of the largest mean motion",
        paper,
        factor_of_two(paper),
        ours,
        _FITTED_LEVELS,
        "the paper does not say what its percentage is of",
    )


def _extremes() -> Iterator[Claim]:
    printed = PAPER["level_error"]
    above = float(printed["per_specimen_above_deg"])
    yield _extreme("per_specimen", "largest", above, Range(above, None, "above the paper's bound"))
    for model in MODELS:
        below = float(printed[f"{model}_below_deg"])
        yield _extreme(model, "smallest", below, Range(0.0, below, "below the paper's bound"))


def _extreme(model: str, which: str, bound: float, allowed: Range) -> Claim:
    def ours(run: Run) -> Ours:
        sizes = [errors(run, model, "fitted", test)["peak_error"].abs() for test in TESTS]
        ends = [float(size.max() if which == "largest" else size.min()) for size in sizes]
        return Ours(max(ends) if which == "largest" else min(ends))

    return Claim(
        f"level_error.{which}.{model}",
        "section 4",
        f"{which} fitted error of a level, in the loaded coordinate, {model}",
        "deg",
        bound,
        allowed,
        ours,
        _FITTED_LEVELS,
    )


def _signs(test: str) -> Iterator[Claim]:
    """Published stiffness predicts too much everywhere; a fitted one too much and too little."""
    yield Claim(
        f"over_predicted.literature.{test}",
        "section 3.3.1",
        f"levels whose motion under {LOAD[test]} published stiffness predicts too large on average",
        "%",
        100.0,
        exactly(100.0),
        _over_predicted(test, "literature", "joint"),
        _FITTED_LEVELS,
        PUT_IN,
        evidence=Verdict.CIRCULAR,
    )
    some = Range(1e-9, 100.0 - 1e-9, "some levels but not all")
    yield Claim(
        f"over_predicted.fitted.{test}",
        "section 3.3.1",
        f"joints whose motion under {LOAD[test]} the fit of per_specimen predicts too large",
        "%",
        None,
        some,
        _over_predicted(test, "fitted", ""),
        _FITTED_LEVELS,
    )


def _over_predicted(test: str, stage: str, by: str) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        seen = errors(run, MODELS[0], stage, test)
        excess = over_prediction(seen)
        if by:
            excess = excess.groupby(seen[by]).mean()
        count = int((excess > 0.0).sum())
        return Ours(100.0 * count / len(excess), note=f"ours: {count} of {len(excess)}")

    return ours


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
        columns = ("mae_deg", "low_quartile_deg", "high_quartile_deg")
        middle, low, high = (_number(run, column, model, test, stage) for column in columns)
        return Ours(middle, low, high)

    return ours


def _iqr(model: str, test: str, stage: str) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        low, high = (
            _number(run, f"{end}_quartile_deg", model, test, stage) for end in ("low", "high")
        )
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
        whole = _number(run, "mae_deg", *larger)
        if whole == 0.0:
            raise NotComputed("the larger error is 0")
        return Ours(_number(run, "mae_deg", *smaller) / whole)

    paper = table_4(*smaller, "median_deg") / table_4(*larger, "median_deg")
    return Claim(
        key,
        "sections 3.1, 3.4, Table 4",
        quantity,
        "ratio",
        paper,
        Range(0.0, 1.0, "the paper's order: below 1"),
        ours,
        PHANTOM,
        note,
    )


def _gains_more(test: str) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        uniform, levels = (_points(run, model, test) for model in MODELS)
        return Ours(float(levels > uniform), note=f"ours: {levels:.0f} and {uniform:.0f} points")

    return ours
