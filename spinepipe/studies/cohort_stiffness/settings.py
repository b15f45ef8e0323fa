"""What a cohort study asks, and what its fits are fitted to under which name."""

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Literal

from pydantic import BaseModel, Field

from spinepipe.anatomy import published
from spinepipe.anatomy.published import Reproduction
from spinepipe.cohort import Cohort
from spinepipe.cohort.cohort import MeasurementSd, memoize_per_cohort
from spinepipe.studies.base_model import Base
from spinepipe.studies.cohort_stiffness.representations import FITTED, UNLESS_ASKED, named
from spinepipe.studies.parts import (
    FORM,
    Coordinates,
    EachOnce,
    LevelStiffness,
    PublishedStiffness,
    Tests,
)
from spinepipe.studies.study import Study
from spinepipe.units import COORDINATE_COLUMNS, ROTATIONS

GOULD_2024B = Reproduction("gould_2024b", "t12s1_phantom", "Gould et al. 2024b")
"""The paper that asked what cohort studies ask, and the cohort rebuilt from it."""

COVARIATES = ("age_years", "sex", "height_m", "mass_kg", "degeneration_grade")
"""Columns of specimens.csv that stiffness may go with."""

SEXES = {"female": 0.0, "male": 1.0}
"""What the column sex may say, and the number it is regressed on."""

if TYPE_CHECKING:
    Fitted = str
    Covariate = str
else:
    Fitted = Literal[FITTED]
    Covariate = Literal[COVARIATES]


def _published_levels() -> dict[str, LevelStiffness]:
    """Gould 2024b, Table 2, level by level."""
    return {
        joint: LevelStiffness(**{name: float(value) for name, value in values.items()})
        for joint, values in published(GOULD_2024B.paper)["level_stiffness"].items()
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


class PoseNuisance(BaseModel):
    """How far joint centres and axes may be from where they are stated."""

    model_config = FORM

    centre_mm: float = Field(
        default=0.0,
        ge=0,
        le=20,
        description="SD of a joint centre along each axis of its frame, mm; 0: it is as stated",
    )
    axes_deg: float = Field(
        default=0.0,
        ge=0,
        le=15,
        description="SD of the tilt of a joint's axes about each of them, deg; 0: they are as "
        "stated",
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
    representations: EachOnce[Fitted] = Field(
        default=UNLESS_ASKED,
        description="how stiffness is described; what the literature says is always shown beside. "
        "Ratios of levels are left out, unless asked for here, where none are published; laws that "
        "stiffen, and errors of joint centres and axes, are fitted only where asked for",
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
    nuisance: PoseNuisance | None = Field(
        default=None,
        description="errors of joint centres and axes, fitted beside the stiffness by the "
        "representations whose name ends in _nuisance; null: none",
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
        "logarithm is below this, and its region is open at neither bound",
    )
    cross_validation: CrossValidation = Field(
        default_factory=CrossValidation, description="what is held out"
    )
    neutral_zone: Literal["double_sigmoid", "at_zero_load", "threshold"] = Field(
        default="double_sigmoid",
        description="what the neutral zone of a curve is; double_sigmoid: between the bends of the "
        "fitted curve; at_zero_load: between its two ways, where the moment is zero; threshold: "
        "where the fitted curve is softer than neutral_zone_below_nm_per_deg",
    )
    neutral_zone_below_nm_per_deg: float | None = Field(
        default=None, gt=0, le=1e4, description="stiffness of threshold, N m/deg; null: none"
    )
    covariates: EachOnce[Covariate] | None = Field(
        default=None,
        description="columns of specimens.csv that stiffness is regressed on, all together; k of "
        "them need k + 4 specimens; null: it is not asked",
    )
    significance: float = Field(
        default=0.05, gt=0, lt=1, description="p-values below this are called significant"
    )


_SUM = "rotation = c1/(1 + exp(-(a1 + b1 M))) + c2/(1 + exp(-(a2 + b2 M))) + d"
_ZONES = {
    "double_sigmoid": f"from the largest to the least second derivative of {_SUM}, one sigmoid "
    "where two are no better (Smit et al. 2011, doi:10.1186/1471-2474-12-38)",
    "at_zero_load": "rotation at M = 0 on the way down less that at M = 0 on the way up "
    "(zero load method, doi:10.1002/jsp2.1088)",
    "threshold": f"where dM/d(rotation) is below {{:g}} N m/deg on the curve {_SUM} "
    "(stiffness threshold method, doi:10.1002/jsp2.1088)",
}


def zone_formula(study: CohortStiffness) -> str:
    """What the neutral zone of a curve is, of its moment M."""
    return _ZONES[study.neutral_zone].format(study.neutral_zone_below_nm_per_deg)


def representations_of(study: CohortStiffness, joints: Sequence[str]) -> tuple[str, ...]:
    """Those of the study, without ratios of levels where none are published for these joints."""
    levels = has_levels(study, joints)
    return tuple(name for name in study.representations if levels or not named(name).by_level)


def has_levels(study: CohortStiffness, joints: Sequence[str]) -> bool:
    """Whether each joint has a published value of its own against a coordinate that is fitted."""
    return set(joints) <= set(study.level_stiffness) and bool(set(study.free) & set(ROTATIONS))


ALL, ALL_BUT, NOTHING = "all", "all_but_", "nothing"
"""All load cases together; all but the one that follows; what the literature is fitted to."""

NOBODY = "nobody"
"""Who is left out of a pooled fit of all specimens."""


def tests_of(study: CohortStiffness, cohort: Cohort) -> tuple[str, ...]:
    """The study's tests: those chosen, else all that have a reading."""
    return study.tests or _read_tests(cohort)


@memoize_per_cohort
def _read_tests(cohort: Cohort) -> tuple[str, ...]:
    """The tests that have a reading."""
    assert cohort.motion is not None
    read = cohort.motion[list(COORDINATE_COLUMNS)].notna().any(axis=1)
    moved = set(cohort.motion.loc[read, "test"])
    return tuple(test for test in cohort.tests if test in moved)


def load_sets(study: CohortStiffness, tests: Sequence[str]) -> tuple[str, ...]:
    """Labels of what stiffness is fitted to: each test, all, and all but one."""
    several = len(tests) > 1
    held_out = several and study.cross_validation.load_cases
    return (
        *tests,
        *((ALL,) if several else ()),
        *((f"{ALL_BUT}{test}" for test in tests) if held_out and len(tests) > 2 else ()),
    )


def load_cases(labels: Iterable[str]) -> tuple[str, ...]:
    """Load cases that labels of ``fitted_to`` name, each once, in their order."""
    named = (str(label).removeprefix(ALL_BUT) for label in labels)
    return tuple(dict.fromkeys(name for name in named if name not in (ALL, NOTHING)))


def joint_label(labels: Iterable[str]) -> str:
    """What fits to all load cases are called: the one load case where there is no other.

    Parameters
    ----------
    labels : of ``fitted_to``, and names of tests, whether their fits have a result or not.
    """
    every = {str(label) for label in labels} - {NOTHING}
    (name, *others) = every or {ALL}
    return ALL if others or name.startswith(ALL_BUT) else name


def label_of_others(labels: Iterable[str], test: str) -> str | None:
    """What the fit to all load cases but this one is called, None where there is none.

    Of two load cases it is that to the other one.

    Parameters
    ----------
    labels : of ``fitted_to``, and names of tests, whether their fits have a result or not.
    """
    every = {str(label) for label in labels}
    if any(label.startswith(ALL_BUT) for label in every):
        return f"{ALL_BUT}{test}"
    others = [name for name in load_cases(every) if name != test]
    return others[0] if len(others) == 1 else None
