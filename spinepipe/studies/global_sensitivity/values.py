"""Indices as they are read in sentences."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from spinepipe.report.global_sensitivity.measures import Measures, unit_of
from spinepipe.report.global_sensitivity.panels import Panel
from spinepipe.report.words import fixed, number

_SMALL = 0.01


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
