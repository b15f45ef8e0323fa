"""What a study of scoliotic spines asks.

Lateral stiffness is that of lateral bending here, N m/rad, not of a shift to the side. Two words
have two senses: `Scale` says where the size of all stiffness comes from, `Variants.scale` lists
factors that it is tried with; `Scoliosis.enlargement` is a factor (1.2), that of `Variants` a
percentage beyond one (20).
"""

from typing import Annotated, Literal, get_args

from pydantic import BaseModel, Field

from spinepipe.studies.parts import FORM, EachOnce, PublishedStiffness
from spinepipe.studies.study import Study
from spinepipe.units import COORDINATES

# tangent: bounded tangents from the two bending films, as published (Jalalian 2017)
# tangent_fitted: tangents of all segments fitted at once, through the simulator, to places and
#     tilts on both films; what films leave open stays as a population of patients has it
# linear_regions: one multiplier of the stated springs for each curve of the spine (Petit)
# linear_per_segment: a spring for each segment from the same two rotations and moments as tangent
# uniform: the same spring in all segments, nothing is taken from films
ModelName = Literal["tangent", "tangent_fitted", "linear_regions", "linear_per_segment", "uniform"]

# by how much ends are beyond the rotations of the bending films; 0 is told, but has no loads
Percent = Annotated[float, Field(ge=0, le=200)]
Factor = Annotated[float, Field(gt=0, le=1e3)]

MODELS: tuple[ModelName, ...] = get_args(ModelName)


class Scale(BaseModel):
    """Where the size of the stiffness comes from, which films do not tell.

    Films show rotations and no forces, so they decide the ratios between segments alone. The size,
    the geometric mean over segments of the lateral stiffness in the erect pose, is the same in all
    models: it is stated (``mean_stiffness``), or follows from the moment about the apical disc in
    that bend where it is larger (``apical_moment``). Only the one that ``of`` names has a say.
    """

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
        description="geometric mean over segments of the lateral stiffness at rest, N m/rad; "
        "by default that of Gould 2024b Table 2",
    )


class SagittalProfile(BaseModel):
    """What films of the coronal plane do not show of a vertebra: where the joint above it is.

    The joint is at the back end of the lower vertebra's superior endplate: half the depth behind
    the line of the centres, and at ``endplate_share`` of the way from the lower centre to the upper
    one, also where corners were read. The share is half a vertebra over a vertebra and a disc:
    0.5 / (1 + 1/3) = 0.375 of lumbar and 0.5 / (1 + 1/5) = 0.417 of thoracic spines; 0.5 would be a
    disc without height.
    """

    model_config = FORM

    endplate_depth_mm: float = Field(
        default=32.0, gt=5, le=60, description="depth of an endplate, front to back, mm"
    )
    endplate_share: float = Field(
        default=0.38,
        gt=0.2,
        lt=0.5,
        description="superior endplate on the way to the centre above, without corners: 0.375 "
        "where discs are a third as high as vertebrae, as in lumbar spines, 0.417 where a "
        "fifth, as in thoracic ones (Kapandji, Physiology of the Joints 3)",
    )


class Variants(BaseModel):
    """Choices of the published tangent that are varied one at a time, all else as the study has it.

    Without enlargement the loads of the films are infinite: that row says so and has no numbers.
    """

    model_config = FORM

    enlargement_percent: EachOnce[Percent] = Field(
        default=(0.0, 10.0, 20.0, 30.0, 40.0),
        description="how far the ends are beyond the rotations of the bending films",
    )
    scale: EachOnce[Factor] = Field(
        default=(0.1, 0.3, 1.0, 3.0, 10.0),
        description="factor of the lateral stiffness of all segments, other rotations unchanged",
    )


class Scoliosis(Study):
    """Patients whose stiffness is found from bending films, and what other films say of it.

    ``enlargement``: a tangent law has two end rotations that it comes near and never has; they are
    put at so many times the segment's rotations on the two bending films.
    ``model_sd_*`` is the error of the model beside that of reading (``tilt_sd_deg``,
    ``place_sd_mm``), which is stated only where films were not read repeatedly.
    ``film_regions``: ratio is the stiffness of a segment over the geometric mean of all.
    """

    kind: Literal["scoliosis"]
    models: EachOnce[ModelName] = Field(default=MODELS, description="models that are compared")
    enlargement: float = Field(
        default=1.2,
        gt=1.0,
        le=3.0,
        description="ends of the tangent over the rotations of the bending films",
    )
    variants: Variants = Field(default=Variants(), description="choices of tangent that are varied")
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
        description="of the rotations to each other: all follow the size of the lateral one",
    )
    profile: SagittalProfile = Field(
        default=SagittalProfile(), description="depth that the films lack"
    )
    top_may_tip: bool = Field(
        default=False,
        description="whether the uppermost vertebra may tip to the front or back while films hold "
        "it; coronal films do not show it",
    )
    model_sd_deg: float = Field(
        default=0.5,
        gt=0,
        le=20,
        description="SD by which a chain of tangents misses tilts that are read without error; "
        "tangent_fitted trusts films no further",
    )
    model_sd_mm: float = Field(
        default=1.0, gt=0, le=50, description="the same of a vertebra's place on a film, each way"
    )
    film_regions: bool = Field(
        default=True,
        description="whether tangent_fitted looks for how far a patient's films let each ratio go; "
        "takes longer than all else of a patient",
    )
    tilt_sd_deg: float | None = Field(
        default=None,
        gt=0,
        le=20,
        description="SD of the reading of one vertebra's tilt, where no repeats tell it; a tilt "
        "less that of another vertebra has 1.41 times as much",
    )
    place_sd_mm: float | None = Field(
        default=None,
        gt=0,
        le=50,
        description="SD, each way, of a vertebra's place as seen from the lowest one, whose own "
        "error of reading is part of it, where no repeats tell it",
    )
