"""The model of a specimen before anything is varied, as `spinepipe export` writes it."""

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.cohort.specimen import followers, joint_frames, on_bushings
from spinepipe.studies.exports import Exported, refuse
from spinepipe.studies.kind import WantedFiles
from spinepipe.studies.opensim_files import opensim_document
from spinepipe.studies.parts import stiffness_of_joints
from spinepipe.studies.range_of_motion.grid import all_cases, virtual_tensions
from spinepipe.studies.range_of_motion.settings import RangeOfMotion


def exported(study: RangeOfMotion, cohort: Cohort, wanted: WantedFiles) -> Exported:
    """OpenSim's document of the model, and in words what it is.

    Raises
    ------
    InputError
        Where a joint pose or a representation is asked for.
    """
    refuse(wanted, "test")
    frames = joint_frames(cohort, wanted.specimen)
    stiffness = stiffness_of_joints(cohort, study.stiffness, study.level_stiffness)
    damping = np.array(study.damping.in_order(), dtype=float)
    told = virtual_tensions(study) or followers(cohort, wanted.specimen)
    tension_n = {test: force for test, force in told.items() if force}
    model = on_bushings(cohort, wanted.specimen, frames, stiffness, damping, tension_n=tension_n)
    words = "the cohort's own joints, stiffness: the study's own, nothing is fitted"
    return opensim_document(model, words, cohort, wanted, all_cases(study, cohort, wanted.specimen))
