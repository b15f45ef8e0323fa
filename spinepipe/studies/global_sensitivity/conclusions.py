"""What a study of global sensitivity concludes of its inputs; see conclusions.csv."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from math import atanh, sqrt, tanh
from typing import Any

import pandas as pd
from scipy.stats import norm

from spinepipe.cohort import Cohort
from spinepipe.report.conclusions import Conclusion, Value
from spinepipe.report.page.study_page import ResultTables
from spinepipe.report.words import capital, level, listed, plain
from spinepipe.sensitivity_analysis.global_indices.design import DUMMY
from spinepipe.sensitivity_analysis.global_indices.floor import NEGLIGIBLE
from spinepipe.studies.global_sensitivity.conclusions_of_base import of_base
from spinepipe.studies.global_sensitivity.outputs import (
    DONE,
    Measures,
    Output,
    factor_name,
    measures_of,
    outputs,
    with_results,
)
from spinepipe.studies.global_sensitivity.runs import runs_of
from spinepipe.studies.global_sensitivity.settings import GlobalSensitivity

HARDLY = 0.95
"""Sum of first-order indices from which on inputs act one by one."""

LEVEL = 0.05
"""Change of an index, as a part of the largest, that more runs may still make."""

_RANKS = ("first", "second", "third")
_PLACE = ["specimen", "output", "test", "step", "joint", "coordinate"]


def conclusions(
    study: GlobalSensitivity, cohort: Cohort, results: ResultTables
) -> Iterator[Conclusion]:
    """All of them."""
    indices = results.table("indices")
    measures = measures_of(indices)
    found = outputs(cohort, indices, measures) if measures else []
    if not measures or not found:
        yield Conclusion("leading", "no_index", names={"why": _why(indices)})
    else:
        joints = cohort.joint_names
        yield _leading(found[0], measures, joints)
        yield from _shares(found[0], measures)
        yield from (_load(one, measures, joints) for one in found[1:])
        if measures.of_variance:
            yield from _interaction(found[0], measures)
            yield _negligible(found[0], with_results(indices, measures), measures)
        yield from _direction(found[0], measures, results, cohort)
        yield from _convergence(found, measures, results.table("convergence"), joints)
    yield from _without(indices)
    yield from of_base(study, results)
    verdict = "ok" if study.dummy else "check"
    yield Conclusion("dummy", verdict)
    # members of a group have one index together
    count = Value(len(study.compared) - study.dummy, source="settings: factors and groups")
    runs = Value(study.n_runs, source="settings: design")
    yield Conclusion("spreads", "given", {"factors": count})
    yield Conclusion("methods", study.design.method, {"factors": count, "runs": runs})


def _value(row: Mapping[str, Any], measures: Measures, unit: str, index: str) -> Value:
    """An index: a share in percent, an effect in its unit, any other as a number."""
    scale, said = (100.0, "%") if measures.of_variance else (1.0, unit if measures.in_units else "")
    low, high = (None if pd.isna(row[end]) else scale * row[end] for end in ("low", "high"))
    source = f"indices: {index} of {row['factor']}, mean over joints and specimens"
    return Value(scale * row["estimate"], said, low, high, int(row["n"]), source)


def _seen(output: Output, measures: Measures) -> set[str]:
    """Factors above the noise floor at some place, or all where there is no floor."""
    main = output.rows[output.rows["index"] == measures.main]
    if not main["noise_floor"].notna().any():
        return set(main["factor"])
    return set(main.loc[main["above_floor"].eq(True), "factor"])


def _overlap(rows: Sequence[Mapping[str, Any]]) -> bool:
    """Whether intervals of the first two reach each other; those without any are in order."""
    return len(rows) > 1 and bool(rows[0]["low"] <= rows[1]["high"])


def _clear(parts: Sequence[Output], index: str) -> dict[str, int]:
    """Factors that lead with an interval apart from the next, and at how many parts."""
    found: dict[str, int] = {}
    for one in parts:
        rows = one.ordered(index)
        if rows and not _overlap(rows):
            found[rows[0]["factor"]] = found.get(rows[0]["factor"], 0) + 1
    return dict(sorted(found.items(), key=lambda item: -item[1]))


def _leads(output: Output, measures: Measures, joints: Sequence[str]) -> Conclusion | None:
    """That other factors lead at other joints, or in other specimens; None where none do."""
    single = output.by_joint(joints)
    names = dict.fromkeys(output.rows["specimen"])
    each = [replace(output, rows=output.rows[output.rows["specimen"] == name]) for name in names]
    for verdict, parts, what in (
        ("by_specimen", each, "specimens"),
        ("by_joint", single, "joints"),
    ):
        clear = _clear(parts, measures.main)
        if len(clear) > 1:
            first, *others = clear
            values = {
                "places": Value(clear[first], source=f"indices: {what} that it leads"),
                what: Value(len(parts), source=f"indices: {what}"),
            }
            told = {"first": factor_name(first), "second": listed(map(factor_name, others), 2)}
            return Conclusion("leading", verdict, values, {"output": output.words, **told})
    return None


def _leading(output: Output, measures: Measures, joints: Sequence[str]) -> Conclusion:
    """What the first output depends on most."""
    names = {"output": output.words}
    rows = output.ordered(measures.main)
    if not rows or rows[0]["factor"] not in _seen(output, measures):
        return Conclusion("leading", "none", names=names)
    if (differing := _leads(output, measures, joints)) is not None:
        return differing
    names["first"] = factor_name(rows[0]["factor"])
    values = {"share": _value(rows[0], measures, output.unit, measures.main)}
    without = bool(pd.isna(rows[0]["low"]))
    if len(rows) > 1 and (without or _overlap(rows)):
        names["second"] = factor_name(rows[1]["factor"])
        values["share2"] = _value(rows[1], measures, output.unit, measures.main)
        return Conclusion("leading", "order_only" if without else "overlap", values, names)
    single = output.by_joint(joints)
    if measures.alone and (output.rows["index"] == measures.alone).any():
        alone = _clear(single, measures.alone)
        others = [name for name in alone if name != rows[0]["factor"]]
        if others:
            names["alone"] = factor_name(others[0])
            source = "indices: joints that it leads at, alone"
            values["places"] = Value(alone[others[0]], source=source)
            values["joints"] = Value(len(single), source="indices: joints")
            return Conclusion("leading", "with_others", values, names)
    return Conclusion("leading", "clear", values, names)


def _shares(output: Output, measures: Measures) -> Iterator[Conclusion]:
    """The three largest indices as key numbers."""
    said = {"output": output.words, "measure": _MEASURE[measures.main]}
    for rank, row in zip(_RANKS, output.ordered(measures.main), strict=False):
        value = _value(row, measures, output.unit, measures.main)
        names = {**said, "factor": factor_name(row["factor"])}
        yield Conclusion("share", rank, {"value": value}, names)


_MEASURE = {
    "ST": "share of the variance, alone or with others",
    "mu_star": "mean change from lowest to highest value",
    "PAWN": "how far it moves the distribution, 0 to 1",
}


def _load(output: Output, measures: Measures, joints: Sequence[str]) -> Conclusion:
    """What a further output depends on most."""
    names = {"output": output.words}
    rows = output.ordered(measures.main)
    if not rows or rows[0]["factor"] not in _seen(output, measures):
        return Conclusion("load", "none", names=names)
    differing = _leads(output, measures, joints)
    if differing is not None and differing.verdict == "by_joint":
        return replace(differing, rule="load")
    names["first"] = factor_name(rows[0]["factor"])
    values = {"share": _value(rows[0], measures, output.unit, measures.main)}
    if not _overlap(rows):
        return Conclusion("load", "one", values, names)
    values["share2"] = _value(rows[1], measures, output.unit, measures.main)
    second = {"second": factor_name(rows[1]["factor"])}
    return Conclusion("load", "overlap", values, {**names, **second})


def _interaction(output: Output, measures: Measures) -> Iterator[Conclusion]:
    """How much of the variance inputs make alone, and how much only together."""
    alone = output.ordered(measures.alone)
    if alone:
        share = sum(float(row["estimate"]) for row in alone)
        source = f"indices: sum of {measures.alone}, mean over joints and specimens"
        value = Value(100.0 * min(share, 1.0), "%", n=len(alone), source=source)
        verdict = "little" if share >= HARDLY else "much"
        yield Conclusion("interaction", verdict, {"share": value}, {"output": output.words})


def _negligible(first: Output, rows: pd.DataFrame, measures: Measures) -> Conclusion:
    """Inputs whose total index lies below 1 % in every output there is, else in the first."""
    for verdict, part in (("some", rows), ("of_first", first.rows)):
        main = part[(part["index"] == measures.main) & (part["factor"] != DUMMY)]
        if not main["negligible"].notna().any():
            return Conclusion("negligible", "not_asked")
        everywhere = main.groupby("factor", sort=False)["negligible"].all()
        names = [factor_name(str(name)) for name in everywhere[everywhere].index]
        if names:
            values = {
                "count": Value(len(names), source="indices: negligible at every joint"),
                "factors": Value(len(everywhere), source="indices: factors"),
                "outputs": Value(len(main[_PLACE].drop_duplicates()), source="indices: outputs"),
                "limit": Value(100.0 * NEGLIGIBLE, "%", source="rule: negligible"),
            }
            told = {"names": capital(listed(names, len(names))), "output": first.words}
            return Conclusion("negligible", verdict, values, told)
    return Conclusion("negligible", "none")


def _direction(
    output: Output, measures: Measures, results: ResultTables, cohort: Cohort
) -> Iterator[Conclusion]:
    """Whether the output rises or falls with what it depends on most.

    Spearman's rank correlation with Fisher's interval, whose variance 1.06 / (n - 3) is that of
    Fieller, Hartley and Pearson, Biometrika 44 (1957).
    """
    responses, design = results.table("responses"), results.table("design")
    if responses.empty or design.empty or output.kind == "stiffness":
        return
    found = runs_of(output, responses, design, measures)
    if found is None or not found.factors or len(found.values) < 5:
        return
    drawn = found.drawn(found.factors[0])
    size = found.values.abs()  # flexion is negative extension: the size is told of
    rank = float(drawn.corr(size, method="spearman"))
    if pd.isna(rank):  # either of them is constant
        return
    # designs repeat values: runs that share one are no independent readings of it
    n = int(drawn.nunique())
    half = norm.ppf(0.975) * sqrt(1.06 / max(n - 3, 1))
    centre = atanh(max(-0.999999, min(0.999999, rank)))
    low, high = tanh(centre - half), tanh(centre + half)
    verdict = "bent" if low <= 0.0 <= high else "rises" if rank > 0.0 else "falls"
    source = "responses and design: Spearman's rank correlation"
    names = {
        "joint": level(found.joint),
        "output": output.words,
        "first": factor_name(found.factors[0]),
    }
    value = Value(rank, "", low, high, n, source)
    yield Conclusion("direction", verdict, {"rank": value}, names)


def _convergence(
    found: Sequence[Output], measures: Measures, grown: pd.DataFrame, joints: Sequence[str]
) -> Iterator[Conclusion]:
    """How far indices of the three leading factors moved from the last part to all runs."""
    rows = with_results(grown, measures) if len(grown) else grown
    if rows.empty or rows["runs"].nunique() < 2:
        return
    changes = []
    for one in (single for output in found for single in output.by_joint(joints)):
        factors = [row["factor"] for row in one.ordered(measures.main)[:3]]
        own = one.of(rows).rows
        own = own[(own["index"] == measures.main) & own["factor"].isin(factors)]
        parts = own.pivot_table(index="factor", columns="runs", values="estimate").dropna()
        if parts.shape[1] > 1 and len(parts):
            late, early = parts.iloc[:, -1], parts.iloc[:, -2]
            largest = float(late.abs().max()) or 1.0
            changes.append((float((late - early).abs().max()) / largest, parts.columns[-2:]))
    if not changes:
        return
    change, runs = max(changes, key=lambda one: one[0])
    values = {
        "change": Value(100.0 * change, "%", source="convergence: last part against all runs"),
        "before": Value(int(runs[0]), source="convergence: runs"),
        "runs": Value(int(runs[1]), source="convergence: runs"),
    }
    yield Conclusion("convergence", "level" if change <= LEVEL else "moving", values)


def _why(indices: pd.DataFrame) -> str:
    lost = indices[~indices["status"].isin((DONE, "constant"))] if len(indices) else indices
    reasons = [text for text in lost.get("message", pd.Series(dtype=str)).unique() if text]
    return plain(str(reasons[0])) if reasons else "no run has a result"


def _without(indices: pd.DataFrame) -> Iterator[Conclusion]:
    """Outputs that have no index; those that vary with nothing are no loss."""
    if indices.empty:
        return
    vary = indices[indices["status"] != "constant"]
    every = Value(len(vary[_PLACE].drop_duplicates()), source="indices: outputs that vary")
    lost = indices[~indices["status"].isin((DONE, "constant"))]
    if lost.empty:
        yield Conclusion("without", "ok", {"outputs": every})
        return
    missing = Value(len(lost[_PLACE].drop_duplicates()), source="indices: status")
    values = {"outputs": every, "lost": missing}
    yield Conclusion("without", "check", values, {"why": _why(indices)})
