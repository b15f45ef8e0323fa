"""Which errors section 3 says to be the larger ones."""

from collections.abc import Iterator
from itertools import product

from spinepipe.comparison.claim import Claim, Ours
from spinepipe.comparison.gould_2024b.forms import yes_or_no
from spinepipe.comparison.gould_2024b.paper import (
    COORDINATES,
    LOAD,
    LOADED,
    MODELS,
    PHANTOM,
    TESTS,
)
from spinepipe.comparison.gould_2024b.rows_of import errors, rms, whole_rms
from spinepipe.comparison.ranges import exactly
from spinepipe.comparison.run import Run

_OTHERS = {"literature": "the literature", "left_out_specimen": "a left-out specimen"}


def claims() -> Iterator[Claim]:
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
    fitted, beside = (whole_rms(errors(run, model, stage, test, name))
                      for stage in ("fitted", other))  # fmt: skip
    return fitted, beside


def _lower_everywhere(model: str, other: str) -> Claim:
    def ours(run: Run) -> Ours:
        cells = {(test, name): _both(run, model, other, test, name)
                 for test, name in product(TESTS, COORDINATES)}  # fmt: skip
        higher = [f"{name} under {LOAD[test]}" for (test, name), (fitted, beside) in cells.items()
                  if fitted >= beside]  # fmt: skip
        share = 100.0 * (1.0 - len(higher) / len(cells))
        return Ours(share, note=f"ours: not {', '.join(higher)}" if higher else "")

    return Claim(
        f"errors.fitted_below_{other}.{model}", "section 3.1",
        f"loads and rotations whose fitted error is below that of {_OTHERS[other]}, {model}", "%",
        100.0, exactly(100.0), ours,
        PHANTOM + "; a fit lowers the sum of squares, not the error of each coordinate",
    )  # fmt: skip


def _gain_when_loaded(model: str, test: str) -> Claim:
    def ours(run: Run) -> Ours:
        pairs = {name: _both(run, model, "literature", test, name) for name in COORDINATES}
        gains = {name: before - after for name, (after, before) in pairs.items()}
        told = ", ".join(f"{name} {gain:.2g}" for name, gain in gains.items())
        best = max(gains, key=lambda name: gains[name])
        return Ours(float(best == LOADED[test]), note=f"ours: {told} deg")

    return yes_or_no(
        f"errors.gain_largest_when_loaded.{model}.{test}", "section 3.1",
        f"fitting to {LOAD[test]} lowers the error of {LOADED[test]} most, {model}", True, ours,
    )  # fmt: skip


def _highest_when_loaded(model: str, test: str) -> Claim:
    def ours(run: Run) -> Ours:
        sizes = {name: whole_rms(errors(run, model, "fitted", test, name)) for name in COORDINATES}
        told = ", ".join(f"{name} {size:.2g}" for name, size in sizes.items())
        worst = max(sizes, key=lambda name: sizes[name])
        return Ours(float(worst == LOADED[test]), note=f"ours: {told} deg")

    return yes_or_no(
        f"errors.highest_when_loaded.{model}.{test}", "section 3.4, Fig 9",
        f"under {LOAD[test]} the fitted error of {LOADED[test]} is the highest, {model}", True,
        ours,
    )  # fmt: skip


def _larger_at_each_level(test: str) -> Claim:
    def ours(run: Run) -> Ours:
        uniform, levels = (rms(errors(run, model, "fitted", test), "joint") for model in MODELS)
        larger = (levels > uniform).reindex(levels.index)
        lower = ", ".join(str(name) for name in larger.index[~larger])
        return Ours(100.0 * float(larger.mean()), note=f"ours: not at {lower}" if lower else "")

    return Claim(
        f"errors.level_ratio_above_per_specimen.{test}", "section 3.4, Fig 9",
        f"levels where the fitted error under {LOAD[test]} is larger of level_ratio than of "
        "per_specimen", "%", 100.0, exactly(100.0), ours, PHANTOM,
    )  # fmt: skip


def _largest_error(test: str) -> Claim:
    def ours(run: Run) -> Ours:
        uniform, levels = (float(errors(run, model, "fitted", test)["peak_error"].abs().max())
                           for model in MODELS)  # fmt: skip
        return Ours(float(levels > uniform), note=f"ours: {levels:.2g} and {uniform:.2g} deg")

    return yes_or_no(
        f"errors.largest_of_level_ratio.{test}", "section 3.2.2, Figs 6-8",
        f"the largest fitted error under {LOAD[test]} is larger of level_ratio than of "
        "per_specimen", True, ours,
    )  # fmt: skip
