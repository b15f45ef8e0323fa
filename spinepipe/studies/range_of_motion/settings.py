"""The study kind that asks how far spines of known geometry move in tests that nobody did."""

from collections.abc import Mapping
from typing import Literal

from pydantic import BaseModel, Field

from spinepipe.studies.coordinates import FORM, Damping
from spinepipe.studies.lists import EachOnce, Tests
from spinepipe.studies.published_stiffness import LevelStiffness, PublishedStiffness
from spinepipe.studies.study import Study

__all__ = ["PoseSd", "RangeOfMotion", "VirtualTests"]

VirtualTest = Literal[
    "flexion", "extension", "right_bending", "left_bending", "left_rotation", "right_rotation"
]


class PoseSd(BaseModel):
    """How uncertain a joint frame is."""

    model_config = FORM

    translation_mm: float = Field(
        ge=0, le=50, description="SD of a frame's origin per axis of the frame, mm"
    )
    rotation_deg: float = Field(
        ge=0, le=45, description="SD of a frame's rotation about each of its axes, degrees"
    )


class VirtualTests(BaseModel):
    """Pure moments on the most cranial vertebra, fixed in ground."""

    model_config = FORM

    moment_nm: float = Field(default=7.5, gt=0, le=100, description="largest moment, N m")
    tests: EachOnce[VirtualTest] = Field(
        default=("flexion", "extension", "right_bending", "left_bending", "left_rotation",
                 "right_rotation"),
        description="where the moment turns the vertebra",
    )  # fmt: skip
    steps: int = Field(
        default=10, ge=1, le=1000, description="equal steps in which the moment grows"
    )


class RangeOfMotion(Study):
    """Move every spine in all tests, for sampled joint frames and stiffness sets."""

    kind: Literal["range_of_motion"] = Field(description="kind of study")
    seed: int = Field(default=2024, ge=0, le=2**32 - 1, description="seed of every random draw")
    poses: int = Field(
        default=50,
        ge=0,
        le=9999,
        description="sets of joint frames per specimen; the first is the cohort's own, the others "
        "are sampled; 0 or 1: the cohort's own only",
    )
    pose_sd: PoseSd | None = Field(
        default=None,
        description="uncertainty of the joint frames; null: the cohort's measurement_sd, which is "
        "that of a frame only in a cohort without motion.csv: others must name it here",
    )
    virtual_tests: VirtualTests | None = Field(
        default_factory=VirtualTests,
        description="tests that are computed; null: those of the cohort's loads.csv, of each its "
        "first cycle",
    )
    tests: Tests | None = Field(
        default=None,
        description="with virtual_tests: null, the tests of loads.csv that are used; null: all",
    )
    stiffness: PublishedStiffness = Field(
        default_factory=PublishedStiffness, description="stiffness of all joints"
    )
    level_stiffness: Mapping[str, LevelStiffness] = Field(
        default_factory=dict,
        description="rotational stiffness joint by joint, where it differs from `stiffness`",
    )
    stiffness_sets: int = Field(
        default=4,
        ge=1,
        le=100,
        description="stiffness sets; the first is the study's own, the others are drawn around it",
    )
    stiffness_spread: float = Field(
        default=2.0,
        gt=1,
        le=1e4,
        description="each coordinate's stiffness is multiplied by a factor between 1 / spread and "
        "spread, log-uniform, the same at all joints",
    )
    damping: Damping = Field(
        default_factory=Damping, description="viscous damping; decides at most what is stable"
    )
    rows: Literal["peak", "all_steps"] = Field(
        default="peak",
        description="load steps that are computed and stored: that of the largest load, or all",
    )

    @property
    def n_poses(self) -> int:
        """Number of sets of joint frames per specimen."""
        return max(1, self.poses)
