"""The study kind that asks which effect a model lacks, where, and how sure that is."""

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import BaseModel, Field, StringConstraints, model_validator

from spinepipe.cohort.cohort import MeasurementSd
from spinepipe.studies.parts import FORM, Coordinates, EachOnce, PublishedStiffness, Tests
from spinepipe.studies.study import Study

__all__ = ["Discrepancy", "DiscrepancyBase", "Nuisance"]

_Name = Annotated[str, StringConstraints(min_length=1)]


class DiscrepancyBase(BaseModel):
    """The model that is asked what it lacks."""

    model_config = FORM

    stiffness: Literal["per_specimen", "per_joint"] | None = Field(
        default=None,
        description="linear bushings: per_specimen, one stiffness that all joints of a specimen "
        "share; per_joint, one for each joint",
    )
    model: _Name | None = Field(
        default=None,
        description="a model file instead, as a path relative to the Snakefile or absolute",
    )

    @model_validator(mode="after")
    def _one_of_them(self) -> Self:
        if (self.stiffness is None) == (self.model is None):
            raise ValueError(
                "exactly one of the two: {stiffness: per_specimen}, {stiffness: per_joint}, or "
                "{model: path of a model file}"
            )
        return self


class Nuisance(BaseModel):
    """Small imperfections that must not pose as physics: one prior SD of each, 0 for none."""

    model_config = FORM

    joint_centre_mm: float = Field(
        default=2.0, ge=0, le=50, description="joint centre per axis, mm"
    )
    posture_deg: float = Field(
        default=2.0,
        ge=0,
        le=45,
        description="neutral orientation of a joint about each axis, deg: laws and reported motion "
        "alike",
    )
    law_axes_deg: float = Field(
        default=1.0, ge=0, le=45, description="axes in which a joint's laws act, by themselves, deg"
    )
    registration_deg: float = Field(
        default=1.0, ge=0, le=45, description="frame in which motion is reported, deg"
    )
    load_axis_deg: float = Field(
        default=1.0, ge=0, le=45, description="direction of moments, and that of forces, deg"
    )
    load_gain: float = Field(default=0.02, ge=0, le=1, description="size of the load, as a share")
    off_diagonal: float = Field(
        default=0.02,
        ge=0,
        le=1,
        description="stiffness between two coordinates that are read, as a share of the geometric "
        "mean of theirs",
    )
    rotation_order: float = Field(
        default=0.5,
        ge=0,
        le=10,
        description="order of rotations in which a joint's laws act: 0 is Z, X', Y'', 1 the "
        "reverse",
    )


GIVEN_UP = ("false_alarm", "bootstrap", "held_out")
"""Settings of versions before: they are accepted, and do nothing."""


class Discrepancy(Study):
    """Find which effect the base model lacks, and prove it on motion that was held out."""

    most_fits: ClassVar[Mapping[str, int]] = {"quick": 10, "standard": 40, "full": 100}

    @model_validator(mode="before")
    @classmethod
    def _without_given_up(cls, given: Any) -> Any:
        if not isinstance(given, dict):
            return given
        return {key: value for key, value in given.items() if key not in GIVEN_UP}

    kind: Literal["discrepancy"] = Field(description="kind of study")
    base: DiscrepancyBase = Field(description="the model that is asked what it lacks")
    seed: int = Field(
        default=2024, ge=0, le=2**32 - 1, description="read by versions before; does nothing now"
    )
    tests: Tests | None = Field(default=None, description="tests used; null: all with motion")
    coordinates: Coordinates | None = Field(
        default=None, description="measured coordinates used; null: all that were measured"
    )
    effects: EachOnce[_Name] | None = Field(
        default=None, description="effects that are tried; null: all that can be"
    )
    most_effects: int = Field(
        default=3, ge=1, le=10, description="most effects that are named; three at most"
    )
    margin: float = Field(
        default=3.0, ge=0, le=1e3, description="read by versions before; does nothing now"
    )
    effort: Literal["quick", "standard", "full"] = Field(
        default="quick",
        description="most fits of the search: quick 10, standard 40, full 100; it ends earlier "
        "where few hold all probability, and names nothing for certain where it does not",
    )
    minutes: float | None = Field(
        default=None,
        gt=0,
        le=10_000,
        description="ends the search by the clock, so long after the start of its job: its answer "
        "then hangs on the computer",
    )
    measurement_sd: MeasurementSd | None = Field(
        default=None,
        description="SDs of one reading where no cycle is repeated; null: the cohort's",
    )
    stiffness: PublishedStiffness = Field(
        default_factory=PublishedStiffness, description="stiffness of all joints where fits start"
    )
    bound_factor: float = Field(
        default=100.0, gt=1, le=1e9, description="bounds are start / factor and start x factor"
    )
    nuisance: Nuisance = Field(
        default_factory=Nuisance,
        description="small imperfections that are fitted along, one prior SD of each",
    )
