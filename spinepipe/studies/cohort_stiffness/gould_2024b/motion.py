"""Motion that the moment, the published stiffness and Table 4 imply without printing it."""

from collections.abc import Callable, Iterator
from itertools import product
from math import degrees
from statistics import median

from spinepipe.comparison.claim import Claim, Ours, Range, Run, Verdict
from spinepipe.studies.cohort_stiffness.gould_2024b.paper import (
    JOINTS,
    LOAD,
    LOADED,
    LOWER_FIVE,
    MODELS,
    MOMENT_NM,
    PHANTOM,
    PUT_IN,
    TESTS,
    errors,
    largest_motion,
    of_level,
    predicted,
    recomputed,
    table_3,
    table_4,
    uniform,
)

WHERE = "Table 2"
OVER_PREDICTED = ("left_lateral_bending", "flexion")
_REACH = 0.1

_TURNED = (
    "the formula leaves out weight, whose arm grows as the column bends (the phantom's T12 carries "
    "a pot of 1 kg): without it the same model is within 3 % of the formula"
)

_ROUNDING_DEG = 0.1
"""Two medians printed to 0.1 deg, half a digit each."""


def claims_of_rotations() -> Iterator[Claim]:
    """Closed forms beside the predictions of our model."""
    for test in TESTS:
        angle = by_uniform(test)
        yield _run(f"uniform.{test}", test, "B2", angle, MODELS[0], JOINTS)
    for test in OVER_PREDICTED:
        yield _run(
            f"levels.{test}", test, "B3", mean_of_levels(test, LOWER_FIVE), MODELS[1], LOWER_FIVE
        )
    bending = "left_lateral_bending"
    one = ("L3L4",)
    yield _run(
        f"levels.{bending}.L3L4", bending, "B3", mean_of_levels(bending, one), MODELS[1], one
    )
    yield _levels_over_uniform(bending)


def _run(
    key: str, test: str, check: str, angle: float, model: str, joints: tuple[str, ...]
) -> Claim:
    place = joints[0] if len(joints) == 1 else f"{joints[0]} to {joints[-1]}"
    return Claim(
        f"closed_form.literature_rotation.{key}",
        WHERE,
        f"mean {LOADED[test]} of {place} at {MOMENT_NM:g} N m with published stiffness, {model}",
        "deg",
        None,
        near(angle, f"{check}: moment over stiffness is {angle:.1f} deg"),
        _mean_rotation(model, test, joints),
        _TURNED,
        "ours: predicted motion of the whole model",
        evidence=Verdict.RECOMPUTED,
    )


def _mean_rotation(model: str, test: str, joints: tuple[str, ...]) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        seen = errors(run, model, "literature", test)
        sizes = predicted(seen[seen["joint"].isin(joints)])
        return Ours(float(sizes.mean()), float(sizes.min()), float(sizes.max()))

    return ours


def _levels_over_uniform(test: str) -> Claim:
    def ours(run: Run) -> Ours:
        uniform_set, levels = (_mean_rotation(m, test, LOWER_FIVE)(run).value for m in MODELS)
        return Ours(levels / uniform_set)

    ratio = mean_of_levels(test, LOWER_FIVE) / by_uniform(test)
    return Claim(
        f"closed_form.literature_rotation.levels_over_uniform.{test}",
        WHERE,
        f"mean {LOADED[test]} predicted by published level_ratio in that by per_specimen",
        "ratio",
        None,
        near(ratio, f"B3: the closed forms have {ratio:.2f}"),
        ours,
        _TURNED,
        evidence=Verdict.RECOMPUTED,
    )


def claims_of_implied_motion() -> Iterator[Claim]:
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
        f"mean_motion.{test}",
        "Tables 2, 4",
        f"mean {LOADED[test]} under {LOAD[test]} that Table 4 implies by level_ratio",
        "deg",
        None,
        Range(first - _ROUNDING_DEG, first + _ROUNDING_DEG, what),
        second,
        f"B5: with L1L2 to L5S1 both models agree; B6: with T12L1 to L4L5 it were "
        f"{without_l5s1:.1f} deg, so the five levels probably leave T12L1 out",
    )
    yield Claim(
        f"mean_motion.{test}",
        "Tables 2, 4",
        f"mean measured {LOADED[test]} of L1L2 to L5S1 under {LOAD[test]}",
        "deg",
        None,
        near(first, f"B4: Table 4 implies {first:.1f} deg"),
        _measured(test),
        _stiffness_says(test),
        f"{PUT_IN}, and with it the size of its motion",
        evidence=Verdict.CIRCULAR,
    )


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
        f"largest_mean_motion.{model}.{test}",
        "Table 4",
        f"largest mean {LOADED[test]} that the fitted rows of {model} imply",
        "deg",
        None,
        Range(before[0] - half, before[1] + half, what),
        100.0 * error / percent,
        "fits that did not converge are in neither row" if test == TESTS[1] else "",
    )


def _largest(test: str) -> Claim:
    stages = [(model, stage) for model in MODELS for stage in ("literature", "fitted")]
    ends = [_ends(model, test, stage) for model, stage in stages]
    what = "B7: error over percentage, lowest to highest of four rows of Table 4 with rounding"
    return Claim(
        f"largest_mean_motion.{test}",
        "Table 4",
        f"largest over specimens of the mean measured {LOADED[test]} under {LOAD[test]}",
        "deg",
        None,
        Range(min(end[0] for end in ends), max(end[1] for end in ends), what),
        lambda run: Ours(largest_motion(errors(run, MODELS[0], "literature", test))),
        "the largest of six hangs on the phantom's softest specimen, and weight adds to its motion",
        PUT_IN,
        evidence=Verdict.CIRCULAR,
    )


def by_uniform(test: str) -> float:
    """Rotation of any joint by the stiffness that all joints share, deg."""
    return degrees(MOMENT_NM / uniform(LOADED[test]))


def mean_of_levels(test: str, joints: tuple[str, ...]) -> float:
    """Mean rotation of joints by their published stiffness, deg."""
    angles = [degrees(MOMENT_NM / of_level(joint, LOADED[test])) for joint in joints]
    return sum(angles) / len(angles)


def near(value: float, of: str) -> Range:
    """A closed form with the reach of what it leaves out."""
    what = f"{of}, with {100.0 * _REACH:g} % either way, chosen here, for tilt and coupled moments"
    return Range(value * (1.0 - _REACH), value * (1.0 + _REACH), what, chosen=True)
