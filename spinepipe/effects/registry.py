"""The registry of effects: name in a model file to class, and how a search may try it.

One file per effect enters itself. An effect that says nothing of how it may be tried is not tried.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from enum import StrEnum
from types import MappingProxyType
from typing import Any, TypeVar

from spinepipe.effects.contract import Effect

EffectClass = TypeVar("EffectClass", bound=type)

_CLASSES: dict[str, type] = {}


def register(name: str) -> Callable[[EffectClass], EffectClass]:
    """Class decorator that enters an effect under the name used in model files and results."""

    def enter(cls: EffectClass) -> EffectClass:
        if name in _CLASSES:
            raise ValueError(f"effect {name!r} is registered twice")
        _CLASSES[name] = cls
        return cls

    return enter


def registered() -> Mapping[str, type]:
    """Read-only view of all registered effects, by name."""
    return MappingProxyType(_CLASSES)


def create(name: str, options: Mapping[str, Any] | None = None) -> Effect:
    """The effect of that name with its options.

    Raises
    ------
    ValueError
        For an unknown name or option, with what is allowed.
    """
    if name not in _CLASSES:
        raise ValueError(f"unknown effect {name!r}; known: {', '.join(sorted(_CLASSES))}")
    cls = _CLASSES[name]
    allowed = [field.name for field in fields(cls)]
    unknown = sorted(set(options or {}) - set(allowed))
    if unknown:
        raise ValueError(f"effect {name!r} has no option {unknown[0]!r}; allowed: {allowed}")
    effect: Effect = cls(**(options or {}))
    return effect


class PlaceSpread(StrEnum):
    """How the values of an effect may differ between the places it acts at."""

    SHARED = "shared"
    BY_JOINT = "by joint"
    BY_SPECIMEN = "by specimen"
    EACH = "each joint of each specimen"
    ONE_JOINT = "one joint"
    ONE = "one joint of one specimen"
    BY_TEST = "by test"


PER_JOINT = (
    PlaceSpread.SHARED,
    PlaceSpread.BY_JOINT,
    PlaceSpread.BY_SPECIMEN,
    PlaceSpread.EACH,
    PlaceSpread.ONE_JOINT,
    PlaceSpread.ONE,
)
"""All ways in which an effect of single joints may differ."""


@dataclass(frozen=True)
class TriedValues:
    """What is tried of an effect.

    Attributes
    ----------
    variants : options of each variant, alternatives of equal standing.
    spreads : how values may differ; effects that are not per joint know no joints.
    told_by : what a test must have to show the effect, in words.
    """

    variants: tuple[Mapping[str, Any], ...]
    spreads: tuple[PlaceSpread, ...]
    told_by: str
