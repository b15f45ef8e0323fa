"""Numbers of the paper that its other numbers give, or exclude."""

from collections.abc import Iterator

from spinepipe.comparison.claim import Claim
from spinepipe.comparison.gould_2024b.forms import contradicted, recomputed, rounded
from spinepipe.comparison.gould_2024b.paper import (
    COORDINATES,
    COUNTS,
    JOINTS,
    LOADED,
    MODELS,
    PAPER,
    SPECIMENS,
    TESTS,
    of_level,
    spread,
    table_4,
    uniform,
)

_RANGE = "section 3.2.1, Table 3"
_DISAGREES = "flexion"
_GENERIC_LEVEL = "L3L4"


def claims() -> Iterator[Claim]:
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
                f"fitted_range.{test}.{key}", _RANGE, words, unit, paper, ours,
                f"B8: Table 3 has {ours:.3g}, section 3.2.1 {paper:g}",
            )  # fmt: skip
        else:
            yield recomputed(
                f"fitted_range.{test}.{key}", _RANGE, words, unit, paper, rounded(paper, 1.0), ours,
                "B9: from Table 3; our own range is in table_3",
            )  # fmt: skip


def _relative_range() -> Claim:
    test = "left_axial_rotation"
    shares = {name: 100.0 * spread(test, name) / uniform(name) for name in COORDINATES}
    told = ", ".join(f"{name} {value:.0f} %" for name, value in shares.items())
    return contradicted(
        f"fitted_range.relative_largest_when_loaded.{test}", "section 3.1, Table 3",
        "the loaded coordinate's stiffness has the largest range, in its published value",
        "1: yes, 0: no", 1.0, float(max(shares, key=lambda name: shares[name]) == LOADED[test]),
        f"B10: Table 3 has {told}",
    )  # fmt: skip


def _gain(test: str) -> Claim:
    paper = float(PAPER["mae_drop_points"][test])
    before, after = (
        table_4(MODELS[0], test, stage, "median_percent") for stage in ("literature", "fitted")
    )
    return recomputed(
        f"mae_drop.per_specimen.{test}", "section 3.2.1, Table 4",
        "fall of the percentage from literature to fitted, per_specimen", "percentage points",
        paper, rounded(paper, 1.0), before - after, f"B11: {before:g} less {after:g}",
    )  # fmt: skip


def _generic_level(name: str) -> Claim:
    paper, ours = uniform(name), of_level(_GENERIC_LEVEL, name)
    kept = max(JOINTS, key=lambda joint: of_level(joint, name))
    return contradicted(
        f"level_ratio.{_GENERIC_LEVEL}.{name}", "section 2.4, Table 2",
        f"{name} stiffness of {_GENERIC_LEVEL}, said to be the generic one", "N m/rad", paper, ours,
        f"B12: Table 2 keeps the generic {paper:g} at the stiffest level, {kept}; {_GENERIC_LEVEL} "
        f"has {ours:g}",
    )  # fmt: skip


def _unit() -> Claim:
    value = float(PAPER["uniform_stiffness"]["anterior_n_per_m"])
    return contradicted(
        "uniform_stiffness.anterior", "Table 2", "anterior stiffness, like the other translations",
        "N/m", value, value, "B13: printed in Nm, the unit of a moment; stiffness has N/m",
    )  # fmt: skip


def _levels() -> Claim:
    paper = float(COUNTS["levels_tested"])
    return contradicted(
        "counts.levels_tested", "section 2.6", "levels that enter the tests", "count", paper,
        float(len(JOINTS)), f"B1: {len(JOINTS)} joints are modelled, {paper:g} levels are tested, "
        "the one left out is not named; B5 points to T12L1",
    )  # fmt: skip


def _counts() -> Iterator[Claim]:
    loads, models = len(TESTS), len(MODELS)
    products = {
        "cross_validations": (models * SPECIMENS * loads, "models, specimens, loads"),
        "signed_rank_tests": (loads * models * 2 * SPECIMENS,
                              "loads, models, comparisons, specimens; four have no p in Table 6, "
                              "their fits did not converge"),
        "signed_rank_pairs": (loads * int(COUNTS["levels_tested"]), "rotations, levels"),
        "representation_tests": (loads * (len(COORDINATES) + 1), "loads, rotations and overall"),
    }  # fmt: skip
    for name, (ours, what) in products.items():
        paper = float(COUNTS[name])
        yield recomputed(
            f"counts.{name}", "section 2.6", name.replace("_", " "), "count", paper,
            rounded(paper, 0.0), float(ours), f"product of {what}",
        )  # fmt: skip
