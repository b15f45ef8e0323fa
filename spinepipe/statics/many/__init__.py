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
from spinepipe.statics.many.settling import CourseEnds, settle
from spinepipe.statics.many.solve import ManySolved, solve_many
from spinepipe.statics.many.spines import Cases, Spines
from spinepipe.statics.many.stack import Stack, StepPoses
from spinepipe.statics.many.survey import survey

__all__ = [
    "Acting",
    "Answering",
    "Cases",
    "CourseEnds",
    "Idle",
    "ManySolved",
    "Moving",
    "Spines",
    "Stack",
    "StepPoses",
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
