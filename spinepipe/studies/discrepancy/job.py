"""Job: search what the base model of a study lacks, prove it on held-out data, write it down.

A base that cannot be fitted is a verdict too: why, and what looks wrong in the data.
"""

import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from spinepipe.cohort import Cohort
from spinepipe.cohort.specimen import followers
from spinepipe.jobs.digest import base_marks, provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.marks import KEY, write_marked
from spinepipe.model.file import EffectEntry, ModelFile, Values, read_model, write_model
from spinepipe.progress import Progress
from spinepipe.studies.discrepancy.curve_numbers import (
    field_number_rows,
    reaches,
    tabulated_rows,
)
from spinepipe.studies.discrepancy.design.advice import advice
from spinepipe.studies.discrepancy.design.distinguishability import distinguishability
from spinepipe.studies.discrepancy.design.information import Bench
from spinepipe.studies.discrepancy.design.testable import LEAD
from spinepipe.studies.discrepancy.mistakes.data_errors import before_a_fit
from spinepipe.studies.discrepancy.rows import (
    advice_csv,
    advice_rows,
    candidate_rows,
    confusion_rows,
    gap_rows,
    held_out_rows,
    imperfection_rows,
    where_rows,
)
from spinepipe.studies.discrepancy.search.baseline import NoBase
from spinepipe.studies.discrepancy.search.imperfections import absorbed_gap
from spinepipe.studies.discrepancy.search.investigation import (
    Investigation,
    Prepared,
    investigate,
    on_record,
    prepare,
)
from spinepipe.studies.discrepancy.search.joint_fit import JointFit
from spinepipe.studies.discrepancy.search.model_files import model_file
from spinepipe.studies.discrepancy.search.prediction import BUSHING, NoEquilibrium
from spinepipe.studies.discrepancy.search.residual_model import ResidualModel, model_residual
from spinepipe.studies.discrepancy.settings import Discrepancy
from spinepipe.studies.discrepancy.store import PieceRunner, Store
from spinepipe.studies.discrepancy.summary import noise_summary, summarise
from spinepipe.studies.discrepancy.tables import (
    CANDIDATES,
    CONFUSIONS,
    FIELD_NUMBERS,
    GAP,
    HELD_OUT,
    IMPERFECTIONS,
    NEXT_TESTS,
    TABULATED,
    WHERE,
)
from spinepipe.studies.discrepancy.verdict import (
    EVERY,
    Verdict,
    VerdictKind,
    write_verdict,
)
from spinepipe.studies.discrepancy.verdict_unnamed import Reason, UnnamedMisfit
from spinepipe.tables import from_rows, write
from spinepipe.units import STIFFNESS_COLUMNS

Row = dict[str, Any]

TABLES = (
    *(GAP, CANDIDATES, WHERE, CONFUSIONS, HELD_OUT, IMPERFECTIONS),
    *(NEXT_TESTS, FIELD_NUMBERS, TABULATED),
)
JOB = "search"
STORE = "store"

STARTED_FROM = "not_fitted"
"""In the names of the model files: they are where the fit started, not where it ended."""

NO_SHAPE = "not known: there is no motion of the base model to compare with"


@dataclass(frozen=True)
class DiscrepancyResults:
    """Everything that the files of a study hold.

    Attributes
    ----------
    rows : of each table by its name; a table that is not there has no rows.
    model_base, model_with_effects : the two model files.
    """

    verdict: Verdict
    rows: Mapping[str, Sequence[Row]]
    model_base: ModelFile
    model_with_effects: ModelFile


def run(
    root: str,
    study: str,
    verdict: str,
    design: str,
    model_base: str,
    model_with_effects: str,
    threads: int = 1,
    **tables: str,
) -> None:
    """Write the verdict, its tables and the two model files of a study.

    Parameters
    ----------
    design : the advice as a laboratory opens it. tables : where each goes, by its name.
    threads : pieces of the search that are computed at the same time.
    """
    settings, cohort = study_of_kind(Discrepancy, root, study)
    store = Store(Path(verdict).parent / STORE, __name__, threads)
    base = settings.base.model
    file = None if base is None else read_model(Path(root) / base)

    def say(line: str) -> None:
        print(f"{study}: {line}", file=sys.stderr, flush=True)

    results = searched(settings, cohort, file, store, Progress(say))
    metadata = provenance(JOB, settings, cohort, None, base_marks(root, settings.base.model))
    for table in TABLES:
        rows = results.rows.get(table.name, ())
        write(from_rows(table, rows), tables[table.name], metadata)
    write_marked(advice_csv(results.rows.get("next_tests", ())), design, metadata[KEY])
    write_model(results.model_base, model_base, metadata[KEY])
    write_model(results.model_with_effects, model_with_effects, metadata[KEY])
    write_verdict(results.verdict, verdict, metadata[KEY])
    store.forget_the_rest()


def searched(
    study: Discrepancy,
    cohort: Cohort,
    file: ModelFile | None,
    run: PieceRunner,
    progress: Progress | None = None,
) -> DiscrepancyResults:
    """All that the files of a study hold, whether or not its base has a fit.

    Parameters
    ----------
    file : the model that the study starts from, where it is a file. run : of the pieces of work.
    """
    # the base's fit counts too: a laboratory asks when it will have an answer
    until = None if study.minutes is None else time.monotonic() + 60.0 * study.minutes
    ready = prepare(study, cohort, file)
    try:
        ended = investigate(ready, run, progress, until)
    except NoBase as trouble:
        return _without_base(ready, trouble)
    return _with_base(ready, ended, run)


def _without_base(ready: Prepared, trouble: NoBase) -> DiscrepancyResults:
    """The results of a study whose base has no fit; ``trouble`` says where and why."""
    cohort, noise = ready.cohort, ready.noise
    errors = before_a_fit(ready.measured, cohort.joint_names, noise.sd, zeroed=noise.zeroed)
    verdict = Verdict(
        cohort=cohort.name,
        verdict=VerdictKind.UNKNOWN,
        why=f"the base model cannot be fitted: {trouble}",
        noise=noise_summary(noise),
        unknown=UnnamedMisfit(str(trouble), NO_SHAPE, Reason.NO_BASE),
        suspected_data_errors=errors,
    )
    return DiscrepancyResults(
        verdict=verdict,
        rows={},
        model_base=_start_model(ready, "base"),
        model_with_effects=_start_model(ready, "with_effects"),
    )


def _start_model(ready: Prepared, of: str) -> ModelFile:
    """The model where the fit started, under a name that says so."""
    study, file = ready.study, ready.file
    start = dict(zip(STIFFNESS_COLUMNS, study.stiffness.in_order(), strict=True))
    bushing = EffectEntry(effect=BUSHING, values=(Values.model_validate(start),))
    effects = file.effects if file is not None else (bushing,)
    name = f"{study.study}_{of}_{STARTED_FROM}"
    return ModelFile(model=name, cohort=ready.cohort.name, effects=effects)


def _with_base(ready: Prepared, ended: Investigation, run: PieceRunner) -> DiscrepancyResults:
    """The results of an investigation, and what the tests could tell apart."""
    joints, rules = ready.cohort.joint_names, ended.rules
    told = distinguishability(ended.grounds, rules.trials, rules.needed + LEAD, ready.declared, run)
    ended = ended.for_verdict()
    found, outcome = ended.found, ended.ended
    base, final = found.base.fit, found.final.fit

    # what imperfections took up beside each model; without effects both are the same
    taken = {"base": absorbed_gap(found.base, base, joints, run)}
    taken["with_effects"] = (
        taken["base"] if final is base else absorbed_gap(found.final, final, joints, run)
    )
    stays = _beyond(ended, run)
    table = None if stays.table is None else stays.grounds.fit
    gap = gap_rows(found, joints, table)

    # what a tester reads off the curves that effects which stand, named or tied, change
    names = {one.name for one in outcome.named} | set(outcome.tied)
    forms = [one.supposed.form for one in found.standing if one.name in names]
    numbers = field_number_rows(base, final, forms, reaches(gap)) if forms else []
    return DiscrepancyResults(
        verdict=summarise(ready, ended, told, stays, taken["with_effects"], run),
        rows={
            "gap": gap,
            "candidates": candidate_rows(found, rules.needed, joints),
            "where": where_rows(found, joints),
            "confusions": confusion_rows(told),
            "held_out": held_out_rows(ended.proof),
            "field_numbers": numbers,
            "tabulated": () if table is None else tabulated_rows(base, table),
            "imperfections": [
                row for model, one in taken.items() for row in imperfection_rows(one, model)
            ],
            "next_tests": advice_rows(
                advice(found, outcome, Bench.of(ended.grounds, ready.declared), run)
            ),
        },
        model_base=_model(ready, ended.grounds.fit, "base"),
        model_with_effects=_model(ready, stays.grounds.fit, "with_effects"),
    )


def _beyond(ended: Investigation, run: PieceRunner) -> ResidualModel:
    """What no effect explains, described; nothing where nothing is left, or the data look wrong."""
    final, outcome = ended.found.final, ended.ended
    told = outcome.verdict in (VerdictKind.UNKNOWN, VerdictKind.PART)
    if not told or outcome.reason is Reason.DATA_ERRORS:
        return ResidualModel(None, final)
    stays = model_residual(ended.found, run)
    if stays.table is not None:
        try:
            on_record([stays.grounds.fit], final.readings, run)
        except NoEquilibrium:  # a table that the engine of record cannot follow predicts nothing
            return ResidualModel(None, final)
    return stays


def _model(ready: Prepared, fit: JointFit, of: str) -> ModelFile:
    file = ready.file
    base = [EVERY] if file is None else [entry.scope.specimens for entry in file.effects]
    given = {name: len(followers(ready.cohort, name)) for name in fit.models}
    return model_file(fit, f"{ready.study.study}_{of}", ready.cohort.name, base, given)
