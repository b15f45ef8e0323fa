"""What a study of range of motion asks, and what it demands of its cohort."""

from collections.abc import Iterator, Mapping
from typing import Literal

from pydantic import BaseModel, Field

from spinepipe.cohort import Cohort
from spinepipe.cohort.columns import TABLES
from spinepipe.documents.yaml_text import YamlDocument
from spinepipe.problems import InputProblem
from spinepipe.studies.parts import (
    FORM,
    Damping,
    EachOnce,
    LevelStiffness,
    PublishedStiffness,
    Tests,
)
from spinepipe.studies.places import unknown_levels, unknown_tests
from spinepipe.studies.study import Study

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
        default=(
            "flexion",
            "extension",
            "right_bending",
            "left_bending",
            "left_rotation",
            "right_rotation",
        ),
        description="where the moment turns the vertebra",
    )
    steps: int = Field(
        default=10, ge=1, le=1000, description="equal steps in which the moment grows"
    )
    follower_n: float = Field(
        default=0.0,
        ge=0,
        le=TABLES["loads"].column("follower_n").high,
        description="tension of a follower load through the joints' centres in all steps, N; "
        "motion is told from step 0, where it acts already",
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


def check_range_of_motion(
    document: YamlDocument, study: RangeOfMotion, cohort: Cohort
) -> Iterator[InputProblem]:
    """Every way in which a sound study and a sound cohort do not fit.

    Parameters
    ----------
    document : the study file, for the lines of its keys.
    """
    yield from _poses(document, study, cohort)
    yield from _tests(document, study, cohort)
    yield from unknown_levels(document, study.level_stiffness, cohort.joint_names)


def _poses(document: YamlDocument, study: RangeOfMotion, cohort: Cohort) -> Iterator[InputProblem]:
    """Sampled frames need to know how uncertain they are."""
    if study.n_poses == 1 or study.pose_sd is not None:
        return
    found = f"null with {study.poses} poses, and "
    allowed = "translation_mm and rotation_deg, or poses: 1 for the cohort's own frames only"
    remedy = "set pose_sd, or set poses: 1"
    if cohort.motion is not None:
        found += f"cohort '{cohort.name}' has motion.csv: its measurement_sd is that of a reading"
        yield InputProblem(*document.place_of("pose_sd"), found, allowed, remedy)
    elif cohort.measurement_sd is None:
        found += f"cohort '{cohort.name}' has no measurement_sd"
        remedy = "set pose_sd, give the cohort a measurement_sd, or set poses: 1"
        yield InputProblem(*document.place_of("pose_sd"), found, allowed, remedy)


def _tests(document: YamlDocument, study: RangeOfMotion, cohort: Cohort) -> Iterator[InputProblem]:
    """Either virtual tests or those of loads.csv, which must then be there."""
    if study.virtual_tests is not None:
        if study.tests is not None:
            allowed = "null beside virtual_tests, which name their own tests"
            remedy = "name the tests in virtual_tests.tests, or set virtual_tests: null"
            yield InputProblem(*document.place_of("tests"), ", ".join(study.tests), allowed, remedy)
        return
    if cohort.loads is None:
        found = f"null, and cohort '{cohort.name}' has no loads.csv"
        allowed = "virtual tests, or null with a cohort that has loads.csv"
        remedy = "set virtual_tests: {moment_nm: 7.5, tests: [flexion], steps: 10}"
        yield InputProblem(*document.place_of("virtual_tests"), found, allowed, remedy)
        return
    yield from unknown_tests(document, study.tests, cohort.tests)
