"""What is written where the base model cannot be fitted: why, and what looks wrong in the data.

What a search for missing effects leaves behind, before it is written to files.

What is written where the base model has a fit: verdict, rows of all tables, both models.

Search what the base model of a study lacks, prove it on held-out data, and write it down.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from spinepipe.cohort import Cohort
from spinepipe.files import appearing
from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.jobs.model_mark import base_marks
from spinepipe.marks import KEY, with_mark
from spinepipe.model.file import EffectEntry, ModelFile, Values, read_model, write_model
from spinepipe.studies.discrepancy.design.told_apart import ToldApart, told_apart
from spinepipe.studies.discrepancy.mistakes.data_errors import before_a_fit
from spinepipe.studies.discrepancy.mistakes.suspected import SuspectedError
from spinepipe.studies.discrepancy.rows import (
    candidate_rows,
    confusion_rows,
    design_rows,
    gap_rows,
    held_out_readings,
    held_out_rows,
    where_rows,
)
from spinepipe.studies.discrepancy.search.gaps import places, residual_frame
from spinepipe.studies.discrepancy.search.grounds import NoBase
from spinepipe.studies.discrepancy.search.hypothesis import BUSHING
from spinepipe.studies.discrepancy.search.investigation import (
    Investigation,
    declared_sd,
    investigate,
    measured,
    with_noise,
)
from spinepipe.studies.discrepancy.search.joint_fit import JointFit
from spinepipe.studies.discrepancy.search.model_files import EVERY, model_file
from spinepipe.studies.discrepancy.search.noise import Noise
from spinepipe.studies.discrepancy.search.outcome import Verdict
from spinepipe.studies.discrepancy.settings import Discrepancy
from spinepipe.studies.discrepancy.store import Run, Store
from spinepipe.studies.discrepancy.tables import CANDIDATES, CONFUSIONS, GAP, HELD_OUT, WHERE
from spinepipe.studies.discrepancy.verdict import noise_data, verdict_data
from spinepipe.tables import from_rows, write
from spinepipe.units import STIFFNESS_COLUMNS

Row = dict[str, Any]
Rows = Mapping[str, Sequence[Row]]


@dataclass(frozen=True)
class Results:
    """Everything that the files of a study hold.

    Attributes
    ----------
    verdict : content of ``verdict.json``. rows : of each table by its name; a table that is not
        there has no rows. model_base, model_with_effects : the two model files.
    """

    verdict: Mapping[str, Any]
    rows: Rows
    model_base: ModelFile
    model_with_effects: ModelFile


STARTED_FROM = "not_fitted"
"""In the names of the model files: they are where the fit started, not where it ended."""

SHAPE = "not known: there is no motion of the base model to compare with"


def without_base(
    study: Discrepancy, cohort: Cohort, file: ModelFile | None, trouble: NoBase
) -> Results:
    """The results of a study whose base has no fit.

    Parameters
    ----------
    file : the model file that the study starts from, if it does.
    trouble : where the fit failed, and why.
    """
    readings = measured(study, cohort)
    _, noise = with_noise(study, cohort, readings)
    errors = before_a_fit(readings, cohort.joint_names, noise.sd, zeroed=noise.zeroed)
    return Results(
        verdict=_verdict_without_base(cohort, noise, errors, str(trouble), study.false_alarm),
        rows={},
        model_base=start_model(study, cohort, file, "base"),
        model_with_effects=start_model(study, cohort, file, "with_effects"),
    )


def start_model(study: Discrepancy, cohort: Cohort, file: ModelFile | None, of: str) -> ModelFile:
    """The model where the fit started, under a name that says so."""
    effects = file.effects if file is not None else (_bushing(study),)
    return ModelFile(
        model=f"{study.study}_{of}_{STARTED_FROM}", cohort=cohort.name, effects=effects
    )


def _bushing(study: Discrepancy) -> EffectEntry:
    """The study's stiffness at all joints."""
    start = dict(zip(STIFFNESS_COLUMNS, study.stiffness.in_order(), strict=True))
    return EffectEntry(effect=BUSHING, values=(Values.model_validate(start),))


def _verdict_without_base(
    cohort: Cohort,
    noise: Noise,
    errors: Sequence[SuspectedError],
    trouble: str,
    false_alarm: float,
) -> Mapping[str, Any]:
    """All keys of ``verdict.json``; what nobody knows is null or empty."""
    sizes = dict.fromkeys(("base", "with_effects", "held_out_base", "held_out_with_effects"))
    return {
        "cohort": cohort.name,
        "verdict": Verdict.UNKNOWN.value,
        "why": f"the base model cannot be fitted: {trouble}",
        "effects": [],
        "candidates_in_set": [],
        "not_testable": [],
        "noise": noise_data(noise),
        "rms_residual": {"unit": "noise sd", **sizes},
        "gap": {"unit": "noise sd", **sizes, "held_out_closed": None},
        "smallest_detectable": [],
        "unknown": {"where": trouble, "shape": SHAPE},
        "suspected_data_errors": [vars(one) for one in errors],
        "threshold": {"log_evidence": None, "false_alarm": false_alarm, "draws": None},
        "families": [],
    }


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


JOB = "search"
STORE = "store"


def run(
    root: str,
    study: str,
    verdict: str,
    gap: str,
    candidates: str,
    where: str,
    confusions: str,
    held_out: str,
    model_base: str,
    model_with_effects: str,
) -> None:
    """Write the verdict, its tables and the two model files of a study.

    A base that cannot be fitted is a verdict too: UNKNOWN, and why.
    """
    settings, cohort = study_of_kind(Discrepancy, root, study)
    store = Store(Path(verdict).parent / STORE, __name__)
    results = searched(settings, cohort, root, store)
    metadata = provenance(JOB, settings, cohort, None, base_marks(root, settings.base.model))
    files = {
        gap: GAP,
        candidates: CANDIDATES,
        where: WHERE,
        confusions: CONFUSIONS,
        held_out: HELD_OUT,
    }
    for path, table in files.items():
        write(from_rows(table, results.rows.get(table.name, ())), path, metadata)
    write_model(results.model_base, model_base, metadata[KEY])
    write_model(results.model_with_effects, model_with_effects, metadata[KEY])
    told = with_mark(dict(results.verdict), metadata[KEY])
    with appearing(verdict) as temporary:
        temporary.write_text(json.dumps(told, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    store.forget_the_rest()


def searched(study: Discrepancy, cohort: Cohort, root: str, run: Run) -> Results:
    """All that the files of a study hold, whether or not its base has a fit."""
    file = None if study.base.model is None else read_model(Path(root) / study.base.model)
    try:
        ended = investigate(study, cohort, file, run)
    except NoBase as trouble:
        return without_base(study, cohort, file, trouble)
    return with_base(study, cohort, file, ended, run)
