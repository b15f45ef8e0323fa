"""What a study of trunk loads asks."""

from collections.abc import Mapping
from typing import Literal

from pydantic import BaseModel, Field

from spinepipe.studies.parts import FORM, EachOnce
from spinepipe.studies.study import Study

Geometry = Literal["myo_sim", "cohort"]
Curves = Literal["segment_gould", "mixed", "segment", "disc_heuer", "disc_jaramillo", "disc_han"]
TrunkAngle = Literal["measured_at_thorax", "rotation_of_t11"]
Factor = Literal[
    "height_cm",
    "bmi",
    "age_years",
    "hand_anterior_mm",
    "pelvis_extension_deg",
    "trunk_extension_deg",
    "disc_area",
    "pcsa",
    "passive_rotation",
    "passive_muscle",
    "trunk_mass_ahead",
    "pressure_kpa",
    "largest_stress_mpa",
]

FACTOR_UNITS: Mapping[str, str] = {
    "height_cm": "cm",
    "bmi": "kg/m2",
    "age_years": "years",
    "hand_anterior_mm": "mm",
    "pelvis_extension_deg": "deg",
    "trunk_extension_deg": "deg",
    "disc_area": "",
    "pcsa": "",
    "passive_rotation": "",
    "passive_muscle": "",
    "trunk_mass_ahead": "",
    "pressure_kpa": "kPa",
    "largest_stress_mpa": "MPa",
}
"""Of the inputs that are added; the others multiply."""

NOMINAL: Mapping[str, float] = {name: 0.0 if unit else 1.0 for name, unit in FACTOR_UNITS.items()}
"""Values that change nothing."""

PAPER_COHORTS = ("trunk_volunteers",)
"""Persons and tasks of the captions and of Table 1 of Ghezelbash 2016,
doi 10.1007/s10237-016-0792-3."""


def reproduces(cohort: str) -> bool:
    """Whether a cohort has the paper's volunteers: only then are results set beside its numbers."""
    return cohort in PAPER_COHORTS


class Passive(BaseModel):
    """Joints and stretched muscles, before anyone pulls."""

    model_config = FORM

    curves: Curves = Field(
        default="disc_han",
        description="moment-rotation curves: segment (Schmidt 1998), discs alone (Heuer 2007, "
        "Jaramillo, Han 2010), or mixed: sideways the disc of Heuer, else the segment",
    )
    rotation_factor: float = Field(
        default=1.0, gt=0, le=10, description="factor of all moments of joints"
    )
    t11t12: Literal["segment_wilke", "as_t12l1"] = Field(
        default="segment_wilke",
        description="T11T12: whole segment with its rib joints (Wilke 2017), or as T12L1 by its "
        "disc",
    )
    t11t12_bending_factor: float = Field(
        default=1.2,
        gt=0,
        le=10,
        description="of T11T12 as T12L1, for the rib cage (Ghezelbash 2016 2.1)",
    )
    ligaments_nm: float = Field(
        default=95.0,
        ge=0,
        le=300,
        description="moment of ligaments and fascia behind L5S1 in full flexion, of a man, beside "
        "disc and stretched muscles (Dolan 1994); 0: none",
    )
    joints_behind_mm: float = Field(
        default=4.0,
        ge=0,
        le=20,
        description="how far joints lie behind their centres (Ghezelbash 2016 2.1)",
    )
    muscle_factor: float = Field(
        default=1.0, ge=0, le=10, description="factor of the force of stretched muscles"
    )
    strain_at_full_force: float = Field(
        default=0.6, gt=0.05, le=2, description="stretch at which it is the largest active force"
    )
    shape: float = Field(default=5.0, gt=0.1, le=20, description="shape of the curve (Thelen 2003)")
    fibre_share: float = Field(
        default=1.0,
        gt=0.1,
        le=1,
        description="share of a muscle's upright length that stretches, where its source has no "
        "length of the fibres; 1: all of it",
    )
    stiffens_under_compression: bool = Field(
        default=True, description="whether compression stiffens joints (Gardner-Morse 2004)"
    )


class Wrapping(BaseModel):
    """How muscles that lie on vertebrae run round them."""

    model_config = FORM

    depth: float = Field(
        default=0.9,
        gt=0.3,
        le=1,
        description="share of a fascicle's distance from the vertebra, in the source's pose, below "
        "which it cannot come",
    )
    least_mm: float = Field(
        default=50.0,
        ge=0,
        le=90,
        description="but no nearer than this: the lever arm commonly taken for the erector spinae "
        "(Gungor 2013, abstract)",
    )


class Solving(BaseModel):
    """When forces and geometry have settled."""

    model_config = FORM

    change: float = Field(
        default=0.01, gt=0, le=0.2, description="change of forces over their size, less than"
    )
    residual_nm: float = Field(
        default=0.1, gt=0, le=10, description="moment out of balance, less than"
    )
    slack_nm: float = Field(
        default=0.5,
        ge=0,
        le=10,
        description="moment that may be left over before a task counts as beyond strength",
    )
    most_iterations: int = Field(default=60, ge=2, le=1000, description="rounds at most")
    stiffness_gain: float = Field(
        default=5.0,
        ge=0,
        le=200,
        description="q of a muscle's stiffness q force / length, in the question of stability",
    )
    strength: bool = Field(
        default=True,
        description="whether to find the strength left at every level, and the least stress of "
        "tasks that less than allowed holds",
    )


class InputSpread(BaseModel):
    """How far one input may be off: mean and SD of a normal distribution."""

    model_config = FORM

    sd: float = Field(gt=0, le=1e4, description="SD, in the unit of the factor; of factors, of 1")


class Uncertain(BaseModel):
    """Samples of persons and models."""

    model_config = FORM

    factors: dict[Factor, InputSpread] = Field(
        default={
            "height_cm": InputSpread(sd=1.0),
            "bmi": InputSpread(sd=0.5),
            "hand_anterior_mm": InputSpread(sd=50.0),
            "pelvis_extension_deg": InputSpread(sd=4.0),
            "trunk_extension_deg": InputSpread(sd=2.0),
            "disc_area": InputSpread(sd=0.1),
            "pcsa": InputSpread(sd=0.15),
            "passive_rotation": InputSpread(sd=0.25),
            "passive_muscle": InputSpread(sd=0.3),
            "largest_stress_mpa": InputSpread(sd=0.1),
        },
        description="inputs that are drawn, with their spread",
    )
    tasks: EachOnce[str] = Field(default=(), description="tasks that are sampled")
    specimens: EachOnce[str] = Field(
        default=(), description="persons that are sampled; none named: the first"
    )
    samples: int = Field(
        default=32, ge=4, le=100_000, description="base samples; runs are (factors + 2) times that"
    )
    samples_per_target: int = Field(default=64, ge=1, le=10_000, description="runs in one batch")
    seed: int = Field(default=1, ge=0, description="seed of the design")

    @property
    def runs(self) -> int:
        """Samples in all, of Sobol's design without second order."""
        return self.samples * (len(self.factors) + 2)


class Motions(BaseModel):
    """Recorded lifts, frame by frame."""

    model_config = FORM

    trials: EachOnce[str] = Field(
        default=(),
        description="recorded trials whose frames are tasks, of everyone who has them; left out: "
        "all that move where the cohort has no tasks.csv",
    )
    every: int = Field(default=1, ge=1, le=1000, description="take every so manieth frame")
    largest_stress_mpa: float = Field(
        default=0.6,
        gt=0,
        le=3,
        description="largest active stress of muscles; what it does not hold is held at the least "
        "that does, as far as trunks have it",
    )
    samples: int = Field(
        default=40,
        ge=0,
        le=10_000,
        description="persons drawn for bands, by the factors of uncertain; 0: no bands. Hands are "
        "where they were seen: their factor does not count",
    )
    samples_every: int = Field(
        default=10, ge=1, le=1000, description="bands are of every so manieth frame that is taken"
    )


class VolunteerSettings(BaseModel):
    """The person whose pressures were measured, and what may be fitted to them."""

    model_config = FORM

    specimen: str = Field(description="person of the cohort that stands for the volunteer")
    tuned: EachOnce[Factor] = Field(
        default=("passive_rotation", "disc_area"),
        description="numbers that are fitted, two at most",
        max_length=2,
    )


class TrunkLoads(Study):
    """What tasks ask of persons' trunks."""

    kind: Literal["trunk_loads"]
    geometry: Geometry = Field(
        default="myo_sim", description="where geometry and muscles are from: package or cohort"
    )
    source_stress_mpa: float | None = Field(
        default=None,
        gt=0,
        le=5,
        description="largest force over cross-section in a cohort's muscles, MPa, where only "
        "forces are given",
    )
    regressions: str = Field(
        default="ct_trends",
        min_length=1,
        description="how size follows from sex, age, height and mass: ct_trends, constant_density, "
        "or a CSV file in the cohort's folder",
    )
    upright_start_deg: tuple[float, ...] = Field(
        default=(-2.5, -2.5, -0.5, 1.5, 2.5, 2.5, 1.0, -1.5),
        min_length=8,
        max_length=8,
        description="extension of S1, L5, ... L1, T12, T11 from the source's pose about which the "
        "upright posture is sought, within 5 deg; by default half of what whole segments as stiff "
        "as those of Gould 2024b stand in",
    )
    trunk_angle: TrunkAngle = Field(
        default="measured_at_thorax", description="what a task's rotation of the trunk means"
    )
    passive: Passive = Field(default=Passive(), description="joints and stretched muscles")
    wrapping: Wrapping = Field(default=Wrapping(), description="muscles on vertebrae")
    solving: Solving = Field(default=Solving(), description="when forces have settled")
    disc_area_factor: float = Field(default=1.0, gt=0, le=5, description="factor of all disc areas")
    drawn_tasks: EachOnce[str] = Field(
        default=(), description="tasks whose muscles are drawn in 3-D; none named: the first"
    )
    uncertain: Uncertain = Field(default=Uncertain(), description="samples of persons and models")
    motions: Motions = Field(default=Motions(), description="recorded lifts, frame by frame")
    volunteer: VolunteerSettings | None = Field(
        default=None, description="the person whose pressures were measured"
    )
    simplified_tasks: EachOnce[str] = Field(
        default=(), description="tasks on which wrong simplifications are tried; none named: all"
    )
