"""Effects, places and misfits in plain words."""

from collections.abc import Callable, Iterable

from spinepipe.report.discrepancy.verdict import Estimate, Missing
from spinepipe.report.words import AXIS, number

ALL = "*"
_UNCOUNTED = (
    *("asymmetry", "contact", "coupling", "creep", "dependence", "hysteresis", "laxity"),
    *("migration", "stiffening", "tilt", "weight"),
)
_MOST = 4


def plain(name: str) -> str:
    """A name of results without underscores."""
    return name.replace("_", " ").strip()


def with_article(name: str) -> str:
    """``a neutral zone``, ``an offset``; ``creep`` and the like are not counted."""
    words = plain(name)
    if words.endswith(_UNCOUNTED):
        return words
    return f"{'an' if words[:1] in 'aeiou' else 'a'} {words}"


def axis(coordinate: str) -> str:
    """A coordinate as a direction: ``flexion-extension``; * is all of them."""
    return AXIS[coordinate].lower() if coordinate in AXIS else plain(coordinate)


def listed(names: Iterable[str], most: int = _MOST, last: str = "and") -> str:
    """``a, b and c``; of many the first, and how many more."""
    every = list(names)
    if len(every) > most:
        return f"{', '.join(every[:most])} and {len(every) - most} more"
    if len(every) < 2:
        return "".join(every)
    return f"{', '.join(every[:-1])} {last} {every[-1]}"


def where_of(effect: Missing) -> str:
    """``at L4L5, in flexion-extension, in specimens a and b``; what is everywhere is left out."""
    parts = [
        _chosen(effect, "joints", "at {}", str),
        _chosen(effect, "coordinates", "in {}", axis),
        _chosen(effect, "specimens", "in specimen {}", str),
        _chosen(effect, "tests", "during {}", plain),
    ]
    return ", ".join(part for part in parts if part)


def _chosen(effect: Missing, key: str, words: str, say: Callable[[str], str]) -> str:
    names = effect.scope.get(key, ())
    if not names or names == (ALL,):
        return "at all joints" if key == "joints" and names else ""
    text = words.format(listed([say(name) for name in names]))
    return text.replace("in specimen ", "in specimens ") if len(names) > 1 else text


def what_of(effect: Missing) -> str:
    """``a neutral zone at L4L5, in flexion-extension``."""
    return f"{with_article(effect.name)} {where_of(effect)}".strip()


def estimate_of(parameter: Estimate) -> str:
    """``width 3.1 deg (95 % interval 2.8 to 3.4)``."""
    if parameter.value is None:
        return f"{plain(parameter.name)} not known"
    unit = "°" if parameter.unit == "deg" else f" {parameter.unit}".rstrip()
    told = f"{plain(parameter.name)} {number(parameter.value)}{unit}"
    if parameter.low is None or parameter.high is None:
        return told
    return f"{told} (95 % interval {number(parameter.low)} to {number(parameter.high)})"
