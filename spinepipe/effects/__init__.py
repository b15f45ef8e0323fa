"""Effects: named components of the model, one file each. See `contract` for the five kinds."""

from spinepipe.effects import linear_bushing as _linear_bushing  # noqa: F401  (registers itself)
from spinepipe.effects.contract import (
    Advance,
    AppliedLoad,
    Effect,
    GeometryEffect,
    JointLaw,
    JointResponse,
    Kind,
    LoadEffect,
    MeasurementEffect,
    Motion,
    Observation,
    Parameter,
    PathLaw,
    Placement,
    PlacementByParameter,
    Wrench,
)
from spinepipe.effects.registry import create, register, registered

__all__ = [
    "Advance",
    "AppliedLoad",
    "Effect",
    "GeometryEffect",
    "JointLaw",
    "JointResponse",
    "Kind",
    "LoadEffect",
    "MeasurementEffect",
    "Motion",
    "Observation",
    "Parameter",
    "PathLaw",
    "Placement",
    "PlacementByParameter",
    "Wrench",
    "create",
    "register",
    "registered",
]
