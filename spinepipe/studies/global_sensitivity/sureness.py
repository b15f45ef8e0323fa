"""Sentences: how many runs failed and what was done with them, and whether indices have settled."""

from collections.abc import Iterator, Sequence

import pandas as pd

from spinepipe.report.discrepancy.words import listed
from spinepipe.report.global_sensitivity.measures import DONE, NAME, Measures
from spinepipe.report.global_sensitivity.panels import (
    Panel,
    by_joint,
    leading,
    pooled,
    with_results,
)
from spinepipe.report.global_sensitivity.words import factor_name, whole
from spinepipe.report.words import count, fixed
from spinepipe.studies import GlobalSensitivity

LEFT_OUT = {
    "sobol": "with a failed run its whole base sample is left out",
    "morris": "with a failed run its whole trajectory is left out",
    "latin_hypercube": "a failed run is left out by itself",
    "fast": "with a failed run its factor has no index: a curve with a gap is no curve",
}
"""What is done with failed runs, by design."""

_PLACE = ["specimen", "output", "test", "step", "joint", "coordinate"]
_LEADING = 3


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
        pooled(rows[rows["runs"] == runs], ["factor"]).set_index("factor")["estimate"]
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


_STATUS = {
    "constant": "vary with no factor and have no index",
    "too_many_failed": "have no index, or not of every factor: too many runs failed",
    "too_few": "have no index: too few runs are left",
}


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
