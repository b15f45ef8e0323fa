"""Key findings of a sensitivity study as sentences: what drives an output, and how sure that is."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.report.page.document import Headline, ResultTables
from spinepipe.report.words import capital, count, fixed, listed, number
from spinepipe.sensitivity_analysis.global_indices.design import DUMMY
from spinepipe.sensitivity_analysis.global_indices.floor import NEGLIGIBLE
from spinepipe.studies.global_sensitivity.figures.panels import (
    DONE,
    NAME,
    OUTPUT,
    Measures,
    Panel,
    above_floor,
    by_joint,
    factor_name,
    leading,
    pool,
    shown_outputs,
    unit_of,
    what,
    where,
    whole,
    with_results,
)
from spinepipe.studies.global_sensitivity.settings import GlobalSensitivity
from spinepipe.studies.global_sensitivity.soundness import cautions, starting_spine

Record = dict[str, Any]

LEFT_OUT = {
    "sobol": "with a failed run its whole base sample is left out",
    "morris": "with a failed run its whole trajectory is left out",
    "latin_hypercube": "a failed run is left out by itself",
    "fast": "with a failed run its factor has no index: a curve with a gap is no curve",
}
"""What is done with failed runs, by design."""

MOST_OUTPUTS = 12
MOST_NAMED, MOST_JOINTS, MOST_NEGLIGIBLE = 3, 6, 8

WORTH_NAMING = 0.1
"""Part of the first factor's index from which on another is named beside it."""

HARDLY = 0.95
"""Sum of first-order indices from which on there is hardly any interaction."""

DOUBTFUL = ("too_many_failed", "too_few")
"""Why an output has no index, where that casts doubt on the study."""

RESTS_ON = ("base_stiffness", "base_motion", "failed_runs")
"""Tables of what the indices rest on."""

_PLACE = ["specimen", "output", "test", "step", "joint", "coordinate"]
_LEADING = 3
_SMALL = 0.01

_STATUS = {
    "constant": "vary with no factor and have no index",
    "too_many_failed": "have no index, or not of every factor: too many runs failed",
    "too_few": "have no index: too few runs are left",
}

_MEANING = {
    "ST": "share of the variance, alone and with other factors",
    "mu_star": "mean change from a factor's lowest to its highest value",
    "PAWN": "PAWN, how far a factor moves the distribution, 0 to 1",
}

_EXACT = {
    "sobol": "In a sobol design runs that differ in the dummy alone are equal: S1 and ST of a "
    "factor without any effect are 0, and their floor is what the solver leaves open. A factor may "
    "still be negligible (interval of ST below 1 %).",
    "morris": "In a morris design runs that differ in the dummy alone are equal: its indices are "
    "0, and their floor is what the solver leaves open.",
    "fast": "FAST has no intervals, so no factor is called negligible.",
}
"""What the dummy can say in these designs."""


def opening(study: GlobalSensitivity, cohort: Cohort, results: ResultTables) -> Headline:
    """The leading factors in a sentence, how sure they are, and what casts doubt on them."""
    indices = results.table("indices")
    found, measures = shown_outputs(cohort, indices)
    words = most(found, measures, cohort.joint_names) if measures else ""
    sure = [runs(study, indices)]
    if measures:
        grown = results.table("convergence")
        sure.append(settled(grown, found, measures, cohort.joint_names))
        if indices["ci_low"].notna().any():
            sure.append(f"In brackets: {100.0 * study.confidence:g} % confidence intervals.")
    warned = [words for status, words in without(indices) if status in DOUBTFUL]
    warned += cautions(study, *(results.table(name) for name in RESTS_ON))
    return Headline(
        words or "No output has an index.", " ".join(part for part in sure if part), tuple(warned)
    )


def findings(study: GlobalSensitivity, cohort: Cohort, results: ResultTables) -> list[str]:
    """A sentence or two for each output, then interactions and outputs without an index."""
    indices = results.table("indices")
    found, measures = shown_outputs(cohort, indices)
    shown = found[:MOST_OUTPUTS] if measures else []
    told = [driver(panel, measures, cohort.joint_names) for panel in shown if measures]
    told += starting_spine(study, *(results.table(name) for name in RESTS_ON[:2]))
    if len(found) > MOST_OUTPUTS:
        told.append(f"{count(len(found) - MOST_OUTPUTS, 'more output')}: see the tables.")
    told.append(pairs(indices, found))
    told += [words for status, words in without(indices) if status not in DOUBTFUL]
    nothing = "There is no dummy factor (dummy: false), so nothing tells an index from noise."
    told.append(_EXACT.get(study.design.method, "") if study.dummy else nothing)
    return [sentence for sentence in told if sentence]


def most(panels: Sequence[Panel], measures: Measures, joints: Sequence[str]) -> str:
    """``Motion hangs most on stiffness, joint load on load size.``: over all tests and joints."""
    parts: list[str] = []
    for output in OUTPUT:
        own = [panel for panel in panels if panel.output == output]
        first = [_ordered(one, measures)[0] for panel in own for one in by_joint(panel, joints)]
        names = list(dict.fromkeys(factor_name(row["factor"]) for row in first))
        if names:
            verb = "" if parts else " hangs most"
            by = ", by test and joint" if len(names) > 1 else ""
            parts.append(f"{OUTPUT[output]}{verb} on {listed(names, MOST_NAMED, 'or')}{by}")
    return capital(f"{'; '.join(parts)}.") if parts else ""


def driver(panel: Panel, measures: Measures, joints: Sequence[str]) -> str:
    """Leading factors of one output with their intervals, how sure their order is, the rest."""
    own = _ordered(panel, measures)
    head = f"{where(panel.test, panel.joint)}, " if panel.test else ""
    single = by_joint(panel, joints)
    leaders = {_ordered(one, measures)[0]["factor"] for one in single}
    told = [f"{head}{what(panel.output, panel.coordinate)} ({_MEANING[measures.main]}):"]
    if len(leaders) == 1:
        told += [_first(panel, own, measures), _order(own)]
    else:
        told.append(_each(single, measures))
    told += [_alone(panel, measures), *_nothing(panel, own, measures)]
    return capital(" ".join(part for part in told if part)).replace(" %", "\u00a0%")


def _main(panel: Panel, measures: Measures) -> pd.DataFrame:
    return panel.rows[panel.rows["index"] == measures.main]


def _ordered(panel: Panel, measures: Measures) -> list[Record]:
    """Factors but for the dummy, the largest index first."""
    rows = pool(_main(panel, measures), ["factor"])
    ordered = rows[rows["factor"] != DUMMY].sort_values("estimate", ascending=False, kind="stable")
    return [{str(name): cell for name, cell in row.items()} for row in ordered.to_dict("records")]


def _seen(panel: Panel, measures: Measures) -> set[str]:
    """Factors above the noise floor, or all where there is none."""
    main = _main(panel, measures)
    return above_floor(main) if main["noise_floor"].notna().any() else set(main["factor"])


def _first(panel: Panel, own: Sequence[Record], measures: Measures) -> str:
    """The factors worth naming."""
    seen = _seen(panel, measures)
    named = [
        row
        for row in own[:MOST_NAMED]
        if row["factor"] in seen and row["estimate"] >= WORTH_NAMING * own[0]["estimate"]
    ]
    if not named:
        return "no factor is above the dummy."
    parts = [f"{factor_name(row['factor'])} {with_ends(row, panel, measures)}" for row in named]
    over = f"; means over {count(panel.places, 'place')}" if panel.places > 1 else ""
    return f"{listed(parts)}{over}."


def _each(single: Sequence[Panel], measures: Measures) -> str:
    """The leading factor of each joint."""
    parts = []
    for one in single[:MOST_JOINTS]:
        row = _ordered(one, measures)[0]
        name = factor_name(row["factor"])
        parts.append(f"at {one.joint} {name} {with_ends(row, one, measures)}")
    more = len(single) - len(parts)
    return f"{listed(parts, MOST_JOINTS)}{f'; {more} more joints' if more else ''}."


def _order(own: Sequence[Record]) -> str:
    """Whether the intervals of the first two are apart."""
    if len(own) < 2 or pd.isna([own[0]["low"], own[1]["high"]]).any():
        return ""
    if own[0]["low"] > own[1]["high"]:
        return ""
    first, second = (factor_name(row["factor"]) for row in own[:2])
    return f"The intervals of {first} and {second} overlap: their order is not sure."


def _alone(panel: Panel, measures: Measures) -> str:
    """How much is left to interactions."""
    first = panel.rows[panel.rows["index"] == "S1"]
    if not measures.of_variance or first.empty:
        return ""
    share = float(pool(first, ["factor"])["estimate"].sum())
    if share >= HARDLY:
        return "There is hardly any interaction."
    return f"Alone, the factors make up {value(share, panel, measures)}; the rest is interaction."


def _nothing(panel: Panel, own: Sequence[Record], measures: Measures) -> Iterator[str]:
    """Factors that do nothing that can be seen, and those that do little."""
    seen = _seen(panel, measures)
    hidden = [factor_name(row["factor"]) for row in own if row["factor"] not in seen]
    if hidden:
        yield f"Not above the dummy: {listed(hidden)}."
    if measures.of_variance and _main(panel, measures)["negligible"].notna().any():
        yield from _screened(panel, own, measures)


def _screened(panel: Panel, own: Sequence[Record], measures: Measures) -> Iterator[str]:
    """Factors that may be fixed, and small ones of which that is not shown."""
    main = _main(panel, measures)
    everywhere = main.groupby("factor", sort=False)["negligible"].all()
    fixable = [row for row in own if everywhere[row["factor"]]]
    if fixable:
        places = " at every joint" if panel.places > 1 else ""
        names = listed([factor_name(row["factor"]) for row in fixable], MOST_NEGLIGIBLE)
        yield f"Negligible (interval below 1 %{places}): {names}."
    small = [row for row in own if row["estimate"] < NEGLIGIBLE and row not in fixable]
    if small:
        names = listed([factor_name(row["factor"]) for row in small])
        yield f"Small, but not shown to be negligible: {names}."


def value(size: float, panel: Panel, measures: Measures) -> str:
    """A share as a percentage, an effect in its unit, any other index as a number."""
    return _number(size, measures) + _unit(panel, measures)


def with_ends(row: Mapping[str, Any], panel: Panel, measures: Measures) -> str:
    """``71 % [66 to 76 %; at single places 55 to 80 %]``: a row of `pooled`."""
    parts = [_range(row["low"], row["high"], panel, measures)]
    if row["places"] > 1:
        single = _range(row["lowest"], row["highest"], panel, measures)
        parts.append(single and f"at single places {single}")
    inside = "; ".join(part for part in parts if part)
    size = value(row["estimate"], panel, measures)
    return f"{size} [{inside}]" if inside else size


def _range(low: float, high: float, panel: Panel, measures: Measures) -> str:
    """Both ends; nothing where they are not known or read alike."""
    if not np.isfinite([low, high]).all():
        return ""
    first, last = (_number(end, measures) for end in (low, high))
    return f"{first} to {last}{_unit(panel, measures)}" if first != last else ""


def _number(size: float, measures: Measures) -> str:
    if measures.in_units:
        return number(size)
    if measures.of_variance:
        return fixed(100.0 * size, 1 if 0.0 < abs(size) < _SMALL else 0)
    return fixed(size)


def _unit(panel: Panel, measures: Measures) -> str:
    if measures.of_variance:
        return " %"
    unit = unit_of(panel.output, panel.coordinate) if measures.in_units else ""
    return unit if unit in ("", "°") else f" {unit}"


def pairs(indices: pd.DataFrame, panels: Sequence[Panel]) -> str:
    """The strongest interactions of two factors in these outputs that stand out of their noise."""
    every = indices[(indices["index"] == "S2") & (indices["status"] == DONE)]
    if every.empty:
        return ""
    rows = pd.concat([panel.of(every).rows for panel in panels])
    clear = rows[rows["above_floor"].eq(True) | (rows["noise_floor"].isna() & (rows["ci_low"] > 0))]
    best = clear.sort_values("estimate", ascending=False, kind="stable")
    best = best.drop_duplicates(["factor", "other"]).head(_LEADING)
    if best.empty:
        return "In these outputs no interaction of two factors (S2) stands out of its noise."
    told = [
        f"{factor_name(row['factor'])} with {factor_name(row['other'])} {fixed(row['estimate'])} "
        f"[{fixed(row['ci_low'])} to {fixed(row['ci_high'])}]"
        for row in best.to_dict("records")
    ]
    return f"Strongest interactions of two factors in these outputs (S2): {listed(told)}."


def runs(study: GlobalSensitivity, indices: pd.DataFrame) -> str:
    """How many runs there are, how many failed, and what became of them."""
    failed = int(indices["failed"].max()) if len(indices) else 0
    every = count(study.n_runs, "run")
    specimens = indices["specimen"].nunique()
    whose = f"{every} of each of {specimens} specimens" if specimens > 1 else every
    if not failed:
        return f"{whose}, none failed."
    least = int(indices["runs"].min())
    return (
        f"{whose}, of which at most {whole(failed)} failed: {LEFT_OUT[study.design.method]}, "
        f"so that indices rest on {whole(least)} runs or more."
    )


def settled(
    convergence: pd.DataFrame, panels: Sequence[Panel], measures: Measures, joints: Sequence[str]
) -> str:
    """How far the main indices of leading factors moved from the last part to all runs."""
    rows = with_results(convergence, measures) if len(convergence) else convergence
    if rows.empty or rows["runs"].nunique() < 2:
        return ""
    rows = rows[rows["index"] == measures.main]
    before = sorted(rows["runs"].unique())[-2]
    single = [one for panel in panels for one in by_joint(panel, joints)]
    changes = [_change(one.of(rows).rows, leading([one], measures), measures) for one in single]
    unit = " of the largest" if measures.in_units else ""
    return (
        f"From {whole(int(before))} runs to all of them, {NAME[measures.main]} of the leading "
        f"factors changed by at most {fixed(max(changes))}{unit}."
    )


def _change(main: pd.DataFrame, factors: Sequence[str], measures: Measures) -> float:
    """Largest change of the leading factors; of indices in units relative to the largest."""
    rows = main[main["factor"].isin(list(factors[:_LEADING]))]
    early, late = (
        pool(rows[rows["runs"] == runs], ["factor"]).set_index("factor")["estimate"]
        for runs in sorted(rows["runs"].unique())[-2:]
    )
    scale = float(late.abs().max()) if measures.in_units else 1.0
    return float((late - early).abs().max()) / (scale or 1.0)


def without(indices: pd.DataFrame) -> Iterator[tuple[str, str]]:
    """Status and sentence of outputs that have no index."""
    every = indices[_PLACE].drop_duplicates().shape[0]
    lost = indices[indices["status"] != DONE]
    for status, rows in lost.groupby("status", sort=False):
        n = rows[_PLACE].drop_duplicates().shape[0]
        why = listed([text for text in rows["message"].dropna().unique() if text], most=1)
        reason = f" ({why})" if why else ""
        meant = _STATUS.get(str(status), str(status).replace("_", " "))
        yield str(status), f"{n} of {count(every, 'output')} {meant}{reason}."
