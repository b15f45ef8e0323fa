"""Tests of significance: Table 5, specimens and levels; Table 6, stages; Table 7, models."""

from collections.abc import Callable, Iterator, Mapping
from itertools import product
from typing import Any

from scipy.stats import chi2

from spinepipe.comparison.claim import (
    Claim,
    NotComputed,
    Ours,
    Range,
    Run,
    binomial,
    exactly,
    factor_of_two,
    tested,
)
from spinepipe.statistics import critical_h
from spinepipe.studies.cohort_stiffness.gould_2024b.paper import (
    COORDINATES,
    COUNTS,
    LITERATURE,
    LOAD,
    MODELS,
    NOT_BY_SPECIMEN,
    P_BELOW,
    PAPER,
    PHANTOM,
    SPECIMENS,
    STAGES,
    TESTS,
    YES_NO,
    contradicted,
    not_converged,
    recomputed,
    rounded,
    yes_or_no,
)

TABLE_5 = "Table 5"
TABLE_6 = "Table 6"
TABLE_7 = "Table 7"
COMPARISONS = ("literature_against_fitted", "fitted_against_left_out_specimen")
_GROUP_NAMES = {"level": "levels", "specimen": "specimens"}
_RESPONSES = ("loaded_error", "rotation_error")

_POWER = (
    PHANTOM + "; which differences are significant hangs on the size of the phantom's invented "
    "differences between levels, on six levels instead of five, and on noise"
)

_OUTSIDE_PAIRS = (
    PHANTOM
    + "; ours have 18 pairs of six levels instead of 15, and the phantom's errors are those "
    "of linear stiffness"
)

_PRINTED = PAPER["per_specimen_against_level_ratio"]
_MOTIONS = (*COORDINATES, "overall")
_GROUPS = 2

_PAIRED = (
    "B18: both models have the same specimens, so the values are paired, but were tested as "
    "independent"
)

_OUTSIDE = (
    PHANTOM
    + "; Table 2's ratios are far from the phantom's mild ones in all of its specimens alike"
)


def claims_of_group_tests() -> Iterator[Claim]:
    """The 36 cells, then where the text differs from them."""
    for test, model, group, stage in product(TESTS, MODELS, _GROUP_NAMES, STAGES):
        yield _cell_between(test, model, group, stage)
    yield from _contradicted()


def _printed_between(test: str, model: str, group: str, stage: str) -> str:
    """What the cell holds: ``p = 0.003``, ``p < 0.001``, or not significant."""
    loads = PAPER["kruskal_wallis"].get(test, {})
    return in_words(loads.get(model, {}).get(group, {}).get(stage, {}))


def _cell_between(test: str, model: str, group: str, stage: str) -> Claim:
    printed = _printed_between(test, model, group, stage)
    return yes_or_no(
        f"table_5.{test}.{model}.{group}.{stage}",
        TABLE_5,
        f"Kruskal-Wallis: errors under {LOAD[test]} differ between {_GROUP_NAMES[group]}, {model}, "
        f"{stage}",
        bool(printed),
        _significant_between(test, model, group, stage),
        _POWER,
        f"paper: {printed or 'not significant'}",
    )


def _significant_between(test: str, model: str, group: str, stage: str) -> Callable[[Run], Ours]:
    representation = LITERATURE[model] if stage == "literature" else model
    family = f"between_{_GROUP_NAMES[group]}/{representation}/{stage}"

    def ours(run: Run) -> Ours:
        where = {"family": family, "stratum": test, "response": _RESPONSES[0]}
        p = float(tested(run, "kruskal", **where)["p"].iloc[0])
        beside = "".join(_beside(run, family, test))
        return Ours(float(p < P_BELOW), note=f"ours: p = {p:.2g} of the loaded error{beside}")

    return ours


def _beside(run: Run, family: str, test: str) -> Iterator[str]:
    """The p of all three rotations, and of the test that fits complete blocks."""
    for name, response in (("kruskal", _RESPONSES[1]), ("friedman", _RESPONSES[0])):
        try:
            rows = tested(run, name, family=family, stratum=test, response=response)
        except NotComputed:
            continue
        what = "all three rotations" if name == "kruskal" else "Friedman's test"
        yield f"; {float(rows['p'].iloc[0]):.2g} of {what}"


def _contradicted() -> Iterator[Claim]:
    yield Claim(
        "section_3.between_specimens.literature",
        "section 3.2.1, Table 5",
        "errors of per_specimen under flexion differ between specimens with published stiffness",
        YES_NO,
        1.0,
        exactly(1.0),
        _significant_between("flexion", "per_specimen", "specimen", STAGES[0]),
        "",
        also=(exactly(0.0),),
        contradicted="B14: the text has this stage alone as significant, Table 5 has only the "
        f"left-out specimen ({_printed_between('flexion', MODELS[0], 'specimen', STAGES[2])})",
    )
    yield Claim(
        "section_3.between_levels.left_out_specimen",
        "section 3.3.1, Table 5",
        "errors of per_specimen under flexion differ between levels in a left-out specimen",
        YES_NO,
        0.0,
        exactly(0.0),
        _significant_between("flexion", "per_specimen", "level", STAGES[2]),
        "",
        also=(exactly(1.0),),
        contradicted="B15: the text has the fitted stage alone as significant, Table 5 this "
        f"one too ({_printed_between('flexion', MODELS[0], 'level', STAGES[2])})",
    )
    yield contradicted(
        "table_5.tested_coordinates",
        "section 2.6, Table 5",
        "coordinates whose errors are tested",
        "count",
        3.0,
        1.0,
        "B16: the caption has all three rotations, section 2.6 the loaded one alone; our Table 5 "
        "rows are of the loaded one and name the p of all three",
    )
    stated = float(COUNTS["kruskal_wallis_tests"])
    per_group = float(len(TESTS) * len(MODELS) * len(STAGES))
    yield contradicted(
        "table_5.tests_between_specimens",
        "section 2.6.2, Table 5",
        "Kruskal-Wallis tests between specimens",
        "count",
        stated,
        per_group,
        f"B19: {stated:g} are stated for specimens, but {len(TESTS)} loads, {len(MODELS)} models "
        f"and {len(STAGES)} stages make {per_group:g}; Table 5 has {stated:g} with levels counted",
    )


def claims_of_signed_rank() -> Iterator[Claim]:
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
        f"table_6.{comparison}.{model}.{test}",
        TABLE_6,
        f"specimens whose errors under {LOAD[test]} differ between {before} and {after}, {model}",
        "%",
        100.0 * significant / tests,
        binomial(significant, tests),
        _ours(comparison, model, test),
        _OUTSIDE_PAIRS,
        f"{NOT_BY_SPECIMEN}; printed: {values or 'no p'}",
    )


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
        "smallest_signed_rank_p",
        "section 2.6.4, Table 6",
        f"smallest p that {pairs} pairs can have, times {family}",
        "p",
        None,
        Range(None, bound, "below the smallest p that Table 6 prints"),
        ours,
        f"B20: {family} x 2 / 2^{pairs}",
    )


def _p(found: Mapping[str, float]) -> float:
    """A printed p, or what it is said to be below."""
    return float(found["p"] if "p" in found else found["p_below"])


def claims_of_model_tests() -> Iterator[Claim]:
    """The 12 cells, the printed H, and the critical H that does not belong to them."""
    for test, motion in product(TESTS, _MOTIONS):
        yield _cell(test, motion)
        printed = _printed(test, motion)
        if printed:
            yield from _of_h(test, motion, float(printed["p"]), float(printed["h"]))
    yield _critical()


def _printed(test: str, motion: str) -> Mapping[str, Any]:
    found: Mapping[str, Any] = _PRINTED.get(test, {}).get(motion, {})
    return found


def _cell(test: str, motion: str) -> Claim:
    printed = _printed(test, motion)
    told = f"p = {printed['p']:g}, H = {printed['h']:g}" if printed else "p not below 0.05"
    return yes_or_no(
        f"table_7.{test}.{motion}",
        TABLE_7,
        f"Kruskal-Wallis: {motion} errors of fitted per_specimen and level_ratio differ under "
        f"{LOAD[test]}, p below {P_BELOW:g}",
        bool(printed),
        _significant(test, motion),
        _OUTSIDE,
        f"paper: {told}; {_PAIRED}",
    )


def _rows(test: str, motion: str) -> dict[str, str]:
    return {
        "family": f"per_specimen_against_level_ratio/{test}",
        "response": f"{motion}_rmse",
        "stratum": "fitted",
    }


def _significant(test: str, motion: str) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        p = float(tested(run, "kruskal", **_rows(test, motion))["p"].iloc[0])
        return Ours(float(p < P_BELOW), note=f"ours: p = {p:.2g}{_paired(run, test, motion)}")

    return ours


def _paired(run: Run, test: str, motion: str) -> str:
    try:
        rows = tested(run, "wilcoxon", **_rows(test, motion))
    except NotComputed:
        return ""
    return f"; {float(rows['p'].iloc[0]):.2g} of Wilcoxon's signed rank test, which fits pairs"


def _statistic(test: str, motion: str) -> Callable[[Run], Ours]:
    return lambda run: Ours(
        float(tested(run, "kruskal", **_rows(test, motion))["statistic"].iloc[0])
    )


def _of_h(test: str, motion: str, p: float, h: float) -> Iterator[Claim]:
    key, words = f"table_7.{test}.{motion}", f"{motion} errors under {LOAD[test]}"
    yield Claim(
        f"{key}.h",
        TABLE_7,
        f"H of {words}",
        "H",
        h,
        factor_of_two(h),
        _statistic(test, motion),
        _OUTSIDE,
        _PAIRED,
    )
    ours = float(chi2.sf(h, _GROUPS - 1))
    yield recomputed(
        f"{key}.p",
        TABLE_7,
        f"p of H = {h:g} of {words}",
        "p",
        p,
        rounded(p, 0.01),
        ours,
        f"B17: chi-squared with {_GROUPS - 1} degree of freedom",
    )
    yield contradicted(
        f"{key}.decision",
        "section 3.4, Table 7",
        f"the models' {words} are said to differ",
        "1: yes, 0: no",
        0.0,
        1.0,
        f"B17: H = {h:g} is held against {float(_PRINTED['critical_h']):g}, but of two groups "
        f"{critical_h(_GROUPS, P_BELOW):.2f} is enough, as its p of {ours:.3f} shows",
    )


def _critical() -> Claim:
    paper, ours = float(_PRINTED["critical_h"]), critical_h(_GROUPS, P_BELOW)
    return Claim(
        "table_7.critical_h",
        TABLE_7,
        "critical H of two groups",
        "H",
        paper,
        Range(paper, paper, "the paper's value itself"),
        lambda run: Ours(ours),
        "",
        contradicted=f"B17: two groups have one degree of freedom, {ours:.2f}; {paper:g} is "
        f"that of three groups, {critical_h(_GROUPS + 1, P_BELOW):.2f}",
    )


def in_words(found: Mapping[str, float]) -> str:
    """A printed p of the paper, nothing where none is printed."""
    if "p_below" in found:
        return f"p < {float(found['p_below']):g}"
    return f"p = {float(found['p']):g}" if "p" in found else ""
