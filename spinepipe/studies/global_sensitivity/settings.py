"""What a study of global sensitivity asks: factors, design, outputs, fits of stiffness."""

from collections.abc import Iterable, Mapping
from typing import Annotated, Literal, Self, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    Discriminator,
    Field,
    StringConstraints,
    Tag,
    model_validator,
)

from spinepipe.cohort import Cohort
from spinepipe.documents.names import distinct
from spinepipe.sensitivity_analysis.global_indices.design import DUMMY, Method
from spinepipe.sensitivity_analysis.global_indices.estimates import INDICES
from spinepipe.studies.global_sensitivity.factors import AnyFactor, FactorChange, Of
from spinepipe.studies.parts import (
    AUTO,
    FORM,
    Coordinate,
    Damping,
    EachOnce,
    Free,
    LevelStiffness,
    PublishedStiffness,
    Tests,
    Weights,
)
from spinepipe.studies.study import Study

T = TypeVar("T")

FITTED = "fitted"
"""In place of a stiffness: each specimen's own."""


class SampleCalibration(BaseModel):
    """One stiffness for all joints of a specimen, fitted to its measured motion."""

    model_config = FORM

    free: Free = Field(
        default=(AUTO,),
        description="coordinates whose stiffness is fitted, or auto: those that were loaded and "
        "measured, each of which then counts in the cost; the others keep the sample's, or that "
        "of `start`",
    )
    start: PublishedStiffness = Field(
        default_factory=PublishedStiffness,
        description="where the fit of `stiffness: fitted` begins, and what it leaves alone",
    )
    weights: Weights = Field(default_factory=Weights, description="weights on mm and degrees")
    bound_factor: float = Field(
        default=1000.0, gt=1, le=1e9, description="bounds are start / factor and start x factor"
    )
    identifiable_below: float = Field(
        default=1.0,
        gt=0,
        le=100,
        description="a stiffness is identifiable when the standard error of its natural "
        "logarithm is below this",
    )


MOST_SINGLE_TARGETS = 2000
"""Samples x specimens up to which each sample is a target of its own."""

SAMPLES_PER_TARGET = 256
"""Samples per target beyond that."""

SLOW = ("delta",)
"""Indices that are computed only when they are named."""

IndexName = Literal[
    "S1", "ST", "S2", "mu", "mu_star", "sigma", "S1_RBD", "PAWN", "KS_low", "KS_high", "delta"
]


_BaseStiffness = Annotated[
    Annotated[PublishedStiffness, Tag("given")] | Annotated[Literal["fitted"], Tag(FITTED)],
    Discriminator(lambda given: FITTED if isinstance(given, str) else "given"),
]

_Coordinates = Annotated[tuple[Coordinate, ...], Field(strict=False), AfterValidator(distinct)]
_Specimens = EachOnce[Annotated[str, StringConstraints(min_length=1)]]


class SensitivityDesign(BaseModel):
    """Which values the factors take."""

    model_config = FORM

    method: Literal["sobol", "latin_hypercube", "morris", "fast"] = Field(
        default="sobol",
        description="sobol: indices S1, ST, S2; latin_hypercube: S1_RBD, PAWN, KS_low, KS_high, "
        "delta; morris: mu, mu_star, sigma; fast: S1, ST",
    )
    samples: int = Field(
        default=256,
        ge=2,
        le=2**24,
        description="base samples; with D factors and groups the runs are sobol samples x "
        "(2 D + 2), or (D + 2) without second order; latin_hypercube samples; morris samples x "
        "(D + 1); fast samples x D",
    )
    second_order: bool = Field(default=True, description="sobol: indices of pairs too")
    levels: int = Field(default=4, ge=2, le=100, description="morris: levels of each factor")
    harmonics: int = Field(
        default=4, ge=1, le=20, description="fast: harmonics that are summed into S1"
    )

    def runs_per_sample(self, compared: int) -> int:
        """Runs for each base sample, with so many factors and groups, the dummy among them."""
        pairs = 2 if self.second_order else 1
        runs = {"sobol": pairs * compared + 2, "morris": compared + 1, "fast": compared}
        return runs.get(self.method, 1)


class Outputs(BaseModel):
    """What is explained by the factors."""

    model_config = FORM

    motion: _Coordinates = Field(
        default=("extension", "right_bending", "left_rotation"),
        description="coordinates of joint motion; []: none",
    )
    joint_load: _Coordinates = Field(
        default=("extension", "right_bending", "left_rotation"),
        description="coordinates along which the joints' loads are taken (moments along rotations, "
        "forces along translations); []: none",
    )
    stiffness: bool = Field(
        default=False, description="stiffness calibrated to measured motion, once per sample"
    )

    @model_validator(mode="after")
    def _something(self) -> Self:
        if not (self.motion or self.joint_load or self.stiffness):
            raise ValueError("at least one output")
        return self


class GlobalSensitivity(Study):
    """Draw all factors at once, move every specimen, and ask which factor moved the results."""

    kind: Literal["global_sensitivity"] = Field(description="kind of study")
    factors: Annotated[tuple[AnyFactor, ...], Field(strict=False)] = Field(
        description="what is uncertain, and how far"
    )
    design: SensitivityDesign = Field(
        default_factory=SensitivityDesign, description="which values the factors take"
    )
    dummy: bool = Field(
        default=True,
        description="add a factor that changes nothing: its indices are the noise of all others",
    )
    specimens: _Specimens | None = Field(default=None, description="specimens; null: all")
    tests: Tests | None = Field(
        default=None, description="tests of loads.csv, of each its first cycle; null: all"
    )
    steps: Literal["peak", "all"] = Field(
        default="peak", description="load steps: that of the largest load, or all"
    )
    seed: int = Field(default=2024, ge=0, le=2**32 - 1, description="seed of every random draw")
    stiffness: _BaseStiffness = Field(
        default_factory=PublishedStiffness,
        description="stiffness of all joints before factors; `fitted`: each specimen's own, fitted "
        "to its measured motion as `calibration` says",
    )
    level_stiffness: Mapping[str, LevelStiffness] = Field(
        default_factory=dict,
        description="rotational stiffness joint by joint, where it differs from `stiffness`",
    )
    damping: Damping = Field(
        default_factory=Damping, description="viscous damping; decides at most what is stable"
    )
    loading: Literal["equilibrium"] = Field(
        default="equilibrium", description="how simulations are solved: static equilibrium"
    )
    outputs: Outputs = Field(default_factory=Outputs, description="what the factors explain")
    calibration: SampleCalibration = Field(
        default_factory=SampleCalibration,
        description="how stiffness is fitted, where it is `fitted` or an output",
    )
    indices: EachOnce[IndexName] | None = Field(
        default=None,
        description="indices; null: all of the design's method but delta, which takes minutes "
        "where the others take seconds (5 s per output with 24 factors and 1,024 samples)",
    )
    bootstraps: int = Field(
        default=1000, ge=2, le=100_000, description="resamples for the intervals of indices"
    )
    confidence: float = Field(default=0.95, gt=0, lt=1, description="coverage of the intervals")
    samples_per_target: int | None = Field(
        default=None,
        ge=1,
        le=1_000_000,
        description="runs of a specimen that one job computes; null: 1 up to 2,000 runs x "
        "specimens, beyond that 256",
    )
    most_failed: float = Field(
        default=0.2, ge=0, lt=1, description="share of failed runs above which no index is given"
    )

    @property
    def is_fitted(self) -> bool:
        """Whether factors start from each specimen's own fit."""
        return self.stiffness == FITTED

    @property
    def start_stiffness(self) -> PublishedStiffness:
        """What all joints have before anything is fitted."""
        return self.calibration.start if isinstance(self.stiffness, str) else self.stiffness

    def _with_dummy(self, own: Iterable[T], dummy: T) -> tuple[T, ...]:
        """(D,) of all factors, the dummy's last where there is one."""
        return (*own, dummy) if self.dummy else tuple(own)

    @property
    def factor_names(self) -> tuple[str, ...]:
        """(D,) names, the dummy's last."""
        return self._with_dummy((factor.label for factor in self.factors), DUMMY)

    @property
    def groups(self) -> tuple[str, ...]:
        """(D,) group of each factor; one without is a group by its own name."""
        return self._with_dummy((one.group or one.label for one in self.factors), DUMMY)

    @property
    def compared(self) -> tuple[str, ...]:
        """(G,) what gets an index: groups in the order of their first factors."""
        return tuple(dict.fromkeys(self.groups))

    @property
    def changes(self) -> tuple[FactorChange, ...]:
        """(D,) what each factor changes."""
        return self._with_dummy((one.change for one in self.factors), FactorChange(Of.NOTHING))

    @property
    def units(self) -> tuple[str, ...]:
        """(D,) unit of each value in files and tables: mm, deg or 1."""
        return self._with_dummy((one.spread.unit for one in self.factors), "1")

    @property
    def per_si(self) -> tuple[float, ...]:
        """(D,) what one SI unit of each value is in its unit of files and tables."""
        return self._with_dummy((one.spread.per_si for one in self.factors), 1.0)

    @property
    def n_runs(self) -> int:
        """Number of runs of each specimen."""
        return self.design.samples * self.design.runs_per_sample(len(self.compared))

    @property
    def chosen_indices(self) -> tuple[str, ...]:
        """Names of the indices that are computed."""
        return self.indices or tuple(
            n for n in INDICES[Method(self.design.method)] if n not in SLOW
        )

    def batch_size(self, specimens: int) -> int:
        """Runs of a specimen that one job computes, in a study of so many specimens."""
        if self.samples_per_target is not None:
            return self.samples_per_target
        return 1 if self.n_runs * specimens <= MOST_SINGLE_TARGETS else SAMPLES_PER_TARGET

    def chosen_specimens(self, cohort: Cohort) -> tuple[str, ...]:
        """The study's specimens."""
        return self.specimens or cohort.specimen_names

    def chosen_tests(self, cohort: Cohort) -> tuple[str, ...]:
        """The study's tests."""
        return self.tests or cohort.tests
