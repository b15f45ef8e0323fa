"""Many runs at once: stacks of models and tests, and spines that differ in numbers alone."""

from spinepipe.statics.batched.derive import (
    answered,
    poses_by,
    reactions,
    reactions_by,
    readings,
    readings_by,
)
from spinepipe.statics.batched.dynamics import Moving
from spinepipe.statics.batched.forward_kinematics import forward_kinematics
from spinepipe.statics.batched.inactive_sensitivity import Acting, Answering, Idle, acts_here
from spinepipe.statics.batched.spines import Cases, ManySolved, Spines, solve_many
from spinepipe.statics.batched.stack import Stack, StepPoses
from spinepipe.statics.batched.transient import CourseEnds, settle

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
    "forward_kinematics",
    "poses_by",
    "reactions",
    "reactions_by",
    "readings",
    "readings_by",
    "settle",
    "solve_many",
]
