"""The study kind that asks how stiffness differs between specimens, levels and load cases."""

from collections.abc import Mapping
from typing import Literal

from pydantic import BaseModel, Field

from spinepipe.anatomy import published
from spinepipe.cohort.header import MeasurementSd
from spinepipe.studies.base_model import Base
from spinepipe.studies.coordinates import FORM
from spinepipe.studies.lists import Coordinates, EachOnce, Tests
from spinepipe.studies.published_stiffness import LevelStiffness, PublishedStiffness
from spinepipe.studies.study import Study

__all__ = ["CohortStiffness", "CrossValidation"]

_PAPER = published("gould_2024b")

Representation = Literal["per_specimen", "level_ratio", "per_joint", "partially_pooled"]


def _published_levels() -> dict[str, LevelStiffness]:
    """Gould 2024b, Table 2, level by level."""
    return {
        joint: LevelStiffness(**{name: float(value) for name, value in values.items()})
        for joint, values in _PAPER["level_stiffness"].items()
        if joint != "where"
    }


class CrossValidation(BaseModel):
    """What is held out to see how stiffness carries over."""

    model_config = FORM

    specimens: bool = Field(
        default=True, description="predict each specimen from the stiffness of the others"
    )
    load_cases: bool = Field(
        default=True, description="predict each load case from fits to the other load cases"
    )


class CohortStiffness(Study):
    """Fit every specimen in several representations and load cases, predict what was held out."""

    kind: Literal["cohort_stiffness"] = Field(description="kind of study")
    seed: int = Field(default=2024, ge=0, le=2**32 - 1, description="seed of every random draw")
    tests: Tests | None = Field(
        default=None, description="load cases used; null: all that have a load and a motion"
    )
    cycles: Literal["after_first", "quietest", "all"] = Field(
        default="after_first",
        description="cycles of a test that are used; after_first: all but the first; quietest: of "
        "these the one with the smallest range of coupled moments, as published. The first is used "
        "where a test has no other",
    )
    steps: Literal["all", "peak"] = Field(
        default="all", description="load steps that enter the cost: all, or that of largest moment"
    )
    representations: EachOnce[Representation] = Field(
        default=("per_specimen", "level_ratio", "per_joint", "partially_pooled"),
        description="how stiffness is described; what the literature says is always shown beside",
    )
    free: Coordinates = Field(
        default=("extension", "right_bending", "left_rotation"),
        description="coordinates whose stiffness is fitted; the others keep the published value",
    )
    cost: Literal["measurement_sd", "published"] = Field(
        default="measurement_sd",
        description="measurement_sd: all readings of the free coordinates in their SDs; published: "
        "rotations in degrees, equally weighted, axial rotation only in axial rotation tests",
    )
    measurement_sd: MeasurementSd | None = Field(
        default=None, description="SDs of one reading; null: the cohort's"
    )
    stiffness: PublishedStiffness = Field(
        default_factory=PublishedStiffness,
        description="published stiffness of all joints, where fits start",
    )
    level_stiffness: Mapping[str, LevelStiffness] = Field(
        default_factory=_published_levels,
        description="published rotational stiffness joint by joint, whose ratios level_ratio keeps",
    )
    base: Base | None = Field(
        default=None, description="what acts in every model besides the bushings; null: nothing"
    )
    bound_factor: float = Field(
        default=100.0, gt=1, le=1e9, description="bounds are start / factor and start x factor"
    )
    starts: int = Field(default=2, ge=1, le=50, description="number of starting points of a fit")
    identifiable_below: float = Field(
        default=1.0,
        gt=0,
        le=100,
        description="a stiffness is identifiable when the standard error of its natural "
        "logarithm is below this",
    )
    cross_validation: CrossValidation = Field(
        default_factory=CrossValidation, description="what is held out"
    )
    significance: float = Field(
        default=0.05, gt=0, lt=1, description="p-values below this are called significant"
    )
