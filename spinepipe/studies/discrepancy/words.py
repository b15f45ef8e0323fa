"""Effects, places and misfits in plain words, named as the field does in each coordinate."""

import re
from collections.abc import Iterable, Sequence

from spinepipe.report.words import AXIS, level, listed, plain
from spinepipe.studies.discrepancy.verdict import EVERY, NOT_LISTED, SOMETHING_ELSE, Missing
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

SET_UP = {
    "joint_centre": "joint centre",
    "posture": "posture",
    "law_axes": "axes of the joint",
    "registration": "registration of frames",
    "load_axis": "direction of the load",
    "load_gain": "size of the load",
    "off_diagonal": "stiffness that couples two motions",
    "rotation_order": "order of rotations",
}
"""Errors of the set-up or of its description that a study allows for."""

_KEYS = ("per_joint", "per_specimen")
_NAME = re.compile(r"\b[a-z]+(?:_[a-z0-9]+)+\b")
_SPOKEN = "|".join(sorted((plain(name) for name in COORDINATES), key=len, reverse=True))
_PLACED = re.compile(rf"(?P<before>^|\b(?:in|own|of|over) |, )(?P<name>{_SPOKEN})(?P<after>,|\b)")

_SPREADS = {
    ", each joint of each specimen": ", differing by joint and specimen",
    ", by joint": ", differing by joint",
    ", shared": ", alike everywhere",
}
"""How a shape differs between places, in the words of results and of the page."""


def readable(sentence: str) -> str:
    """A sentence with its names in plain words; keys of a study file stay as they are typed."""
    words = _NAME.sub(
        lambda found: found[0] if found[0] in _KEYS else SET_UP.get(found[0], general(found[0])),
        sentence,
    )
    return _PLACED.sub(
        lambda at: at["before"] + motion_of(at["name"].replace(" ", "_")) + at["after"], words
    )


def shape_in_words(shape: str) -> str:
    """What generic terms see of a misfit: ``load in lateral bending over ..., alike in all ...``.

    Parameters
    ----------
    shape : as the verdict has it.
    """
    words = readable(shape).rstrip(".")
    for spread, told in _SPREADS.items():
        words = words.removesuffix(spread) + told if words.endswith(spread) else words
    return words


def general(name: str) -> str:
    """The name of an effect wherever it acts; other names without underscores."""
    return _GENERAL.get(name, plain(name))


def words_of(name: str) -> str:
    """What a probability is of: an effect wherever it acts, something else, or nothing."""
    return NOT_LISTED if name == SOMETHING_ELSE else general(name)


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


def axis(coordinate: str) -> str:
    """A coordinate as a direction: ``flexion–extension``."""
    return AXIS[coordinate].lower() if coordinate in AXIS else plain(coordinate)


def motion_of(coordinate: str) -> str:
    """A coordinate as a motion: ``flexion–extension``, ``anterior–posterior translation``."""
    return f"{axis(coordinate)} translation" if coordinate in TRANSLATIONS else axis(coordinate)


def load_axis(coordinate: str) -> str:
    """What is applied along a coordinate, with its unit, as an axis says it."""
    if coordinate in TRANSLATIONS:
        return f"{axis(coordinate)} force (N)"
    return f"{axis(coordinate)} moment (N m)"


def direction_of(effect: Missing) -> str:
    """``flexion–extension``, ``extension``: what it acts in; empty where its name says so."""
    at, side = effect.scope.coordinates, effect.variant.get("side")
    if at == EVERY or effect.name == COUPLING:
        return ""
    if effect.name == ASYMMETRY and at[0] in _SAID_BY_NAME:
        return ""
    if side in _SIDES and len(at) == 1 and at[0] in TOWARDS:
        return TOWARDS[at[0]][_SIDES.index(side)]
    return listed(map(motion_of, at))


def what_of(effect: Missing) -> str:
    """``neutral zone in flexion–extension at L4–L5 of s01``; what is everywhere is left out."""
    scope, told = effect.scope, name_at(effect.name, effect.scope.coordinates)
    parts = [(" in ", direction_of(effect))]
    parts += [(" at ", listed(map(level, scope.joints)) if scope.joints != EVERY else "")]
    parts += [(" of ", listed(scope.specimens) if scope.specimens != EVERY else "")]
    return told + "".join(f"{word}{at}" for word, at in parts if at)


def effects_in_words(effects: Sequence[Missing], most_words: int) -> str:
    """Names of effects, as fully as they fit: with their places, by name, or how many."""
    full = list(dict.fromkeys(map(what_of, effects)))
    short = list(dict.fromkeys(name_at(one.name, one.scope.coordinates) for one in effects))
    return in_words([full, short], most_words) or f"{len(effects)} effects"


def in_words(ways: Iterable[Sequence[str]], most_words: int, last: str = "and") -> str:
    """The first of several lists of names that has so many words at most; empty where none has."""
    lists = (listed(names, len(names), last) for names in ways)
    return next((told for told in lists if len(told.split()) <= most_words), "")
