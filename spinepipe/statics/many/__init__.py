"""Many runs at once: stacks of models and tests, and spines that differ in numbers alone."""

from spinepipe.statics.many.derive import (
    answered,
    poses_by,
    reactions,
    reactions_by,
    readings,
    readings_by,
)
from spinepipe.statics.many.dynamics import Moving
from spinepipe.statics.many.idle import Acting, Answering, Idle, acts_here
from spinepipe.statics.many.settling import Ends, settle
from spinepipe.statics.many.solve import ManySolved, solve_many
from spinepipe.statics.many.spines import Cases, Spines
from spinepipe.statics.many.stack import Poses, Stack
from spinepipe.statics.many.survey import survey

__all__ = [
    "Acting",
    "Answering",
    "Cases",
    "Ends",
    "Idle",
    "ManySolved",
    "Moving",
    "Poses",
    "Spines",
    "Stack",
    "acts_here",
    "answered",
    "poses_by",
    "reactions",
    "reactions_by",
    "readings",
    "readings_by",
    "settle",
    "solve_many",
    "survey",
]
