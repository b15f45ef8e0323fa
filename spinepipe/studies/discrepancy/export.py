"""The model of a specimen with the effects that were found, as `spinepipe export` writes it."""

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.cohort.specimen import joint_frames, on_bushings, spine_model
from spinepipe.effects.contract import Array
from spinepipe.model.file import effects_for, read_model
from spinepipe.studies.discrepancy.settings import Discrepancy
from spinepipe.studies.exports import Exported, refuse, required_result
from spinepipe.studies.kind import WantedFiles
from spinepipe.studies.opensim_files import opensim_document
from spinepipe.studies.parts import Damping

MODEL = "model_with_effects.yaml"


def exported(study: Discrepancy, cohort: Cohort, wanted: WantedFiles) -> Exported:
    """OpenSim's document of the model, and in words what it is and which effects it leaves out.

    Raises
    ------
    InputError
        Where the study has no results, or a joint pose or a representation is asked for.
    """
    refuse(wanted, "test")
    frames = joint_frames(cohort, wanted.specimen)
    damping: Array = np.array(Damping().in_order(), dtype=float)
    base = study.base.model
    if wanted.start and base is None:
        start = np.array(study.stiffness.in_order(), dtype=float)
        model = on_bushings(cohort, wanted.specimen, frames, start, damping)
        words = "the cohort's own joints, stiffness: start of the study"
        return opensim_document(model, words, cohort, wanted)
    found = wanted.results / "discrepancy" / MODEL
    told = "start of the study, its base model" if wanted.start else "fitted with the effects found"
    path = wanted.root / base if wanted.start and base else required_result(found)
    file = read_model(path)
    effects = effects_for(file, wanted.specimen, cohort.joint_names)
    model = spine_model(cohort, wanted.specimen, frames, effects, damping)
    return opensim_document(model, f"the cohort's own joints, stiffness: {told}", cohort, wanted)
