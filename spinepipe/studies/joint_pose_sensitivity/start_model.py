"""Job: the model file that every calibration of a study starts from."""

from spinepipe.jobs.digest import digest_of
from spinepipe.model.file import EffectEntry, ModelFile, Scope, Values, write_model
from spinepipe.studies.joint_pose_sensitivity.inputs import start_stiffness, study_and_cohort
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.units import STIFFNESS_COLUMNS


def run(root: str, study: str, output: str) -> None:
    """Write ``model.yaml``."""
    settings, cohort = study_and_cohort(root, study)
    write_model(base_model(settings), output, digest_of("start_model", settings, cohort, ()))


def base_model(study: JointPoseSensitivity) -> ModelFile:
    """The study's stiffness in all joints of all specimens."""
    values = dict(zip(STIFFNESS_COLUMNS, start_stiffness(study).tolist(), strict=True))
    entry = EffectEntry(
        effect="linear_bushing", scope=Scope(), values=(Values(specimen="*", joint="*", **values),)
    )
    return ModelFile(model=study.study, cohort=study.cohort, effects=(entry,))
