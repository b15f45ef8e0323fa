"""Effects, places and misfits in plain words, named as the field does in each coordinate."""

import re
from collections.abc import Callable, Sequence

from spinepipe.report.words import AXIS, listed, plain
from spinepipe.studies.discrepancy.verdict import EVERY, Missing
from spinepipe.units import COORDINATES, TRANSLATIONS

ASYMMETRY = "flexion_extension_asymmetry"
COUPLING = "bending_rotation_coupling"
CONTACT = "facet_contact"

_GENERAL = {ASYMMETRY: "asymmetry", COUPLING: "coupling", CONTACT: "contact (stop)"}
"""Effects whose name in results says one coordinate, though they act in any."""

_SIDES_OF = {
    "anterior": "anterior–posterior",
    "superior": "inferior–superior",
    "right": "right–left",
    "extension": "flexion–extension",
    "right_bending": "right–left",
    "left_rotation": "left–right",
}
"""What an asymmetry lies between."""

_SAID_BY_NAME = ("anterior", "superior", "right", "extension")
"""Coordinates that the name of an asymmetry says by itself."""

TOWARDS = {
    "anterior": ("anterior translation", "posterior translation"),
    "superior": ("superior translation", "inferior translation"),
    "right": ("translation to the right", "translation to the left"),
    "extension": ("extension", "flexion"),
    "right_bending": ("bending to the right", "bending to the left"),
    "left_rotation": ("rotation to the left", "rotation to the right"),
}
"""Motion to the positive and to the negative side of a coordinate."""

_SIDES = ("positive", "negative")
_USUAL_PAIR = {"right_bending", "left_rotation"}

_UNCOUNTED = (
    *("asymmetry", "contact", "coupling", "creep", "dependence", "hysteresis", "laxity"),
    *("migration", "stiffening", "tilt", "weight", "drift"),
)
_KEYS = ("per_joint", "per_specimen")
_NAME = re.compile(r"\b[a-z]+(?:_[a-z0-9]+)+\b")
_SPOKEN = "|".join(sorted((plain(name) for name in COORDINATES), key=len, reverse=True))
_PLACED = re.compile(rf"(?P<before>^|\b(?:in|own|of|over) |, )(?P<name>{_SPOKEN})(?P<after>,|\b)")


def readable(sentence: str) -> str:
    """A sentence with its names in plain words; keys of a study file stay as they are typed."""
    words = _NAME.sub(lambda found: found[0] if found[0] in _KEYS else general(found[0]), sentence)
    return _PLACED.sub(
        lambda at: at["before"] + motion_of(at["name"].replace(" ", "_")) + at["after"], words
    )


def general(name: str) -> str:
    """The name of an effect wherever it acts; other names without underscores."""
    return _GENERAL.get(name, plain(name))


def name_at(name: str, coordinates: Sequence[str]) -> str:
    """The name of an effect that acts in these coordinates; ``*`` is all of them."""
    first = coordinates[0] if coordinates else "*"
    if name == ASYMMETRY and len(coordinates) == 1 and first in _SIDES_OF:
        return f"{_SIDES_OF[first]} asymmetry"
    if name == COUPLING and len(coordinates) == 2:
        usual = set(coordinates) == _USUAL_PAIR
        return plain(name) if usual else f"coupling of {listed(map(motion_of, coordinates))}"
    if name == CONTACT and first in COORDINATES and first not in TRANSLATIONS:
        return plain(name)
    return general(name)


def with_article(words: str) -> str:
    """``a neutral zone``, ``an offset``; ``creep`` and the like are not counted."""
    if words.endswith(_UNCOUNTED) or words.startswith(("coupling", "contact")):
        return words
    return f"{'an' if words[:1] in 'aeiou' else 'a'} {words}"


def axis(coordinate: str) -> str:
    """A coordinate as a direction: ``flexion-extension``; * is all of them."""
    return AXIS[coordinate].lower() if coordinate in AXIS else plain(coordinate)


def motion_of(coordinate: str) -> str:
    """A coordinate as a motion: ``flexion-extension``, ``anterior-posterior translation``."""
    return f"{axis(coordinate)} translation" if coordinate in TRANSLATIONS else axis(coordinate)


def load_axis(coordinate: str) -> str:
    """What is applied along a coordinate, with its unit, as an axis says it."""
    if coordinate in TRANSLATIONS:
        return f"{axis(coordinate)} force (N)"
    return f"{axis(coordinate)} moment (N m)"


def where_of(effect: Missing) -> str:
    """``at L4L5, in flexion-extension, in specimens a and b``; what is everywhere is left out."""
    scope = effect.scope
    parts = [
        _chosen(scope.joints, "at", str) or "at all joints",
        _direction(effect),
        _chosen(scope.specimens, f"in specimen{'s' * (len(scope.specimens) > 1)}", str),
    ]
    return ", ".join(part for part in parts if part)


def _direction(effect: Missing) -> str:
    """The coordinate or the side of it, where the name does not say it."""
    at, side = effect.scope.coordinates, effect.variant.get("side")
    if effect.name == COUPLING or (effect.name == ASYMMETRY and at[0] in _SAID_BY_NAME):
        return ""
    if side in _SIDES and len(at) == 1 and at[0] in TOWARDS:
        return f"in {TOWARDS[at[0]][_SIDES.index(side)]}"
    return _chosen(at, "in", motion_of)


def _chosen(names: tuple[str, ...], word: str, say: Callable[[str], str]) -> str:
    return "" if names == EVERY else f"{word} {listed([say(name) for name in names])}"


def what_of(effect: Missing) -> str:
    """``a neutral zone at L4L5, in flexion-extension``."""
    return f"{with_article(name_at(effect.name, effect.scope.coordinates))} {where_of(effect)}"


def label_of(effect: Missing) -> str:
    """``nonlinear stiffening (tangent)``: its name and the variant of it."""
    options = [plain(str(value)) for key, value in effect.variant.items() if key not in _IN_SCOPE]
    name = name_at(effect.name, effect.scope.coordinates)
    return name + (f" ({', '.join(options)})" if options else "")


_IN_SCOPE = ("coordinate", "pair", "side")
"""Options that name or scope say as well."""


def spread_words(effect: Missing) -> str:
    """How its values may differ from place to place; empty where there is one place or no word."""
    return _DIFFERING.get(effect.spread, "")


_DIFFERING = {
    "shared": "the same in all specimens and joints",
    "by joint": "each joint its own",
    "by specimen": "each specimen its own",
    "each joint of each specimen": "each joint of each specimen its own",
    "by test": "each test its own",
}
