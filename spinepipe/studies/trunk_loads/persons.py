"""From a study and its cohort to persons that stand upright, and to tasks as they are varied."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from hashlib import sha256
from pathlib import Path

import numpy as np

from spinepipe.anatomy import published
from spinepipe.cohort import Cohort
from spinepipe.effects.contract import Array
from spinepipe.muscles.folder import SpecimenTables, source_of_folder
from spinepipe.muscles.masses import masses_of
from spinepipe.muscles.muscle_equilibrium import SolverOptions
from spinepipe.muscles.myo_sim import origin_of_myo_sim, source_of_myo_sim
from spinepipe.muscles.passive_tissue import (
    AXIAL_N_PER_M,
    CURVES,
    LIGAMENTS_BESIDE_LOWEST,
    T11T12_WITH_RIBS,
    JointLaws,
    Ligaments,
    PassiveMuscle,
)
from spinepipe.muscles.paths import Lines, Standoff
from spinepipe.muscles.person import Person
from spinepipe.muscles.pose import JointCentres
from spinepipe.muscles.regressions import PACKAGED, Regressions, packaged, read_regressions
from spinepipe.muscles.scaling import (
    BeamRatios,
    ScaleFactors,
    beam_ratios,
    diaphragm_area,
    scale_trunk,
    t11t12_over_t12l1,
)
from spinepipe.muscles.subject import CM_PER_M, REFERENCE, Subject
from spinepipe.muscles.task import Task
from spinepipe.muscles.trunk import BODIES, LEVELS, Trunk
from spinepipe.muscles.trunk_source import Source
from spinepipe.muscles.upright import Upright, upright
from spinepipe.studies.subjects import subject_of
from spinepipe.studies.trunk_loads.postures import FULL_FLEXION_DEG, leaning_deg, shares
from spinepipe.studies.trunk_loads.settings import TrunkLoads
from spinepipe.units import DEG_PER_RAD, MM_PER_M

REACH_RAD = 5.0 / DEG_PER_RAD
"""How far bodies may turn from the start to stand upright (Ghezelbash 2016 2.6)."""

YOUNGEST_YEARS = 18.0

Values = Mapping[str, float]
"""Value of each uncertain input that is not nominal."""


def source_of(settings: TrunkLoads, cohort: Cohort) -> Source:
    """Geometry and muscles that the study asks for."""
    if settings.geometry == "myo_sim":
        return _of_package(origin_of_myo_sim().sha256)
    tables = cohort.further
    assert cohort.joints is not None
    frames = tables.get("body_frames")
    owner = cohort.joints["specimen"].iloc[0]
    return source_of_folder(
        cohort.name,
        SpecimenTables(
            tables["muscles"],
            tables["muscle_parameters"],
            cohort.joints[cohort.joints["specimen"] == owner],
            None if frames is None else frames[frames["specimen"] == owner],
        ),
        settings.source_stress_mpa and 1e6 * settings.source_stress_mpa,
    )


@lru_cache(maxsize=1)
def _of_package(_sha256: str) -> Source:
    return source_of_myo_sim()


def extra_inputs(settings: TrunkLoads, cohort: Cohort) -> list[str]:
    """What decides besides study and cohort, where the study reads it: digests of the package's
    files, and of a user's table of regressions."""
    found = [origin_of_myo_sim().sha256] if settings.geometry == "myo_sim" else []
    own = cohort.folder / settings.regressions
    if settings.regressions not in PACKAGED and own.is_file():
        found.append(sha256(own.read_bytes()).hexdigest())
    return found


def regressions_of(settings: TrunkLoads, folder: Path) -> Regressions:
    """How size follows from sex, age, height and mass."""
    if settings.regressions in ("ct_trends", "constant_density"):
        return packaged(settings.regressions)
    file = f"{folder.name}/{settings.regressions}"
    return read_regressions(folder / settings.regressions, file)


@dataclass(frozen=True, eq=False)
class UprightPerson:
    """A person of a study, standing upright, and what others like them are made of.

    Attributes
    ----------
    source : trunk of the reference person. upright : how the person stands.
    """

    settings: TrunkLoads
    source: Trunk
    subject: Subject
    regressions: Regressions
    upright: Upright
    person: Person

    @classmethod
    def of(
        cls, settings: TrunkLoads, source: Trunk, subject: Subject, regressions: Regressions
    ) -> "UprightPerson":
        """A person at their size, and how they stand."""
        person = _sized(settings, source, subject, regressions, {}, wrapping=True)
        start = np.array(settings.upright_start_deg) / DEG_PER_RAD
        found = upright(person, start, REACH_RAD)
        standing = person.with_upright(found.turned)
        return cls(settings, source, subject, regressions, found, standing)

    @classmethod
    def of_cohort(cls, settings: TrunkLoads, cohort: Cohort, specimen: str) -> "UprightPerson":
        """A person of a cohort."""
        trunk = source_of(settings, cohort).trunk
        regressions = regressions_of(settings, cohort.folder)
        return cls.of(settings, trunk, subject_of(cohort, specimen), regressions)

    def varied(self, values: Values, wrapping: bool = True) -> Person:
        """The person with other values, or with muscles that run straight.

        How someone stands does not depend on what we know about their discs, and no muscle has a
        say in it: the person stands as found with nothing varied, and `trunk_extension_deg` varies
        that.
        """
        person = _sized(
            self.settings, self.source, self.subject, self.regressions, values, wrapping
        )
        return person.with_upright(self.upright.turned)


def _sized(
    settings: TrunkLoads,
    source: Trunk,
    subject: Subject,
    regressions: Regressions,
    values: Values,
    wrapping: bool,
) -> Person:
    """A person at their size, before it is known how they stand."""
    who = vary_subject(subject, values)
    factors = ScaleFactors(
        pcsa_times=values.get("pcsa", 1.0),
        disc_area_times=settings.disc_area_factor * values.get("disc_area", 1.0),
    )
    trunk = scale_trunk(source, who, REFERENCE, regressions, factors)
    wrap, passive = settings.wrapping, settings.passive
    unknown = np.ones(len(trunk.muscles))
    return Person(
        who,
        JointCentres.of(trunk, passive.joints_behind_mm / MM_PER_M),
        Lines.of(trunk, Standoff(wrap.depth, wrap.least_mm / MM_PER_M), wrapping),
        laws_of(settings, source, beam_ratios(who, REFERENCE, regressions), values),
        PassiveMuscle(
            passive.strain_at_full_force,
            passive.shape,
            passive.muscle_factor * values.get("passive_muscle", 1.0),
            passive.fibre_share,
        ),
        masses_of(trunk, who, values.get("trunk_mass_ahead", 1.0)),
        diaphragm_area(who, REFERENCE, regressions),
        *(np.zeros((len(BODIES), 3)), unknown, unknown),
    )


def laws_of(settings: TrunkLoads, source: Trunk, size: BeamRatios, values: Values) -> JointLaws:
    """Joints of a person of a size; T11T12 with its ribs, or from T12L1 by its disc."""
    passive = settings.passive
    upper = t11t12_over_t12l1(source, passive.t11t12_bending_factor)
    with_ribs = passive.t11t12 == "segment_wilke"
    angular = np.full((len(LEVELS), 3), size.angular * passive.rotation_factor)
    if not with_ribs:
        angular[-1] *= [upper.angular, upper.torsion, upper.angular]
    angular *= values.get("passive_rotation", 1.0)
    full = FULL_FLEXION_DEG / DEG_PER_RAD * shares("extension")
    beside = np.array([LIGAMENTS_BESIDE_LOWEST[level] for level in LEVELS])
    beside[-1] *= not with_ribs  # a whole segment has its own
    ligaments = Ligaments(passive.ligaments_nm * angular[0, 2] * beside, full)
    shear = published("gould_2024b")["uniform_stiffness"]
    across = np.array([[shear["anterior_n_per_m"], shear["right_n_per_m"]]], dtype=float)
    axial: Array = size.axial * np.array([AXIAL_N_PER_M[level] for level in LEVELS])
    axial[-1] = axial[-2] * upper.axial
    return JointLaws(
        CURVES[passive.curves],
        angular,
        axial,
        size.axial * np.repeat(across, len(LEVELS), axis=0),
        passive.stiffens_under_compression,
        T11T12_WITH_RIBS if with_ribs else None,
        ligaments,
    )


def vary_subject(subject: Subject, values: Values) -> Subject:
    """The person with another height, age and body mass index."""
    height = subject.height_m + values.get("height_cm", 0.0) / CM_PER_M
    bmi = subject.bmi + values.get("bmi", 0.0)
    age = max(subject.age_years + values.get("age_years", 0.0), YOUNGEST_YEARS)
    if (height, bmi, age) == (subject.height_m, subject.bmi, subject.age_years):
        return subject
    return Subject(subject.sex, age, height, bmi * height**2)


def vary_task(task: Task, values: Values) -> Task:
    """The task with hands elsewhere, trunk or pelvis turned, other strength and pressure."""
    hands = task.hands
    ahead = values.get("hand_anterior_mm", 0.0)
    if ahead and hands.kg > 0.0 and hands.at is not None:
        hands = replace(hands, at=hands.at + np.array([ahead / MM_PER_M, 0.0, 0.0]))
    # who stands upright has the pelvis where it is found
    bent = bool(np.any(task.turned != 0.0))
    pelvis = values.get("pelvis_extension_deg", 0.0) if bent else 0.0
    trunk = values.get("trunk_extension_deg", 0.0)
    turned = task.turned.copy()
    flexion = DEG_PER_RAD * float(task.turned[0, 0] - task.turned[-1, 0])
    turned[:, 0] += leaning_deg(pelvis, trunk, flexion) / DEG_PER_RAD
    return replace(
        task,
        hands=hands,
        turned=turned,
        stress_pa=task.stress_pa + 1e6 * values.get("largest_stress_mpa", 0.0),
        pressure_pa=task.pressure_pa + 1e3 * values.get("pressure_kpa", 0.0),
    )


def solver_options(settings: TrunkLoads, twice: bool = False) -> SolverOptions:
    """When rounds have settled; `twice`: whether to look for a second answer."""
    solving = settings.solving
    ends = (solving.change, solving.residual_nm, solving.slack_nm, solving.most_iterations)
    return SolverOptions(*ends, twice=twice)
