"""A hidden effect in words and units, as truth.json holds it."""

from typing import Any

import numpy as np

from .anatomy import TRANSLATIONS, joints_of_recipe
from .catalogue import CATALOGUE
from .recipe import Hidden, Recipe

REACHED = 0.05
"""Share by which the gap may miss the wanted one and still count as reached."""

PER_DEG = np.pi / 180.0
BORDER = {
    "rad": ("deg", 1.0 / PER_DEG),
    "1/rad": ("1/rad", 1.0),
    "m": ("mm", 1000.0),
    "m/rad": ("mm/deg", 1000.0 * PER_DEG),
}
"""SI unit -> unit of tables and the factor to it; other units stay."""

SUFFIXES = {"_m": "m", "_s": "s"}
LENGTHS = ("half_width", "centre", "width", "gap", "reach", "fades", "period", "angle")
"""Shape parameters in the unit of the effect's coordinate."""


def effect_told(hidden: Hidden, gap: float, recipe: Recipe) -> dict[str, Any]:
    """Name, kind, scope in names, parameters in SI and in border units, and the gap."""
    entry = CATALOGUE[hidden.name]
    strength = _parameter(
        entry.strength, float(hidden.strength or 0.0), entry.unit_of(hidden.coordinate)
    )
    return {
        "name": hidden.name,
        "kind": entry.kind,
        "known": entry.known,
        "scope": {
            "joints": ["*"] if hidden.joint is None else [joints_of_recipe(recipe)[hidden.joint]],
            "coordinates": ["*"] if hidden.coordinate is None else [hidden.coordinate],
            "specimens": ["*"] if hidden.specimen is None else [f"s{hidden.specimen + 1:02d}"],
        },
        "formula": hidden.shape.get("formula", next(iter(entry.formulas))),
        "parameters": [strength, *_shapes(hidden)],
        "gap": gap,
        "reached": bool(abs(gap - recipe.gap) <= REACHED * recipe.gap),
    }


def _shapes(hidden: Hidden) -> list[dict[str, Any]]:
    length = "m" if hidden.coordinate in TRANSLATIONS else "rad"
    return [_shape(key, value, length) for key, value in hidden.shape.items() if key != "formula"]


def _shape(key: str, value: Any, length: str) -> dict[str, Any]:
    if key in LENGTHS:
        return _parameter(key, value, length)
    for suffix, unit in SUFFIXES.items():
        if key.endswith(suffix):
            return _parameter(key.removesuffix(suffix), value, unit)
    return _parameter(key, value, "")


def _parameter(name: str, value: Any, unit: str) -> dict[str, Any]:
    border, factor = BORDER.get(unit, (unit, 1.0))
    shown = value if isinstance(value, str) or not unit else (factor * np.array(value)).tolist()
    return {"name": name, "si": value, "si_unit": unit, "value": shown, "unit": border}
