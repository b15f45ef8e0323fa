"""What is written where the base model has a fit: verdict, rows of all tables, both models."""

from collections.abc import Mapping, Sequence
from typing import Any

from spinepipe.cohort import Cohort
from spinepipe.discrepancy.design.told_apart import ToldApart, told_apart
from spinepipe.discrepancy.investigation import Investigation
from spinepipe.discrepancy.joint_fit import JointFit
from spinepipe.discrepancy.model_files import EVERY, model_file
from spinepipe.discrepancy.prepared import declared_sd
from spinepipe.discrepancy.tasks import Run
from spinepipe.discrepancy.where import places, residual_frame
from spinepipe.jobs.discrepancy.candidate_rows import candidate_rows
from spinepipe.jobs.discrepancy.proof_rows import (
    confusion_rows,
    design_rows,
    held_out_readings,
    held_out_rows,
)
from spinepipe.jobs.discrepancy.results import Results, Row
from spinepipe.jobs.discrepancy.rows import gap_rows, where_rows
from spinepipe.jobs.discrepancy.verdict import verdict_data
from spinepipe.model.file import ModelFile
from spinepipe.studies import Discrepancy
from spinepipe.tables import CANDIDATES, CONFUSIONS, GAP, HELD_OUT, WHERE


def with_base(
    study: Discrepancy, cohort: Cohort, file: ModelFile | None, ended: Investigation, run: Run
) -> Results:
    """The results of an investigation, and what the tests could tell apart.

    Parameters
    ----------
    file : the model file that the study starts from, if it does.
    """
    told = _told_apart(study, cohort, ended, run)
    ended = ended.as_told()
    return Results(
        verdict=_verdict(study, cohort, ended, told),
        rows=_rows(cohort, ended, told),
        model_base=_model(study, cohort, ended.grounds.fit, file, "base"),
        model_with_effects=_model(study, cohort, ended.found.final.fit, file, "with_effects"),
    )


def _told_apart(study: Discrepancy, cohort: Cohort, ended: Investigation, run: Run) -> ToldApart:
    needed = ended.found.stages[0].screen.threshold + study.margin
    declared = declared_sd(study, cohort)
    return told_apart(ended.grounds, ended.rules.trials, needed, declared, study.seed, run)


def _verdict(
    study: Discrepancy, cohort: Cohort, ended: Investigation, told: ToldApart
) -> Mapping[str, Any]:
    final = places(residual_frame(ended.grounds, ended.found.final.fit, cohort.joint_names))
    return verdict_data(cohort, ended, told, final, study.false_alarm)


def _rows(cohort: Cohort, ended: Investigation, told: ToldApart) -> Mapping[str, Sequence[Row]]:
    joints, found, proof = cohort.joint_names, ended.found, ended.proof
    return {
        GAP.name: gap_rows(found, joints, held_out_readings(proof)),
        CANDIDATES.name: [*design_rows(told), *candidate_rows(found, joints)],
        WHERE.name: where_rows(found, joints),
        CONFUSIONS.name: confusion_rows(told),
        HELD_OUT.name: held_out_rows(proof),
    }


def _model(
    study: Discrepancy, cohort: Cohort, fit: JointFit, file: ModelFile | None, of: str
) -> ModelFile:
    base = [EVERY] if file is None else [entry.scope.specimens for entry in file.effects]
    return model_file(fit, f"{study.study}_{of}", cohort.name, base)
