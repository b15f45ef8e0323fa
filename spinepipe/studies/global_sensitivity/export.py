"""The model of a specimen from which the factors start, as `spinepipe export` writes it."""

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.cohort.specimen import joint_frames, on_bushings
from spinepipe.effects.contract import Array
from spinepipe.problems import InputError
from spinepipe.status import USABLE
from spinepipe.studies.exports import Exported, problem, refuse, required_result
from spinepipe.studies.global_sensitivity.settings import GlobalSensitivity
from spinepipe.studies.kind import WantedFiles
from spinepipe.studies.opensim_files import opensim_document
from spinepipe.studies.parts import stiffness_of_joints
from spinepipe.tables import read_frame
from spinepipe.units import COORDINATES


def exported(study: GlobalSensitivity, cohort: Cohort, wanted: WantedFiles) -> Exported:
    """OpenSim's document of the model, and in words what it is.

    Raises
    ------
    InputError
        Where a joint pose or a representation is asked for, or the fit has no result.
    """
    refuse(wanted, "test")
    frames = joint_frames(cohort, wanted.specimen)
    stiffness = stiffness_of_joints(cohort, study.start_stiffness, study.level_stiffness)
    told = "the study's own, nothing is fitted"
    if study.is_fitted:
        told = "start of the fit" if wanted.start else "fitted, where the factors start"
        if not wanted.start:
            stiffness = _fitted(wanted, stiffness)
    damping = np.array(study.damping.in_order(), dtype=float)
    model = on_bushings(cohort, wanted.specimen, frames, stiffness, damping)
    return opensim_document(model, f"the cohort's own joints, stiffness: {told}", cohort, wanted)


def _fitted(wanted: WantedFiles, start: Array) -> Array:
    """(J, 6) what the study's results have of the specimen, all joints alike."""
    rows = read_frame(required_result(wanted.results / "base_stiffness.parquet"))
    own = rows[rows["specimen"] == wanted.specimen]
    if own.empty or not own["status"].isin(USABLE).all():
        found = "; ".join(["no fit of " + wanted.specimen, *own["message"].unique()])
        remedy = "choose another specimen, or add --start"
        raise InputError([problem("SPECIMEN", found, "a specimen that was fitted", remedy)])
    k = start.copy()
    for coordinate, value in own[["coordinate", "stiffness"]].itertuples(index=False):
        k[:, COORDINATES.index(coordinate)] = value
    return k
