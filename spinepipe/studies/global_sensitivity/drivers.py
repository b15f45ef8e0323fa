"""Sentences: which factors drive an output, and which of them do nothing that can be seen."""

from collections.abc import Iterator, Sequence
from typing import Any

import pandas as pd

from spinepipe.report.discrepancy.words import capital, listed
from spinepipe.report.global_sensitivity.measures import Measures
from spinepipe.report.global_sensitivity.panels import Panel, above_floor, by_joint, pooled
from spinepipe.report.global_sensitivity.values import value, with_ends
from spinepipe.report.global_sensitivity.words import OUTPUT, factor_name, what, where
from spinepipe.report.words import count
from spinepipe.studies.global_sensitivity import DUMMY

MOST_NAMED, MOST_JOINTS = 3, 6
WORTH_NAMING = 0.1
"""Part of the first factor's index from which on another is named beside it."""

LITTLE = 0.01
"""Share of the variance below which a factor counts for little."""

HARDLY = 0.95
"""Sum of first-order indices from which on there is hardly any interaction."""

Record = dict[str, Any]


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


_MEANING = {
    "ST": "share of the variance, alone and with other factors",
    "mu_star": "mean change from a factor's lowest to its highest value",
    "PAWN": "PAWN, how far a factor moves the distribution, 0 to 1",
}


def _main(panel: Panel, measures: Measures) -> pd.DataFrame:
    return panel.rows[panel.rows["index"] == measures.main]


def _ordered(panel: Panel, measures: Measures) -> list[Record]:
    """Factors but for the dummy, the largest index first."""
    rows = pooled(_main(panel, measures), ["factor"])
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
    share = float(pooled(first, ["factor"])["estimate"].sum())
    if share >= HARDLY:
        return "There is hardly any interaction."
    return f"Alone, the factors make up {value(share, panel, measures)}; the rest is interaction."


def _nothing(panel: Panel, own: Sequence[Record], measures: Measures) -> Iterator[str]:
    """Factors that do nothing that can be seen, and those that do little."""
    seen = _seen(panel, measures)
    hidden = [factor_name(row["factor"]) for row in own if row["factor"] not in seen]
    if hidden:
        yield f"Not above the dummy: {listed(hidden)}."
    little = [
        factor_name(row["factor"])
        for row in own
        if measures.of_variance and row["estimate"] < LITTLE and row["factor"] in seen
    ]
    if little:
        yield f"{'Above it, but below' if hidden else 'Below'} 1 %: {listed(little)}."
