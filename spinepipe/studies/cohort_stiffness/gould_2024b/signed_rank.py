"""Table 6: do errors of a specimen differ between stages?"""

from collections.abc import Callable, Iterator, Mapping
from itertools import product

from spinepipe.comparison.claim import Claim, Ours
from spinepipe.comparison.gould_2024b.forms import recomputed
from spinepipe.comparison.gould_2024b.group_tests import in_words
from spinepipe.comparison.gould_2024b.paper import (
    COUNTS,
    LOAD,
    MODELS,
    NOT_BY_SPECIMEN,
    P_BELOW,
    PAPER,
    PHANTOM,
    SPECIMENS,
    TESTS,
    not_converged,
)
from spinepipe.comparison.ranges import Range, binomial
from spinepipe.comparison.run import Run
from spinepipe.comparison.tested import tested

WHERE = "Table 6"
COMPARISONS = ("literature_against_fitted", "fitted_against_left_out_specimen")
_OUTSIDE = (
    PHANTOM
    + "; ours have 18 pairs of six levels instead of 15, and the phantom's errors are those "
    "of linear stiffness"
)


def claims() -> Iterator[Claim]:
    """How many specimens differ, then the smallest p that can be."""
    for comparison, model, test in product(COMPARISONS, MODELS, TESTS):
        yield _share(comparison, model, test)
    yield _smallest_p()


def _share(comparison: str, model: str, test: str) -> Claim:
    printed = PAPER["signed_rank"][comparison][model].get(test, {})
    significant = sum(_p(found) < P_BELOW for found in printed.values())
    tests = SPECIMENS - len(not_converged(model, test))
    values = ", ".join(f"{name} {in_words(found)}" for name, found in printed.items())
    before, after = comparison.split("_against_")
    return Claim(
        f"table_6.{comparison}.{model}.{test}", WHERE,
        f"specimens whose errors under {LOAD[test]} differ between {before} and {after}, {model}",
        "%", 100.0 * significant / tests, binomial(significant, tests),
        _ours(comparison, model, test), _OUTSIDE,
        f"{NOT_BY_SPECIMEN}; printed: {values or 'no p'}",
    )  # fmt: skip


def _p(found: Mapping[str, float]) -> float:
    """A printed p, or what it is said to be below."""
    return float(found["p"] if "p" in found else found["p_below"])


def _ours(comparison: str, model: str, test: str) -> Callable[[Run], Ours]:
    family = f"signed_rank/{comparison}/{model}/{test}"

    def ours(run: Run) -> Ours:
        rows = tested(run, "wilcoxon", family=family, stratum=test, response="rotation_error")
        significant = rows["p_bonferroni"] < P_BELOW
        return Ours(
            100.0 * float(significant.mean()),
            note=f"ours: {int(significant.sum())} of {len(rows)}, "
            f"{int(rows['n'].min())} to {int(rows['n'].max())} pairs",
        )

    return ours


def _smallest_p() -> Claim:
    pairs, family = int(COUNTS["signed_rank_pairs"]), int(COUNTS["signed_rank_family"])
    ours = family * 2.0 / 2**pairs
    bound = min(
        float(found["p_below"])
        for comparison, model in product(COMPARISONS, MODELS)
        for load in PAPER["signed_rank"][comparison][model].values()
        for found in load.values()
        if "p_below" in found
    )
    return recomputed(
        "smallest_signed_rank_p", "section 2.6.4, Table 6",
        f"smallest p that {pairs} pairs can have, times {family}", "p", None,
        Range(0.0, bound, "below the smallest p that Table 6 prints"), ours,
        f"B20: {family} x 2 / 2^{pairs}",
    )  # fmt: skip
