"""Statics: equilibria of a spine model, their stability and sensitivities, and settling in time."""

from spinepipe.statics.equilibrium import Equilibrium
from spinepipe.statics.path import SolvedStep, follow, reaction
from spinepipe.statics.sensitivity import (
    FreeParameter,
    by_parameters,
    declared,
    free_parameters,
    observe,
    observed_by_parameters,
    reactions_by,
    with_parameters,
)
from spinepipe.statics.system import Balance, Loading, Slots, System
from spinepipe.statics.transient import (
    Course,
    Program,
    TransientResult,
    move,
    no_settling,
    retrace,
    settle,
)
from spinepipe.status import Status
from spinepipe.world import Chain

__all__ = [
    "Balance",
    "Chain",
    "Course",
    "Equilibrium",
    "FreeParameter",
    "Loading",
    "Program",
    "Slots",
    "SolvedStep",
    "Status",
    "System",
    "TransientResult",
    "by_parameters",
    "declared",
    "follow",
    "free_parameters",
    "move",
    "no_settling",
    "observe",
    "observed_by_parameters",
    "reaction",
    "reactions_by",
    "retrace",
    "settle",
    "with_parameters",
]
