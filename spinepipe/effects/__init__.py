"""Effects: named components of the model, one file each. See `contract` for the five kinds."""

from importlib import import_module
from pkgutil import iter_modules

from spinepipe.effects.contract import (
    Advance,
    AppliedLoad,
    Effect,
    EffectKind,
    GeometryEffect,
    JointLaw,
    JointResponse,
    LoadEffect,
    MeasurementBeside,
    MeasurementEffect,
    Motion,
    Observation,
    Parameter,
    PathLaw,
    Placement,
    PlacementByParameter,
    Wrench,
)
from spinepipe.effects.registry import PlaceSpread, TriedValues, create, register, registered

__all__ = [
    "Advance",
    "AppliedLoad",
    "Effect",
    "EffectKind",
    "GeometryEffect",
    "JointLaw",
    "JointResponse",
    "LoadEffect",
    "MeasurementBeside",
    "MeasurementEffect",
    "Motion",
    "Observation",
    "Parameter",
    "PathLaw",
    "PlaceSpread",
    "Placement",
    "PlacementByParameter",
    "TriedValues",
    "Wrench",
    "create",
    "register",
    "registered",
]

for _file in iter_modules(__path__):  # each effect registers itself: a new one is one new file
    import_module(f"{__name__}.{_file.name}")
