"""Table 7: do the errors of the two models differ?"""

from collections.abc import Callable, Iterator, Mapping
from itertools import product
from typing import Any

from scipy.stats import chi2

from spinepipe.comparison.claim import Claim, Ours
from spinepipe.comparison.gould_2024b.forms import contradicted, recomputed, rounded, yes_or_no
from spinepipe.comparison.gould_2024b.paper import COORDINATES, LOAD, P_BELOW, PAPER, PHANTOM, TESTS
from spinepipe.comparison.ranges import Range, factor_of_two
from spinepipe.comparison.run import NotComputed, Run
from spinepipe.comparison.tested import tested
from spinepipe.statistics import critical_h

WHERE = "Table 7"
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


def claims() -> Iterator[Claim]:
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
        f"table_7.{test}.{motion}", WHERE,
        f"Kruskal-Wallis: {motion} errors of fitted per_specimen and level_ratio differ under "
        f"{LOAD[test]}, p below {P_BELOW:g}", bool(printed), _significant(test, motion), _OUTSIDE,
        f"paper: {told}; {_PAIRED}",
    )  # fmt: skip


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
        f"{key}.h", WHERE, f"H of {words}", "H", h, factor_of_two(h), _statistic(test, motion),
        _OUTSIDE, _PAIRED,
    )  # fmt: skip
    ours = float(chi2.sf(h, _GROUPS - 1))
    yield recomputed(
        f"{key}.p", WHERE, f"p of H = {h:g} of {words}", "p", p, rounded(p, 0.01), ours,
        f"B17: chi-squared with {_GROUPS - 1} degree of freedom",
    )  # fmt: skip
    yield contradicted(
        f"{key}.decision", "section 3.4, Table 7", f"the models' {words} are said to differ",
        "1: yes, 0: no", 0.0, 1.0,
        f"B17: H = {h:g} is held against {float(_PRINTED['critical_h']):g}, but of two groups "
        f"{critical_h(_GROUPS, P_BELOW):.2f} is enough, as its p of {ours:.3f} shows",
    )  # fmt: skip


def _critical() -> Claim:
    paper, ours = float(_PRINTED["critical_h"]), critical_h(_GROUPS, P_BELOW)
    return Claim(
        "table_7.critical_h", WHERE, "critical H of two groups", "H", paper,
        Range(paper, paper, "the paper's value itself"), lambda run: Ours(ours), "",
        contradicted=f"B17: two groups have one degree of freedom, {ours:.2f}; {paper:g} is "
        f"that of three groups, {critical_h(_GROUPS + 1, P_BELOW):.2f}",
    )  # fmt: skip
