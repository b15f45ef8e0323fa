"""Numbers of the paper that its others give or exclude, and the size and cost of its study."""

from collections.abc import Callable, Iterator

from spinepipe.comparison.claim import Claim, NotComputed, Ours, Range, Run, Verdict, exactly
from spinepipe.studies.cohort_stiffness.gould_2024b.paper import (
    COORDINATES,
    COUNTS,
    JOINTS,
    LOADED,
    MODELS,
    PAPER,
    SPECIMENS,
    TESTS,
    contradicted,
    of_level,
    recomputed,
    rounded,
    spread,
    table_4,
    uniform,
)

_RANGE = "section 3.2.1, Table 3"
_DISAGREES = "flexion"
_GENERIC_LEVEL = "L3L4"
_WHERE = "sections 2.4, 2.6"
_BUILT = "the cohort and the study were set up to have it"

_EXACT_DERIVATIVES = (
    "ours solves for equilibrium and knows its derivatives, so that a fit needs a few evaluations"
)


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
