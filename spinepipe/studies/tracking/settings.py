"""What a study of tracked motions asks.

Names of approaches: ``ik`` is inverse kinematics, which looks for markers near their places and
asks for no loads of muscles; ``optk`` is the best motion over all its time, in which these loads
and accelerations cost as well. Passive elements are what joints resist with (`motion.passive`).
"""

import re
from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, Field, WithJsonSchema

from spinepipe.motion.joint_tables import USUAL_SHARES
from spinepipe.motion.smoothing import USUAL_CUTOFF_HZ
from spinepipe.problems import did_you_mean, one_of
from spinepipe.studies.parts import FORM, EachOnce
from spinepipe.studies.study import Study

CONSTRAINED = "ik_constrained_"
"""What the names of approaches with ratios begin with; the rest names the set.

A ratio is the share of a joint in the rotation of all joints together (``ratios.csv``); another
sense than that of `Ratio`.
"""

OWN = "optk_calibrated"
"""The approach that calibrates passive elements on the person's trials of the motion's own kind."""

# ik: markers alone, each frame by itself; joints turn and do not slide
# ik_constrained_*: the same, three rotations in all shared out among joints by ratios
# ik_smooth: markers and small accelerations over the whole motion; no loads
# ik_springs: each frame by itself, joints that slide too and resist as generic passive elements do
# optk_zero: dynamics without passive elements
# optk_generic: with those of passive.csv or of the cohort; *_lower, *_upper: A times those factors
# optk_calibrated, optk_from_*: with passive elements that were fitted, see `OWN` and `LEARNT`
APPROACHES = (
    "ik",
    f"{CONSTRAINED}christophy_2012",
    f"{CONSTRAINED}white_panjabi_1990",
    "ik_smooth",
    "ik_springs",
    "optk_zero",
    "optk_generic",
    "optk_generic_lower",
    "optk_generic_upper",
    "optk_calibrated",
    "optk_from_flexion",
    "optk_from_bending",
    "optk_from_both",
)
"""Approaches that every cohort can be asked for; one with ratios of its own has others besides."""

_WITH_RATIOS = f"{CONSTRAINED}[a-z0-9_]+"


def _known(name: str) -> str:
    """The name as it is, if it is one of an approach; else a `ValueError` with what is allowed."""
    if name in APPROACHES or re.fullmatch(_WITH_RATIOS, name):
        return name
    listed = f"{one_of(APPROACHES)}, or {CONSTRAINED} and the name of a set in ratios.csv"
    meant = did_you_mean(name, APPROACHES, "")
    raise ValueError(f"{listed}; {meant}" if meant else listed)


_PATTERN = "|".join((_WITH_RATIOS, *(a for a in APPROACHES if not a.startswith(CONSTRAINED))))

Approach = Annotated[
    str,
    AfterValidator(_known),
    WithJsonSchema({"type": "string", "pattern": f"^({_PATTERN})$"}),
]
"""Name of an approach; whether ``ratios.csv`` has the set it names is for the checks to say."""

LEARNT: dict[str, str] = {
    "optk_from_flexion": "flexion_extension",
    "optk_from_bending": "lateral_bending",
    "optk_from_both": "both",
}
"""Kind of trials on which the passive elements were calibrated that an approach takes over.

``both``: on trials of both kinds together.
"""

Scaling = Literal["none", "markers"]

# see `motion.residual_terms.MuscleDemand`
ForceCost = Literal["squared", "minus_gravity", "level_difference"]

# a factor: of the generic stiffness in `Profiles`, of `Scales.loads` in `trade_off`
Ratio = Annotated[float, Field(gt=0, le=1e4)]


class Scales(BaseModel):
    """By what each kind of error is divided before it is squared: the larger, the less it counts.

    Some are no such divisors. ``loads`` multiplies the squares of moments and forces, so that more
    counts more. ``frames`` multiplies the mean over a trial's nodes of all these squares.
    ``skin_mm`` and ``shared_skin_mm`` are SDs of an error that markers share (`motion.skin`). A and
    B are the numbers of a passive element, load = A (exp(B q) - 1): A is its size, B how early it
    stiffens; ``size_sd`` and ``shape_sd`` draw calibrated ones to the generic ones.
    """

    model_config = FORM

    marker_mm: float = Field(default=5.0, gt=0, le=100, description="of a marker")
    moment_nm: float = Field(default=10.0, gt=0, le=1e4, description="of a moment of muscles")
    force_n: float = Field(default=200.0, gt=0, le=1e5, description="of a force of muscles")
    loads: float = Field(
        default=1.0, gt=0, le=1e4, description="how much loads count beside markers"
    )
    common_force_n: float = Field(
        default=2000.0,
        gt=0,
        le=1e6,
        description="of the mean force over all joints, where levels are held against each other",
    )
    skin_mm: float = Field(
        default=5.0,
        ge=0,
        le=100,
        description="SD of how far skin slides along a vertebra when the trunk is bent by 60 deg, "
        "each vertebra by itself; with dynamics alone",
    )
    shared_skin_mm: float = Field(
        default=10.0, ge=0, le=100, description="the same, of all vertebrae alike"
    )
    turn_deg_per_s2: float = Field(
        default=600.0, gt=0, le=1e5, description="of an angular acceleration of a joint"
    )
    move_mm_per_s2: float = Field(
        default=2000.0, gt=0, le=1e6, description="of an acceleration along a joint's axes"
    )
    frames: float = Field(
        default=10.0,
        gt=0,
        le=1e4,
        description="independent frames that a trial is worth: skin slides slowly",
    )
    size_sd: float = Field(
        default=0.7, gt=0, le=5, description="SD of the logarithm of a passive element's A"
    )
    shape_sd: float = Field(default=0.35, gt=0, le=5, description="of the logarithm of its B")


class JointLimits(BaseModel):
    """How far joints may go: both ends of each range are multiplied by `times`.

    Beyond it is dear, not forbidden. Approaches that ask for markers alone, `ik_smooth` and those
    with ratios have no ranges.
    """

    model_config = FORM

    increased_by_percent: float = Field(
        default=150.0, gt=0, le=1000, description="of the range of motion"
    )
    means: Literal["added", "of_the_range"] = Field(
        default="added",
        description="what 150 % is: added to the range (2.5 times), or of it (1.5 times)",
    )

    @property
    def times(self) -> float:
        """How many times the range a joint may go."""
        share = self.increased_by_percent / 100.0
        return 1.0 + share if self.means == "added" else share


class Profiles(BaseModel):
    """Whether markers tell stiffness: one region is made stiffer and softer, all else fitted.

    A profile likelihood. Each ratio is the factor of the generic A at which the region's passive
    elements are held in one coordinate (`profile`). A fit for each of them takes long, hence fewer
    intervals than for the motions themselves.
    """

    model_config = FORM

    specimens: EachOnce[str] = Field(default=(), description="persons; none named: the first")
    intervals: int = Field(default=25, ge=10, le=2000, description="between nodes of a motion")
    ratios: EachOnce[Ratio] = Field(
        default=(0.2, 0.4, 0.7, 1.0, 1.5, 2.5, 5.0), description="of the generic stiffness"
    )


class Tracking(Study):
    """Motions of the spine from markers on the skin, by several approaches.

    A motion is a spline whose nodes are ``intervals`` + 1 and evenly spaced in time.
    """

    kind: Literal["tracking"]
    marker_set: Literal["own", "plug_in_gait"] = Field(
        default="own",
        description="own: marker_set.csv of the cohort, by the approaches below; plug_in_gait: "
        "pelvis, thorax, head and arms as Plug-in-Gait marks them, and net moments of all joints "
        "of a spine made of sex, height and mass; of what follows `cutoff_hz` and `ratios` count. "
        "Left out: plug_in_gait where the cohort has neither markers nor joints of its own",
    )
    cutoff_hz: float = Field(
        default=USUAL_CUTOFF_HZ,
        gt=0,
        le=50,
        description="of the zero-phase low-pass filter that Plug-in-Gait markers go through",
    )
    ratios: str = Field(
        default=USUAL_SHARES,
        pattern="^[a-z0-9_]+$",
        description="set of ratios that shares what turns between pelvis and thorax among joints, "
        "with Plug-in-Gait",
    )
    approaches: EachOnce[Approach] = Field(default=APPROACHES, description="what is compared")
    intervals: int = Field(default=100, ge=10, le=2000, description="between nodes of a motion")
    force_cost: ForceCost = Field(
        default="level_difference",
        description="which loads cost: squared, all that muscles do; minus_gravity, as if bodies "
        "had no weight; level_difference, by how much it differs from joint to joint",
    )
    scaling: Scaling = Field(
        default="none",
        description="of skeletons: none, the cohort's are taken as they are; markers, pelvis, "
        "lumbar and thoracic part are made as large as markers of the static trial say",
    )
    unloaded_posture: Literal["neutral", "standing"] = Field(
        default="neutral",
        description="where passive elements are at rest: neutral, in the cohort's neutral pose; "
        "standing, as the static trial's markers are. Markers cannot tell it from weight",
    )
    scales: Scales = Field(default=Scales(), description="what counts as much as what")
    bounds: JointLimits = Field(default=JointLimits(), description="ranges of joints")
    largest_deviation_mm: float = Field(
        default=40.0, gt=0, le=1000, description="of a marker; beyond it a status says so"
    )
    profiles: Profiles = Field(default=Profiles(), description="whether markers tell stiffness")
    trade_off: EachOnce[Ratio] = Field(
        default=(0.1, 0.3, 1.0, 3.0, 10.0),
        description="factors of `scales.loads` that are tried, on the first person",
    )
    drawn_approaches: EachOnce[Approach] = Field(
        default=("ik", "optk_generic"), description="approaches in the animation"
    )
