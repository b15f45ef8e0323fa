"""Parts of a joint-pose study beyond its poses: filters, bootstraps, methods, precision."""

from itertools import pairwise
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, BaseModel, Field, model_validator

from spinepipe.anatomy import published
from spinepipe.studies.coordinates import FORM, Rotational, Stiffness, Translational
from spinepipe.studies.lists import EachOnce
from spinepipe.units import COORDINATES

_BOX = published("gould_2024a")["start_stiffness_box"]
_LOW, _HIGH = _BOX["low"], _BOX["high"]


def _rising(sds: tuple[float, ...]) -> tuple[float, ...]:
    if any(later <= sooner for sooner, later in pairwise(sds)):
        raise ValueError("in rising order, each once")
    return sds


_Loading = Literal["equilibrium", "quasi_static", "dynamic"]
_Loadings = EachOnce[_Loading]
_Millimetres = Annotated[float, Field(gt=0, le=20)]
_SDs = Annotated[
    tuple[_Millimetres, ...], Field(strict=False, min_length=1), AfterValidator(_rising)
]


class Success(BaseModel):
    """Filters of the published study; what they leave is the reduced dataset."""

    model_config = FORM

    near_start_percent: float = Field(
        default=1.0,
        ge=0,
        lt=100,
        description="a stiffness this close to its start or closer counts as not moved, percent",
    )
    failed_when: Literal["all", "any"] = Field(
        default="all",
        description="a fit has failed when all its free stiffnesses have not moved, or any of them",
    )
    outlier_times_start: float = Field(
        default=10.0,
        gt=1,
        description="a fit with a free stiffness of this many times its start is an outlier",
    )


class Bootstrap(BaseModel):
    """Fits in the cohort's own joint poses, from sampled starts or with sampled damping."""

    model_config = FORM

    sets: int = Field(default=100, ge=0, le=1000, description="sampled sets; 0 leaves it out")
    loadings: _Loadings = Field(
        default=("equilibrium",),
        description="ways of loading each set is fitted under: equilibrium, quasi_static, dynamic; "
        "the last two need masses and inertias, and a hundred times as long",
    )


class LowestStart(Stiffness):
    """Smallest stiffness that a bootstrap starts from (Gould 2024a, Table 1)."""

    anterior_n_per_m: Translational = Field(
        default=_LOW["anterior_n_per_m"], description="anterior stiffness, N/m"
    )
    superior_n_per_m: Translational = Field(
        default=_LOW["superior_n_per_m"], description="superior stiffness, N/m"
    )
    right_n_per_m: Translational = Field(
        default=_LOW["right_n_per_m"], description="lateral stiffness, N/m"
    )
    extension_nm_per_rad: Rotational = Field(
        default=_LOW["extension_nm_per_rad"], description="flexion-extension stiffness, N m/rad"
    )
    right_bending_nm_per_rad: Rotational = Field(
        default=_LOW["right_bending_nm_per_rad"], description="lateral bending stiffness, N m/rad"
    )
    left_rotation_nm_per_rad: Rotational = Field(
        default=_LOW["left_rotation_nm_per_rad"], description="axial rotation stiffness, N m/rad"
    )


class HighestStart(Stiffness):
    """Largest stiffness that a bootstrap starts from (Gould 2024a, Table 1)."""

    anterior_n_per_m: Translational = Field(
        default=_HIGH["anterior_n_per_m"], description="anterior stiffness, N/m"
    )
    superior_n_per_m: Translational = Field(
        default=_HIGH["superior_n_per_m"], description="superior stiffness, N/m"
    )
    right_n_per_m: Translational = Field(
        default=_HIGH["right_n_per_m"], description="lateral stiffness, N/m"
    )
    extension_nm_per_rad: Rotational = Field(
        default=_HIGH["extension_nm_per_rad"], description="flexion-extension stiffness, N m/rad"
    )
    right_bending_nm_per_rad: Rotational = Field(
        default=_HIGH["right_bending_nm_per_rad"], description="lateral bending stiffness, N m/rad"
    )
    left_rotation_nm_per_rad: Rotational = Field(
        default=_HIGH["left_rotation_nm_per_rad"], description="axial rotation stiffness, N m/rad"
    )


class StartBootstrap(Bootstrap):
    """Does the start decide about the fitted stiffness?"""

    lowest: LowestStart = Field(
        default_factory=LowestStart, description="smallest sampled stiffness"
    )
    highest: HighestStart = Field(
        default_factory=HighestStart, description="largest sampled stiffness"
    )

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        ends = zip(self.lowest.in_order(), self.highest.in_order(), strict=True)
        wrong = [name for name, (low, high) in zip(COORDINATES, ends, strict=True) if low > high]
        if wrong:
            raise ValueError(f"highest at least lowest (not so: {', '.join(wrong)})")
        return self


class DampingBootstrap(Bootstrap):
    """Does damping decide about the fitted stiffness?"""

    sets: int = Field(default=0, ge=0, le=1000, description="sampled sets; 0 leaves it out")
    factor: float = Field(
        default=10.0,
        gt=1,
        le=1e4,
        description="damping is drawn between damping / factor and damping x factor",
    )


class Dynamic(BaseModel):
    """Loads that grow in time."""

    model_config = FORM

    ramp_s: float = Field(
        default=1.0, gt=0, le=60, description="time in which the load grows; then motion is read"
    )
    steps_per_s: float = Field(
        default=25.0,
        gt=0,
        le=1000,
        description="times per second at which the load is given; straight in between",
    )


class Methods(BaseModel):
    """The same fits by forward runs with derivatives by differences, as published."""

    model_config = FORM

    poses: int = Field(
        default=0, ge=0, le=1000, description="poses fitted; 0 leaves it out. The dearest fits"
    )
    sane_step: float = Field(
        default=1e-3, gt=0, lt=1, description="relative difference step chosen with care"
    )
    accuracy: float = Field(
        default=1e-5, gt=0, lt=1, description="relative accuracy asked of the forward run"
    )


class LandmarkPrecision(BaseModel):
    """How precise must landmarks be for errors below a limit?"""

    model_config = FORM

    sd_mm: _SDs = Field(
        default=(0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0), description="sampled SDs of all landmarks, mm"
    )
    poses: int = Field(
        default=80, ge=0, le=10000, description="poses sampled for each SD; 0 leaves it out"
    )
    translation_limit_mm: float = Field(
        default=1.0, gt=0, le=100, description="limit of translation errors, mm"
    )
    rotation_limit_deg: float = Field(
        default=1.0, gt=0, le=100, description="limit of rotation errors, degrees"
    )
    share: float = Field(
        default=0.95, gt=0, lt=1, description="share of poses that must stay below the limits"
    )
