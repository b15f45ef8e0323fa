"""What sections 3 and 4 say of errors: which are larger, how large, and to which side."""

from collections.abc import Callable, Iterator
from itertools import product

from spinepipe.comparison.claim import Claim, Ours, Range, Run, Verdict, exactly, factor_of_two
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
    over_prediction,
    rms,
    whole_rms,
    yes_or_no,
)

_OTHERS = {"literature": "the literature", "left_out_specimen": "a left-out specimen"}
_FITTED_LEVELS = PHANTOM + "; what a fit leaves over is its invented difference between joints"


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
        yield _extreme(model, "smallest", below, Range(None, below, "below the paper's bound"))


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
