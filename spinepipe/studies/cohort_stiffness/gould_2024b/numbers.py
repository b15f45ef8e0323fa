"""Measured motion that Tables 2 and 4 imply without printing it.

Numbers of the paper that its other numbers give, or exclude.

Motion that follows from the moment and the published stiffness.

Size of the paper's study, and what a fit costs.
"""

from collections.abc import Callable, Iterator
from itertools import product
from math import degrees
from statistics import median

from spinepipe.comparison.claim import Claim, NotComputed, Ours, Range, Run, Verdict, exactly
from spinepipe.studies.cohort_stiffness.gould_2024b.paper import (
    COORDINATES,
    COUNTS,
    JOINTS,
    LOAD,
    LOADED,
    LOWER_FIVE,
    MODELS,
    MOMENT_NM,
    PAPER,
    PHANTOM,
    PUT_IN,
    SPECIMENS,
    TESTS,
    contradicted,
    errors,
    largest_motion,
    of_level,
    predicted,
    recomputed,
    rounded,
    spread,
    table_3,
    table_4,
    uniform,
)

_RANGE = "section 3.2.1, Table 3"
_DISAGREES = "flexion"
_GENERIC_LEVEL = "L3L4"


def claims_of_own_numbers() -> Iterator[Claim]:
    """Ranges, gains, the level that keeps its stiffness, counts."""
    for test in TESTS:
        yield from _range(test)
    yield _relative_range()
    for test in TESTS:
        yield _gain(test)
    for name in ("right_bending", "extension"):
        yield _generic_level(name)
    yield _unit()
    yield _levels()
    yield from _counts()


def _range(test: str) -> Iterator[Claim]:
    """Largest less smallest in the loaded coordinate, and in that of the literature."""
    printed, name = PAPER["fitted_range"][test], LOADED[test]
    width = spread(test, name)
    share = 100.0 * width / uniform(name)
    cells = (("nm_per_rad", "N m/rad", width), ("percent_of_literature", "% of published", share))
    for key, unit, ours in cells:
        paper, words = float(printed[key]), f"range of the fitted {name} stiffness, per_specimen"
        if test == _DISAGREES:
            yield contradicted(
                f"fitted_range.{test}.{key}",
                _RANGE,
                words,
                unit,
                paper,
                ours,
                f"B8: Table 3 has {ours:.3g}, section 3.2.1 {paper:g}",
            )
        else:
            yield recomputed(
                f"fitted_range.{test}.{key}",
                _RANGE,
                words,
                unit,
                paper,
                rounded(paper, 1.0),
                ours,
                "B9: from Table 3; our own range is in table_3",
            )


def _relative_range() -> Claim:
    test = "left_axial_rotation"
    shares = {name: 100.0 * spread(test, name) / uniform(name) for name in COORDINATES}
    told = ", ".join(f"{name} {value:.0f} %" for name, value in shares.items())
    return contradicted(
        f"fitted_range.relative_largest_when_loaded.{test}",
        "section 3.1, Table 3",
        "the loaded coordinate's stiffness has the largest range, in its published value",
        "1: yes, 0: no",
        1.0,
        float(max(shares, key=lambda name: shares[name]) == LOADED[test]),
        f"B10: Table 3 has {told}",
    )


def _gain(test: str) -> Claim:
    paper = float(PAPER["mae_drop_points"][test])
    before, after = (
        table_4(MODELS[0], test, stage, "median_percent") for stage in ("literature", "fitted")
    )
    return recomputed(
        f"mae_drop.per_specimen.{test}",
        "section 3.2.1, Table 4",
        "fall of the percentage from literature to fitted, per_specimen",
        "percentage points",
        paper,
        rounded(paper, 1.0),
        before - after,
        f"B11: {before:g} less {after:g}",
    )


def _generic_level(name: str) -> Claim:
    paper, ours = uniform(name), of_level(_GENERIC_LEVEL, name)
    kept = max(JOINTS, key=lambda joint: of_level(joint, name))
    return contradicted(
        f"level_ratio.{_GENERIC_LEVEL}.{name}",
        "section 2.4, Table 2",
        f"{name} stiffness of {_GENERIC_LEVEL}, said to be the generic one",
        "N m/rad",
        paper,
        ours,
        f"B12: Table 2 keeps the generic {paper:g} at the stiffest level, {kept}; {_GENERIC_LEVEL} "
        f"has {ours:g}",
    )


def _unit() -> Claim:
    value = float(PAPER["uniform_stiffness"]["anterior_n_per_m"])
    return contradicted(
        "uniform_stiffness.anterior",
        "Table 2",
        "anterior stiffness, like the other translations",
        "N/m",
        value,
        value,
        "B13: printed in Nm, the unit of a moment; stiffness has N/m",
    )


def _levels() -> Claim:
    paper = float(COUNTS["levels_tested"])
    return contradicted(
        "counts.levels_tested",
        "section 2.6",
        "levels that enter the tests",
        "count",
        paper,
        float(len(JOINTS)),
        f"B1: {len(JOINTS)} joints are modelled, {paper:g} levels are tested, "
        "the one left out is not named; B5 points to T12L1",
    )


def _counts() -> Iterator[Claim]:
    loads, models = len(TESTS), len(MODELS)
    products = {
        "cross_validations": (models * SPECIMENS * loads, "models, specimens, loads"),
        "signed_rank_tests": (
            loads * models * 2 * SPECIMENS,
            "loads, models, comparisons, specimens; four have no p in Table 6, "
            "their fits did not converge",
        ),
        "signed_rank_pairs": (loads * int(COUNTS["levels_tested"]), "rotations, levels"),
        "representation_tests": (loads * (len(COORDINATES) + 1), "loads, rotations and overall"),
    }
    for name, (ours, what) in products.items():
        paper = float(COUNTS[name])
        yield recomputed(
            f"counts.{name}",
            "section 2.6",
            name.replace("_", " "),
            "count",
            paper,
            rounded(paper, 0.0),
            float(ours),
            f"product of {what}",
        )


WHERE = "Table 2"
OVER_PREDICTED = ("left_lateral_bending", "flexion")
_REACH = 0.1
_TURNED = (
    "the formula leaves out weight, whose arm grows as the column bends (the phantom's T12 carries "
    "a pot of 1 kg): without it the same model is within 3 % of the formula"
)


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
    return Range(value * (1.0 - _REACH), value * (1.0 + _REACH), what)


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


_ROUNDING_DEG = 0.1
"""Two medians printed to 0.1 deg, half a digit each."""


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


_WHERE = "sections 2.4, 2.6"
_BUILT = "the cohort and the study were set up to have it"
_EXACT_DERIVATIVES = (
    "ours solves for equilibrium and knows its derivatives, so that a fit needs a few evaluations"
)


def claims_of_set_up() -> Iterator[Claim]:
    """Specimens, joints, unknowns, pairs, values; then iterations and hours."""
    built = Verdict.CIRCULAR
    yield _count("specimens", "specimens", _distinct("specimen"), evidence=built)
    yield _count("joints", "joints", _distinct("joint"), evidence=built)
    yield _count(
        "fitted_parameters",
        "unknowns of a fit, per_specimen",
        _unknowns("per_specimen"),
        evidence=built,
    )
    yield _count(
        "fitted_parameters_level_by_level",
        "unknowns of a fit, joint by joint",
        _unknowns("per_joint"),
        "the paper ran no such fit",
        built,
    )
    yield _count(
        "representation_values",
        "values per model in Table 7, axial rotation apart",
        _values("flexion"),
        evidence=built,
    )
    yield _count(
        "representation_values_in_axial_rotation",
        "values per model in Table 7, axial rotation",
        _values("left_axial_rotation"),
        "two fits of the paper did not converge; all of ours did",
        built,
    )
    yield from _cost()


def _count(
    name: str,
    quantity: str,
    ours: Callable[[Run], Ours],
    note: str = "",
    evidence: Verdict = Verdict.INSIDE,
) -> Claim:
    paper = float(COUNTS[name])
    return Claim(
        f"counts.{name}",
        _WHERE,
        quantity,
        "count",
        paper,
        exactly(paper),
        ours,
        "this study is not of the paper's size",
        note or _BUILT,
        evidence=evidence,
    )


def _distinct(column: str) -> Callable[[Run], Ours]:
    return lambda run: Ours(float(run.rows("stiffness")[column].nunique()))


def _unknowns(representation: str) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        found = run.rows("fits", representation=representation)["unknowns"]
        return Ours(float(found.median()), float(found.min()), float(found.max()))

    return ours


def _values(test: str) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        ended = []
        for name in ("per_specimen", "level_ratio"):
            rows = run.rows("fits", representation=name, fitted_to=test)
            ended.append(set(rows.loc[rows["status"].str.startswith("converged"), "specimen"]))
        return Ours(float(len(set.intersection(*ended))))

    return ours


def _cost() -> Iterator[Claim]:
    printed = PAPER["cost_of_a_fit"]
    iterations = float(printed["dynamic_iterations_above"])
    yield Claim(
        "cost.iterations",
        "section 2.4",
        "iterations of a fit, per_specimen, median",
        "count",
        iterations,
        Range(iterations, None, "above the paper's bound"),
        _iterations,
        _EXACT_DERIVATIVES,
    )
    for name in ("preliminary_hours_above", "dynamic_iteration_hours_above"):
        hours = float(printed[name])
        yield Claim(
            f"cost.{name.removesuffix('_above')}",
            "section 2.4",
            "time of a fit" if name.startswith("pre") else "time of an iteration",
            "h",
            hours,
            Range(hours, None, "above the paper's bound"),
            _time,
            _EXACT_DERIVATIVES,
        )


def _iterations(run: Run) -> Ours:
    counts = run.rows("fits", representation="per_specimen")["iterations"]
    return Ours(float(counts.median()), float(counts.min()), float(counts.max()))


def _time(run: Run) -> Ours:
    raise NotComputed("no result table holds times, they differ between computers")
