"""What a study of scoliotic spines asks."""

from typing import Literal, get_args

from pydantic import BaseModel, Field

from spinepipe.studies.parts import FORM, EachOnce, PublishedStiffness
from spinepipe.studies.study import Study
from spinepipe.units import COORDINATES

ModelName = Literal["tangent", "tangent_fitted", "linear_regions", "linear_per_segment", "uniform"]

MODELS: tuple[ModelName, ...] = get_args(ModelName)


class Scale(BaseModel):
    """Where the size of the stiffness comes from, which films do not tell."""

    model_config = FORM

    of: Literal["apical_moment", "mean_stiffness"] = Field(
        default="apical_moment", description="what is stated from outside"
    )
    apical_moment_nm: float = Field(
        default=63.0,
        gt=0,
        le=1000,
        description="larger of the two moments about the apical disc, N m (Jalalian 2017 Eq 5)",
    )
    mean_stiffness_nm_per_rad: float = Field(
        default=PublishedStiffness().in_order()[COORDINATES.index("right_bending")],
        gt=0,
        le=1e5,
        description="mean lateral stiffness at rest, N m/rad (Gould 2024b Table 2)",
    )


class Profile(BaseModel):
    """What films of the coronal plane do not show of a vertebra."""

    model_config = FORM

    endplate_depth_mm: float = Field(
        default=32.0, gt=5, le=60, description="depth of an endplate, front to back, mm"
    )
    endplate_share: float = Field(
        default=0.38,
        gt=0.2,
        lt=0.5,
        description="superior endplate on the way to the centre above, without corners",
    )


class Scoliosis(Study):
    """Patients whose stiffness is found from bending films, and what other films say of it."""

    kind: Literal["scoliosis"]
    models: EachOnce[ModelName] = Field(default=MODELS, description="models that are compared")
    enlargement: float = Field(
        default=1.2,
        gt=1.0,
        le=3.0,
        description="ends of the tangent over the rotations of the bending films",
    )
    arm: Literal["erect", "film"] = Field(
        default="film", description="film on which the arms of the bending force are measured"
    )
    direction: Literal["lateral", "across_chord"] = Field(
        default="lateral",
        description="direction of the bending force: along ground, or across the line from the "
        "lowest to the uppermost vertebra",
    )
    scale: Scale = Field(default=Scale(), description="where the size of the stiffness comes from")
    stiffness: PublishedStiffness = Field(
        default=PublishedStiffness(),
        description="stiffness of the other rotations; start of the lateral one",
    )
    profile: Profile = Field(default=Profile(), description="depth that the films lack")
    tilt_sd_deg: float | None = Field(
        default=None, gt=0, le=20, description="SD of a vertebra's tilt, where no repeats tell it"
    )
    place_sd_mm: float | None = Field(
        default=None, gt=0, le=50, description="SD of a vertebra's place, where no repeats tell it"
    )
