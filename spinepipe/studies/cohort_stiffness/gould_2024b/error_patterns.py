"""What sections 3 and 4 say of the size and sign of errors."""

from collections.abc import Callable, Iterator

from spinepipe.comparison.claim import Claim, Ours, Verdict
from spinepipe.comparison.gould_2024b.paper import (
    LOAD,
    MODELS,
    PAPER,
    PHANTOM,
    PUT_IN,
    TESTS,
)
from spinepipe.comparison.gould_2024b.rows_of import (
    errors,
    largest_motion,
    over_prediction,
    rms,
)
from spinepipe.comparison.ranges import Range, exactly, factor_of_two
from spinepipe.comparison.run import Run

_FITTED_LEVELS = PHANTOM + "; what a fit leaves over is its invented difference between joints"


def claims() -> Iterator[Claim]:
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
        f"rmse.difference_between_{by}", "sections 3.2.1, 3.3.1",
        f"largest difference of fitted errors (root mean square) between {by}, per_specimen",
        "% of the largest mean motion", paper, factor_of_two(paper), ours, _FITTED_LEVELS,
        "the paper does not say what its percentage is of",
    )  # fmt: skip


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
        f"level_error.{which}.{model}", "section 4",
        f"{which} fitted error of a level, in the loaded coordinate, {model}", "deg", bound,
        allowed, ours, _FITTED_LEVELS,
    )  # fmt: skip


def _signs(test: str) -> Iterator[Claim]:
    """Published stiffness predicts too much everywhere; a fitted one too much and too little."""
    yield Claim(
        f"over_predicted.literature.{test}", "section 3.3.1",
        f"levels whose motion under {LOAD[test]} published stiffness predicts too large on average",
        "%", 100.0, exactly(100.0), _over_predicted(test, "literature", "joint"),
        _FITTED_LEVELS, PUT_IN, evidence=Verdict.CIRCULAR,
    )  # fmt: skip
    some = Range(1e-9, 100.0 - 1e-9, "some levels but not all")
    yield Claim(
        f"over_predicted.fitted.{test}", "section 3.3.1",
        f"joints whose motion under {LOAD[test]} the fit of per_specimen predicts too large", "%",
        None, some, _over_predicted(test, "fitted", ""), _FITTED_LEVELS,
    )  # fmt: skip


def _over_predicted(test: str, stage: str, by: str) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        seen = errors(run, MODELS[0], stage, test)
        excess = over_prediction(seen)
        if by:
            excess = excess.groupby(seen[by]).mean()
        count = int((excess > 0.0).sum())
        return Ours(100.0 * count / len(excess), note=f"ours: {count} of {len(excess)}")

    return ours
