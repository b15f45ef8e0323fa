"""Effects, places and misfits in plain words."""

import re
from collections.abc import Callable

from spinepipe.report.words import AXIS, listed, number, plain
from spinepipe.studies.discrepancy.verdict import EVERY, Estimate, Missing

_UNCOUNTED = (
    *("asymmetry", "contact", "coupling", "creep", "dependence", "hysteresis", "laxity"),
    *("migration", "stiffening", "tilt", "weight"),
)
_KEYS = ("per_joint", "per_specimen")
_NAME = re.compile(r"\b[a-z]+(?:_[a-z0-9]+)+\b")


def readable(sentence: str) -> str:
    """A sentence with its names in plain words; keys of a study file stay as they are typed."""
    return _NAME.sub(lambda found: found[0] if found[0] in _KEYS else plain(found[0]), sentence)


def with_article(name: str) -> str:
    """``a neutral zone``, ``an offset``; ``creep`` and the like are not counted."""
    words = plain(name)
    if words.endswith(_UNCOUNTED):
        return words
    return f"{'an' if words[:1] in 'aeiou' else 'a'} {words}"


def axis(coordinate: str) -> str:
    """A coordinate as a direction: ``flexion-extension``; * is all of them."""
    return AXIS[coordinate].lower() if coordinate in AXIS else plain(coordinate)


def where_of(effect: Missing) -> str:
    """``at L4L5, in flexion-extension, in specimens a and b``; what is everywhere is left out."""
    scope = effect.scope
    parts = [
        _chosen(scope.joints, "at", str) or "at all joints",
        _chosen(scope.coordinates, "in", axis),
        _chosen(scope.specimens, f"in specimen{'s' * (len(scope.specimens) > 1)}", str),
    ]
    return ", ".join(part for part in parts if part)


def _chosen(names: tuple[str, ...], word: str, say: Callable[[str], str]) -> str:
    return "" if names == EVERY else f"{word} {listed([say(name) for name in names])}"


def what_of(effect: Missing) -> str:
    """``a neutral zone at L4L5, in flexion-extension``."""
    return f"{with_article(effect.name)} {where_of(effect)}".strip()


def called(effect: Missing) -> str:
    """``nonlinear stiffening (tangent)``: its name and the variant of it."""
    options = [str(value) for key, value in effect.variant.items() if key not in _IN_SCOPE]
    return plain(effect.name) + (f" ({', '.join(options)})" if options else "")


_IN_SCOPE = ("coordinate", "pair")
"""Options that the scope says as well."""


def differing(effect: Missing) -> str:
    """How its values may differ from place to place; empty where there is one place or no word."""
    return _DIFFERING.get(effect.spread, "")


_DIFFERING = {
    "shared": "the same in all specimens and joints",
    "by joint": "each joint its own",
    "by specimen": "each specimen its own",
    "each joint of each specimen": "each joint of each specimen its own",
    "by test": "each test its own",
}


def unit_of(unit: str) -> str:
    """A unit as printed: ``°``, ``1/rad²``, nothing for a ratio."""
    return {"deg": "°", "1": ""}.get(unit, unit.replace("^2", "²").replace("^3", "³"))


def name_and_place(parameter: Estimate) -> tuple[str, str]:
    """``width``, and ``L4L5, s01``: results write ``width@L4L5@s01``."""
    name, *place = parameter.name.split("@")
    return plain(name), ", ".join(map(plain, place))


def value_of(parameter: Estimate) -> str:
    """``3.1 [2.8, 3.4]``: with its 95 % interval, or that it is at its bound."""
    value = number(parameter.value)
    if parameter.at_bound:
        return f"{value}, at its bound"
    low, high = parameter.ci95
    return f"{value} [{number(low)}, {number(high)}]"


def estimate_of(parameter: Estimate) -> str:
    """``width 3.1° (95 % interval 2.8 to 3.4)``."""
    name, place = name_and_place(parameter)
    name = f"{name} ({place})" if place else name
    unit = unit_of(parameter.unit)
    told = f"{name} {number(parameter.value)}{unit if unit == '°' else f' {unit}'.rstrip()}"
    if parameter.at_bound:
        return f"{told}, at its bound"
    low, high = parameter.ci95
    return f"{told} (95 % interval {number(low)} to {number(high)})"
