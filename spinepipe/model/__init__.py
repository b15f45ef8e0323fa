"""The model room: what a spine model is, its YAML, its URDF and its OpenSim export."""

from spinepipe.model.spine import (
    MOST_JOINTS,
    Body,
    LoadCase,
    LoadStep,
    MeasuredCase,
    RefusedModel,
    ScopedEffect,
    SpineModel,
    Support,
)

__all__ = [
    "MOST_JOINTS",
    "Body",
    "LoadCase",
    "LoadStep",
    "MeasuredCase",
    "RefusedModel",
    "ScopedEffect",
    "SpineModel",
    "Support",
]
