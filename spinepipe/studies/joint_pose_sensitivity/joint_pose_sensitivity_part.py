"""The study kind that asks how much the landmarks' uncertainty does to stiffness and motion."""

from typing import Literal

from pydantic import BaseModel, Field

from spinepipe.studies.coordinates import FORM, Damping, Shift, Stiffness, Weights
from spinepipe.studies.identification import (
    DampingBootstrap,
    Dynamic,
    LandmarkPrecision,
    Methods,
    StartBootstrap,
    Success,
)
from spinepipe.studies.lists import Coordinates, Tests
from spinepipe.studies.study import Study

__all__ = ["Calibration", "JointPoseSensitivity"]


class Calibration(BaseModel):
    """How stiffness is fitted to measured motion."""

    model_config = FORM

    free: Coordinates = Field(
        default=("anterior", "superior", "extension"),
        description="coordinates whose stiffness is fitted; the others keep their start",
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
        "logarithm is below this",
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
    stiffness: Stiffness = Field(
        default_factory=Stiffness, description="stiffness the calibration starts from"
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
    significance: float = Field(
        default=0.05, gt=0, lt=1, description="p-values below this are called significant"
    )
    block: int = Field(default=25, ge=1, le=1000, description="poses per summary table")
