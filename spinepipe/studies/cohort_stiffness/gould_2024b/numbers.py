"""Measured motion that Tables 2 and 4 imply without printing it."""

from collections.abc import Callable, Iterator
from itertools import product
from math import degrees
from statistics import median

from spinepipe.comparison.claim import Claim, Ours, Verdict
from spinepipe.comparison.gould_2024b.forms import recomputed
from spinepipe.comparison.gould_2024b.paper import (
    JOINTS,
    LOAD,
    LOADED,
    LOWER_FIVE,
    MODELS,
    MOMENT_NM,
    PHANTOM,
    PUT_IN,
    TESTS,
    table_3,
    table_4,
)
from spinepipe.comparison.gould_2024b.rotations import (
    OVER_PREDICTED,
    by_uniform,
    mean_of_levels,
    near,
)
from spinepipe.comparison.gould_2024b.rows_of import errors, largest_motion
from spinepipe.comparison.ranges import Range
from spinepipe.comparison.run import Run

_ROUNDING_DEG = 0.1
"""Two medians printed to 0.1 deg, half a digit each."""


def claims() -> Iterator[Claim]:
    """Mean motion, then the largest mean motion."""
    for test in OVER_PREDICTED:
        yield from _implied(test)
    for model, test in product(MODELS, TESTS):
        yield _same_motion(model, test)
    for test in TESTS:
        yield _largest(test)


def _implied(test: str) -> Iterator[Claim]:
    """Mean motion: what was predicted less what was predicted too much."""
    first, second, without_l5s1 = (
        angle - table_4(model, test, "literature", "median_deg")
        for angle, model in (
            (by_uniform(test), MODELS[0]),
            (mean_of_levels(test, LOWER_FIVE), MODELS[1]),
            (mean_of_levels(test, JOINTS[:-1]), MODELS[1]),
        )
    )
    what = f"B4: {first:.2f} deg by per_specimen, {_ROUNDING_DEG:g} deg either way for rounding"
    yield recomputed(
        f"mean_motion.{test}", "Tables 2, 4",
        f"mean {LOADED[test]} under {LOAD[test]} that Table 4 implies by level_ratio", "deg", None,
        Range(first - _ROUNDING_DEG, first + _ROUNDING_DEG, what), second,
        f"B5: with L1L2 to L5S1 both models agree; B6: with T12L1 to L4L5 it were "
        f"{without_l5s1:.1f} deg, so the five levels probably leave T12L1 out",
    )  # fmt: skip
    yield Claim(
        f"mean_motion.{test}", "Tables 2, 4",
        f"mean measured {LOADED[test]} of L1L2 to L5S1 under {LOAD[test]}", "deg", None,
        near(first, f"B4: Table 4 implies {first:.1f} deg"), _measured(test), _stiffness_says(test),
        f"{PUT_IN}, and with it the size of its motion", evidence=Verdict.CIRCULAR,
    )  # fmt: skip


def _stiffness_says(test: str) -> str:
    """What the paper's own fitted stiffness makes of the moment."""
    angle = degrees(MOMENT_NM / median(table_3(test, LOADED[test]).values()))
    return (
        f"the moment over Table 3's median stiffness is {angle:.1f} deg already, and the phantom's "
        f"weight adds to it; {PHANTOM}"
    )


def _measured(test: str) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        seen = errors(run, MODELS[0], "literature", test)
        means = seen[seen["joint"].isin(LOWER_FIVE)].groupby("specimen")["measured_peak"].mean()
        return Ours(float(means.abs().median()), float(means.abs().min()), float(means.abs().max()))

    return ours


def _ends(model: str, test: str, stage: str) -> tuple[float, float]:
    """Largest mean motions that round to the printed error and percentage, deg."""
    error, percent = (
        table_4(model, test, stage, what) for what in ("median_deg", "median_percent")
    )
    low, high = 100.0 * (error - 0.05) / (percent + 0.5), 100.0 * (error + 0.05) / (percent - 0.5)
    return low, high


def _same_motion(model: str, test: str) -> Claim:
    error, percent = (
        table_4(model, test, "fitted", what) for what in ("median_deg", "median_percent")
    )
    before, after = _ends(model, test, "literature"), _ends(model, test, "fitted")
    half = (after[1] - after[0]) / 2.0
    what = "B7: that of the literature rows, with the rounding of both rows"
    return recomputed(
        f"largest_mean_motion.{model}.{test}", "Table 4",
        f"largest mean {LOADED[test]} that the fitted rows of {model} imply", "deg", None,
        Range(before[0] - half, before[1] + half, what), 100.0 * error / percent,
        "fits that did not converge are in neither row" if test == TESTS[1] else "",
    )  # fmt: skip


def _largest(test: str) -> Claim:
    stages = [(model, stage) for model in MODELS for stage in ("literature", "fitted")]
    ends = [_ends(model, test, stage) for model, stage in stages]
    what = "B7: error over percentage, lowest to highest of four rows of Table 4 with rounding"
    return Claim(
        f"largest_mean_motion.{test}", "Table 4",
        f"largest over specimens of the mean measured {LOADED[test]} under {LOAD[test]}", "deg",
        None, Range(min(end[0] for end in ends), max(end[1] for end in ends), what),
        lambda run: Ours(largest_motion(errors(run, MODELS[0], "literature", test))),
        "the largest of six hangs on the phantom's softest specimen, and weight adds to its motion",
        PUT_IN, evidence=Verdict.CIRCULAR,
    )  # fmt: skip
