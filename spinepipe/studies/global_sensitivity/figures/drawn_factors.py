"""Which factors have a row in the figure: those with an effect, and the dummy below them."""

from collections.abc import Sequence

import pandas as pd

from spinepipe.report.global_sensitivity.measures import Measures
from spinepipe.report.global_sensitivity.panels import Panel, above_floor, leading, pooled
from spinepipe.report.words import count, number
from spinepipe.studies.global_sensitivity import DUMMY

MOST, FEWEST = 24, 6
SMALL = 0.01
"""Part of a panel's largest index below which an effect cannot be seen in a picture."""


def drawn_factors(found: Sequence[Panel], measures: Measures) -> tuple[list[str], str]:
    """Factors from the top down, and what is said of those that are not drawn."""
    order = leading(found, measures)
    own = [name for name in order if name != DUMMY]
    seen = _seen(found, measures)
    worth = [name for name in own if name in seen][:MOST]
    kept = worth if len(worth) >= FEWEST else _filled(worth, own)
    drawn = kept + [DUMMY] * (DUMMY in order)
    return drawn, _of_others([name for name in own if name not in kept], found, measures)


def _filled(worth: Sequence[str], own: Sequence[str]) -> list[str]:
    """The fewest rows, in their order."""
    others = [name for name in own if name not in worth][: FEWEST - len(worth)]
    return [name for name in own if name in worth or name in others]


def _seen(found: Sequence[Panel], measures: Measures) -> set[str]:
    """Factors that are above the floor, where there is one, and not small, in any panel."""
    names: set[str] = set()
    for panel in found:
        main = panel.rows[panel.rows["index"] == measures.main]
        means = pooled(main, ["factor"]).set_index("factor")["estimate"]
        large = set(means.index[means >= SMALL * means.max()])
        floor = main["noise_floor"].notna().any()
        names |= large & above_floor(main) if floor else large
    return names


def _of_others(names: Sequence[str], found: Sequence[Panel], measures: Measures) -> str:
    rows = pd.concat([panel.rows for panel in found])
    left = rows[rows["factor"].isin(list(names)) & (rows["index"] == measures.main)]
    if left.empty:
        return ""
    many, largest = count(len(names), "more factor"), float(left["estimate"].max())
    if largest <= 0.0:
        return f"{many} without any effect"
    size = "small" if measures.in_units else f"at most {number(largest, 2)}"
    return f"{many}, {size}, only in the table"
