"""What is fitted of a specimen: its tests, its model in one representation, readings and weights.

Effects of the model file that a study builds on act in that model besides the bushings.
"""

import hashlib
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
import pandas as pd

from spinepipe.calibration import MeasuredCase, Problem
from spinepipe.cohort import Cohort
from spinepipe.cohort.cohort import memoize_per_cohort
from spinepipe.cohort.load_tests import coupled_range
from spinepipe.cohort.measured import MeasuredCycle, MeasuredSpecimen, measured_specimen
from spinepipe.cohort.specimen import on_bushings
from spinepipe.effects.contract import Array
from spinepipe.files import Stamp, stamp
from spinepipe.frames import Pose
from spinepipe.jobs.digest import base_marks, provenance
from spinepipe.model import ScopedEffect, SpineModel
from spinepipe.model.file import ModelFile, read_model
from spinepipe.studies.base_model import beside_bushings, own_values
from spinepipe.studies.cohort_stiffness.nuisances import free_nuisances, nuisance_effects
from spinepipe.studies.cohort_stiffness.representations import named
from spinepipe.studies.cohort_stiffness.settings import ALL, ALL_BUT, CohortStiffness, tests_of
from spinepipe.studies.cohort_stiffness.stiffening import free_growth, laws
from spinepipe.studies.parts import Damping, stiffness_of_joints
from spinepipe.studies.problem import BUSHING, stiffness_problem
from spinepipe.units import COORDINATES, ROTATIONS

FIRST_CYCLE = 1
SEEN = "the base model's effects have values found on this specimen, for the file has none for all"


@dataclass(frozen=True)
class SpecimenTests(MeasuredSpecimen):
    """The tests of a specimen that a study uses, and what its labels of them mean."""

    def fitted_to(self, label: str) -> tuple[MeasuredCycle, ...]:
        """The tests that a label of ``fitted_to`` means, as far as the specimen has them."""
        if label == ALL:
            return self.tested
        if not label.startswith(ALL_BUT):
            return tuple(one for one in self.tested if one.case.test == label)
        left_out = label.removeprefix(ALL_BUT)
        if left_out not in self.tests:
            return ()  # nothing would be held out
        return tuple(one for one in self.tested if one.case.test != left_out)

    def stage(self, test: str, label: str) -> str:
        """``fitted`` where a fit to that label saw the test, else ``left_out_case``."""
        within = {one.case.test for one in self.fitted_to(label)}
        return "fitted" if test in within else "left_out_case"

    def why_none(self, label: str) -> str:
        """Why a label of ``fitted_to`` means no test of this specimen, in words."""
        left_out = label.removeprefix(ALL_BUT)
        if label.startswith(ALL_BUT) and left_out not in self.tests:
            return f"not measured in {left_out}: nothing would be held out"
        return f"no motion to fit for {label}"


def specimen_tests(study: CohortStiffness, cohort: Cohort, specimen: str) -> SpecimenTests:
    """The chosen tests of a specimen; cycles without any reading are none."""
    return _specimen_tests(cohort, specimen, tests_of(study, cohort), study.cycles)


@memoize_per_cohort
def _specimen_tests(
    cohort: Cohort, specimen: str, tests: tuple[str, ...], cycles: str
) -> SpecimenTests:
    one = measured_specimen(cohort, specimen, tests)
    read = [cycle for cycle in one.tested if np.isfinite(cycle.readings).any()]
    return SpecimenTests(specimen, one.frames, tuple(_chosen(cycles, read)))


def _chosen(cycles: str, found: Sequence[MeasuredCycle]) -> list[MeasuredCycle]:
    """Cycles that are used, test by test; ``cycles`` as in the study."""
    chosen: list[MeasuredCycle] = []
    for test in dict.fromkeys(one.case.test for one in found):
        of_test = [one for one in found if one.case.test == test]
        later = [one for one in of_test if one.case.cycle != FIRST_CYCLE] or of_test
        if cycles == "all":
            later = of_test
        if cycles == "quietest":
            later = [min(later, key=lambda one: coupled_range(one.case))]
        chosen += later
    return chosen


def driven(cycles: Sequence[MeasuredCycle]) -> str | None:
    """The coordinate that most cycles of a test load; of equally many that of the first."""
    return Counter(one.loaded for one in cycles).most_common(1)[0][0]


def calibration_problem(
    study: CohortStiffness,
    cohort: Cohort,
    specimen: str,
    representation: str,
    frames: tuple[Pose, ...],
    tested: Sequence[MeasuredCycle],
    others: tuple[ScopedEffect, ...] = (),
) -> Problem:
    """The fit of one representation to these tests; ``others`` are effects besides the bushings.

    Raises
    ------
    RefusedModel
        When frames and loads make no model.
    """
    start, one = start_stiffness(study, cohort, representation), named(representation)
    growth = np.zeros(start.shape) if one.stiffens else None
    # Behind the bushings come laws that stiffen, nuisances, effects of a base. All but the last
    # start without effect.
    stiffening = laws(study, growth)
    nuisances = nuisance_effects(study, representation, len(start))
    beside = (*stiffening, *nuisances, *others)
    model = stiff_model(cohort, specimen, frames, start, beside)
    assert one.grouping is not None  # nothing of a published set is fitted
    growths = free_growth(study, model, representation)
    errors, sds = free_nuisances(study, model, representation, BUSHING + 1 + len(stiffening))
    cases = tuple(
        MeasuredCase(one.case, _in_cost(study, one), cohort.zeroed_at_step_0) for one in tested
    )
    return stiffness_problem(
        *(model, cases, study.free, one.grouping, study.bound_factor, _weights(study, cohort)),
        further=growths + errors,
        further_sd=np.append(np.full(len(growths), np.inf), sds) if errors else None,
        correlated=study.cost == "measurement_sd" and cohort.zeroed_at_step_0,
        along_bounds=one.stiffens,
    )


def _in_cost(study: CohortStiffness, one: MeasuredCycle) -> Array:
    """(T, J, 6) readings that enter the cost, NaN elsewhere."""
    readings = one.readings.copy()
    if study.steps == "peak":
        others = np.arange(len(readings)) != one.peak
        readings[others] = np.nan
    if study.cost == "published" and one.loaded != "left_rotation":
        readings[:, :, COORDINATES.index("left_rotation")] = np.nan
    return readings


def _weights(study: CohortStiffness, cohort: Cohort) -> Array:
    """(6,) per mm2 and deg2."""
    if study.cost == "published":
        return np.array([float(name in ROTATIONS) for name in COORDINATES])
    sd = cohort.reading_sd(study.measurement_sd)
    assert sd is not None  # asked for when the study was checked
    named = zip(COORDINATES, sd.tolist(), strict=True)
    return np.array([of_one**-2.0 if name in study.free else 0.0 for name, of_one in named])


def start_stiffness(study: CohortStiffness, cohort: Cohort, representation: str) -> Array:
    """(J, 6) SI: the published stiffness a representation starts from."""
    levels = {}
    if named(representation).by_level:
        levels = {joint: study.level_stiffness[joint] for joint in cohort.joint_names}
    return stiffness_of_joints(cohort, study.stiffness, levels)


def with_stiffness(start: Array, joints: Sequence[str], rows: pd.DataFrame) -> Array:
    """(J, 6) ``start`` with what rows have of ``joint``, ``coordinate`` and ``stiffness``, SI."""
    k = start.copy()
    places = [joints.index(joint) for joint in rows["joint"]]
    k[places, [COORDINATES.index(name) for name in rows["coordinate"]]] = rows["stiffness"]
    return k


def stiff_model(
    cohort: Cohort,
    specimen: str,
    frames: tuple[Pose, ...],
    stiffness: Array,
    others: tuple[ScopedEffect, ...] = (),
) -> SpineModel:
    """A specimen with this stiffness (J, 6) SI and ``others``, effects besides the bushings.

    Equilibria do not hang on damping.
    """
    damping = np.array(Damping().in_order(), dtype=float)
    return on_bushings(cohort, specimen, frames, stiffness, damping, others)


def base_effects(
    model: ModelFile | None, cohort: Cohort, specimen: str, left_out: bool = False
) -> tuple[ScopedEffect, ...]:
    """Effects of a base that act on a specimen besides bushings; ``left_out`` as in `effects_for`.

    Parameters
    ----------
    model : the base, see `base_of`; None for none.
    """
    return () if model is None else beside_bushings(model, specimen, cohort.joint_names, left_out)


def own_values_note(model: ModelFile | None, cohort: Cohort, specimen: str) -> str:
    """What must be told of a left-out specimen whose effects have values found on itself."""
    return SEEN if model and own_values(model, specimen, cohort.joint_names) else ""


def base_of(root: str, study: CohortStiffness) -> ModelFile | None:
    """The model that a study builds on; ``root`` is the folder of the Snakefile."""
    return None if study.base is None else _model(stamp(study.base.path(Path(root))))


@lru_cache(maxsize=8)
def _model(where: Stamp) -> ModelFile:
    return read_model(where[0])


def origin(
    job: str,
    root: str,
    study: CohortStiffness,
    cohort: Cohort,
    specimens: Sequence[str] | None = None,
    others: Sequence[str] = (),
) -> dict[str, str]:
    """Metadata of a file, see `provenance`, with the digest of the model file."""
    base = base_marks(root, study.base.model if study.base else None)
    whole = provenance(job, study, cohort, specimens, [*base, *others])
    if study.base is None:
        return whole
    content = study.base.path(Path(root)).read_bytes()
    return {**whole, "base_model_digest": hashlib.sha256(content).hexdigest()}
