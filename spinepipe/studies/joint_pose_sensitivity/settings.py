"""Settings of a joint-pose study: what landmark uncertainty does to stiffness and motion."""

from itertools import pairwise
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, BaseModel, Field, model_validator

from spinepipe.anatomy import published
from spinepipe.studies.parts import (
    AUTO,
    FORM,
    Damping,
    DiagonalStiffness,
    EachOnce,
    Free,
    Shift,
    Tests,
    Weights,
    with_stiffness,
)
from spinepipe.studies.study import Study
from spinepipe.units import COORDINATES

_BOX = published("gould_2024a")["start_stiffness_box"]


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


def _with_zero(shifts: tuple[float, ...]) -> tuple[float, ...]:
    if 0.0 not in shifts:
        raise ValueError("0 among them, the point of the study itself")
    return shifts


_Shifts = Annotated[
    tuple[Annotated[float, Field(ge=-200, le=200)], ...],
    Field(strict=False, min_length=1, max_length=50),
    AfterValidator(_rising),
    AfterValidator(_with_zero),
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


SETS_PER_BATCH = 50
"""Bootstrap fits that one job makes side by side."""


class Bootstrap(BaseModel):
    """Fits in the cohort's own joint poses, from sampled starts or with sampled damping."""

    model_config = FORM

    sets: int = Field(default=100, ge=0, le=1000, description="sampled sets; 0 leaves it out")
    loadings: _Loadings = Field(
        default=("equilibrium",),
        description="ways of loading each set is fitted under: equilibrium, quasi_static, dynamic; "
        "the last two need masses and inertias, and a hundred times as long",
    )


@with_stiffness(_BOX["low"])
class LowestStart(DiagonalStiffness):
    """Smallest stiffness that a bootstrap starts from (Gould 2024a, Table 1)."""


@with_stiffness(_BOX["high"])
class HighestStart(DiagonalStiffness):
    """Largest stiffness that a bootstrap starts from (Gould 2024a, Table 1)."""


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


TWO_SDS = 2.0
"""So far fits must reach where the load point has an SD; the prior is cut off where they end."""


class LoadPoint(BaseModel):
    """Does the fitted stiffness hang on where the load acts?"""

    model_config = FORM

    anterior_mm: _Shifts = Field(
        default=(0.0,), description="shifts anterior of all load points that are tried, mm, with 0"
    )
    superior_mm: _Shifts = Field(
        default=(0.0,), description="shifts superior of all load points that are tried, mm, with 0"
    )
    anterior_sd_mm: float = Field(
        default=0.0, ge=0, le=50, description="SD of the load points anterior, mm; 0: known"
    )
    superior_sd_mm: float = Field(
        default=0.0, ge=0, le=100, description="SD of the load points superior, mm; 0: known"
    )

    @model_validator(mode="after")
    def _reaches(self) -> Self:
        for way, shifts, sd in (
            ("anterior", self.anterior_mm, self.anterior_sd_mm),
            ("superior", self.superior_mm, self.superior_sd_mm),
        ):
            if sd > 0.0 and (shifts[0] > -TWO_SDS * sd or shifts[-1] < TWO_SDS * sd):
                ends = f"{-TWO_SDS * sd:g} to {TWO_SDS * sd:g}"
                raise ValueError(f"{way}_mm from {ends} at least: two SDs of {sd:g} each way")
        return self

    @property
    def asked(self) -> bool:
        """Whether any other load point is tried."""
        return len(self.anterior_mm) * len(self.superior_mm) > 1 or self.uncertain

    @property
    def uncertain(self) -> bool:
        """Whether load points have an SD."""
        return self.anterior_sd_mm > 0.0 or self.superior_sd_mm > 0.0


class Calibration(BaseModel):
    """How stiffness is fitted to measured motion."""

    model_config = FORM

    free: Free = Field(
        default=(AUTO,),
        description="coordinates whose stiffness is fitted, or auto: those that were loaded and "
        "measured, each of which then counts in the cost; the others keep their start",
    )
    grouping: Literal["per_specimen", "per_joint"] = Field(
        default="per_specimen",
        description="one stiffness for all joints of a specimen, or one for each",
    )
    weights: Weights = Field(default_factory=Weights, description="weights on mm and degrees")
    bound_factor: float = Field(
        default=1000.0, gt=1, le=1e9, description="bounds are start / factor and start x factor"
    )
    starts: int = Field(default=4, ge=1, le=50, description="number of starting points of the fit")
    identifiable_below: float = Field(
        default=1.0,
        gt=0,
        le=100,
        description="a stiffness is identifiable when the standard error of its natural "
        "logarithm is below this, and its region is open at neither bound",
    )


class PosteriorSettings(BaseModel):
    """What the data make likely of stiffness and landmarks together."""

    model_config = FORM

    draws: int = Field(
        default=0, ge=0, le=100000, description="draws of each chain; 0 leaves the posterior out"
    )
    warm_up: int = Field(
        default=100, ge=20, le=100000, description="steps of each chain before its draws"
    )
    chains: int = Field(default=4, ge=2, le=64, description="chains, each from a start of its own")
    stiffness_factor: float | None = Field(
        default=None,
        gt=1,
        le=1e9,
        description="before the data are seen a stiffness is as likely to be of any size (flat in "
        "its logarithm) from start / factor to start x factor; null: calibration.bound_factor",
    )
    noise: Literal["scatter", "declared"] = Field(
        default="scatter",
        description="what may part measured motion from the model's; scatter: the declared error "
        "of readings and the scatter that the fit in the cohort's own pose leaves, shared out as "
        "the weights do; declared: the declared error alone, for a model that is believed",
    )


class JointPoseSensitivity(Study):
    """Sample landmarks, rebuild the joint poses, calibrate the stiffness for each, compare."""

    kind: Literal["joint_pose_sensitivity"] = Field(description="kind of study")
    seed: int = Field(default=2024, ge=0, le=2**32 - 1, description="seed of every random draw")
    tests: Tests | None = Field(
        default=None, description="load cases used; null: all that have a load and a motion"
    )
    poses: int = Field(
        default=500, ge=2, le=20000, description="sampled landmark sets per specimen"
    )
    landmark_sd_mm: float | None = Field(
        default=None,
        gt=0,
        le=20,
        description="SD of a landmark per axis, mm; null: the cohort's sd_mm",
    )
    load_point_shift_mm: Shift = Field(
        default_factory=Shift, description="added to every load point, ground axes"
    )
    stiffness: DiagonalStiffness = Field(
        default_factory=DiagonalStiffness, description="stiffness the calibration starts from"
    )
    damping: Damping = Field(default_factory=Damping, description="viscous damping")
    loading: Literal["equilibrium", "settle"] = Field(
        default="equilibrium",
        description="how simulations are solved; equilibrium: static; settle: the state a time "
        "after the load was applied. Stiffness is fitted to equilibria in either case",
    )
    settle_time_s: float = Field(
        default=1.5, gt=0, le=60, description="time after which a settling spine is read, s"
    )
    calibration: Calibration = Field(
        default_factory=Calibration, description="how stiffness is fitted"
    )
    best_models: int = Field(
        default=10,
        ge=1,
        le=99,
        description="best stiffnesses of a specimen that all its poses are run with",
    )
    success: Success = Field(default_factory=Success, description="which fits count")
    start_bootstrap: StartBootstrap = Field(
        default_factory=StartBootstrap, description="fits from sampled start values"
    )
    damping_bootstrap: DampingBootstrap = Field(
        default_factory=DampingBootstrap, description="fits with sampled damping"
    )
    dynamic: Dynamic = Field(default_factory=Dynamic, description="dynamic loading of bootstraps")
    methods: Methods = Field(
        default_factory=Methods, description="fits in the published way, for comparison"
    )
    landmark_precision: LandmarkPrecision = Field(
        default_factory=LandmarkPrecision, description="errors over landmark SD"
    )
    load_point: LoadPoint = Field(
        default_factory=LoadPoint,
        description="stiffness over load points; left out with one shift each way and no SD",
    )
    posterior: PosteriorSettings = Field(
        default_factory=PosteriorSettings,
        description="stiffness and landmarks that the data make likely",
    )
    significance: float = Field(
        default=0.05, gt=0, lt=1, description="p-values below this are called significant"
    )
    block: int = Field(default=25, ge=1, le=1000, description="poses per summary table")
