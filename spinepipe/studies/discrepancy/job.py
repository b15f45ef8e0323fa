"""Job: search what the base model of a study lacks, prove it on held-out data, write it down.

A base that cannot be fitted is a verdict too: why, and what looks wrong in the data.
"""

import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from spinepipe.cohort import Cohort
from spinepipe.cohort.specimen import followers
from spinepipe.files import appearing
from spinepipe.jobs.digest import base_marks, provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.marks import KEY, with_mark, write_marked
from spinepipe.model.file import EffectEntry, ModelFile, Values, read_model, write_model
from spinepipe.progress import Progress
from spinepipe.studies.discrepancy.advice_rows import advice_csv, advice_rows
from spinepipe.studies.discrepancy.curve_numbers import field_number_rows, reaches
from spinepipe.studies.discrepancy.design.advice import advice, hidden_effects
from spinepipe.studies.discrepancy.design.distinguishability import Distinguishability, told_apart
from spinepipe.studies.discrepancy.design.extra_tests import bench
from spinepipe.studies.discrepancy.imperfection_rows import (
    imperfection_rows,
    told_imperfections,
    told_withheld,
)
from spinepipe.studies.discrepancy.mistakes.data_errors import before_a_fit
from spinepipe.studies.discrepancy.rows import (
    candidate_rows,
    confusion_rows,
    design_rows,
    gap_rows,
    held_out_readings,
    held_out_rows,
    where_rows,
)
from spinepipe.studies.discrepancy.search.base import BUSHING
from spinepipe.studies.discrepancy.search.baseline import NoBase
from spinepipe.studies.discrepancy.search.imperfections import AbsorbedGap, taken_up
from spinepipe.studies.discrepancy.search.investigation import (
    Investigation,
    Prepared,
    investigate,
    on_record,
    prepared,
)
from spinepipe.studies.discrepancy.search.joint_fit import JointFit
from spinepipe.studies.discrepancy.search.model_files import model_file
from spinepipe.studies.discrepancy.search.residual_model import ResidualModel, beyond
from spinepipe.studies.discrepancy.settings import Discrepancy
from spinepipe.studies.discrepancy.store import PieceRunner, Store
from spinepipe.studies.discrepancy.table_rows import tabulated_rows
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
from spinepipe.studies.discrepancy.verdict import EVERY, Conclusion, Threshold, Verdict, plain_data
from spinepipe.studies.discrepancy.verdict_found import noise_told, verdict_found
from spinepipe.studies.discrepancy.verdict_unnamed import Reason, UnnamedMisfit
from spinepipe.tables import from_rows, write
from spinepipe.units import STIFFNESS_COLUMNS

Row = dict[str, Any]

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
    gap: str,
    candidates: str,
    where: str,
    confusions: str,
    held_out: str,
    imperfections: str,
    next_tests: str,
    field_numbers: str,
    tabulated: str,
    design: str,
    model_base: str,
    model_with_effects: str,
    threads: int = 1,
) -> None:
    """Write the verdict, its tables and the two model files of a study.

    Parameters
    ----------
    threads : pieces of the search that are computed at the same time.
    """
    settings, cohort = study_of_kind(Discrepancy, root, study)
    store = Store(Path(verdict).parent / STORE, __name__, threads)
    base = settings.base.model
    file = None if base is None else read_model(Path(root) / base)
    results = searched(settings, cohort, file, store, Progress(partial(_say, study)))
    metadata = provenance(JOB, settings, cohort, None, base_marks(root, settings.base.model))
    files = {
        gap: GAP,
        candidates: CANDIDATES,
        where: WHERE,
        confusions: CONFUSIONS,
        held_out: HELD_OUT,
        imperfections: IMPERFECTIONS,
        next_tests: NEXT_TESTS,
        field_numbers: FIELD_NUMBERS,
        tabulated: TABULATED,
    }
    for path, table in files.items():
        write(from_rows(table, results.rows.get(table.name, ())), path, metadata)
    advised = advice_csv(results.rows.get(NEXT_TESTS.name, ()))
    write_marked(advised, design, metadata[KEY])
    write_model(results.model_base, model_base, metadata[KEY])
    write_model(results.model_with_effects, model_with_effects, metadata[KEY])
    told = with_mark(plain_data(results.verdict), metadata[KEY])
    with appearing(verdict) as temporary:
        temporary.write_text(json.dumps(told, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    store.forget_the_rest()


def _say(study: str, line: str) -> None:
    print(f"{study}: {line}", file=sys.stderr, flush=True)


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
    ready = prepared(study, cohort, file)
    try:
        ended = investigate(ready, run, progress)
    except NoBase as trouble:
        return _without_base(ready, trouble)
    return _with_base(ready, ended, run)


def _without_base(ready: Prepared, trouble: NoBase) -> DiscrepancyResults:
    """The results of a study whose base has no fit; ``trouble`` says where and why."""
    cohort, noise = ready.cohort, ready.noise
    errors = before_a_fit(ready.measured, cohort.joint_names, noise.sd, zeroed=noise.zeroed)
    verdict = Verdict(
        cohort=cohort.name,
        verdict=Conclusion.UNKNOWN,
        why=f"the base model cannot be fitted: {trouble}",
        noise=noise_told(noise),
        unknown=UnnamedMisfit(str(trouble), NO_SHAPE, Reason.NO_BASE),
        suspected_data_errors=errors,
        threshold=Threshold(false_alarm=ready.study.false_alarm),
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
    needed = ended.found.stages[0].screen.threshold + ended.rules.margin
    seed, trials = ended.rules.seed, ended.rules.trials
    margin = ready.study.margin
    told = told_apart(ended.grounds, trials, needed, margin, ready.declared, seed, run)
    ended = ended.as_told()
    imperfect = _imperfections(ready.cohort.joint_names, ended, run)
    stays = _beyond(ended, run)
    hidden = hidden_effects(ended.found, ended.ended, ended.rules, run)
    rows = _rows(ready.cohort.joint_names, ended, told, stays)
    numbers = _field_numbers(ended, rows[GAP.name])
    return DiscrepancyResults(
        verdict=replace(
            verdict_found(ready, ended, told, stays, numbers, run),
            imperfections=told_imperfections(imperfect["with_effects"]),
            tabulated=stays.table,
            withheld=tuple(map(told_withheld, hidden)),
        ),
        rows={
            **rows,
            FIELD_NUMBERS.name: numbers,
            TABULATED.name: _tabulated(ended, stays),
            IMPERFECTIONS.name: [
                row for model, one in imperfect.items() for row in imperfection_rows(one, model)
            ],
            NEXT_TESTS.name: advice_rows(
                advice(
                    ended.found,
                    ended.ended,
                    ended.rules,
                    bench(ended.grounds, ready.declared),
                    run,
                    hidden,
                )
            ),
        },
        model_base=_model(ready, ended.grounds.fit, "base"),
        model_with_effects=_model(ready, stays.grounds.fit, "with_effects"),
    )


def _beyond(ended: Investigation, run: PieceRunner) -> ResidualModel:
    """What no effect explains, described; nothing where nothing is left, or the data look wrong."""
    final, outcome = ended.found.final, ended.ended
    told = outcome.verdict in (Conclusion.UNKNOWN, Conclusion.PART)
    if not told or outcome.reason is Reason.DATA_ERRORS:
        return ResidualModel(None, None, final)
    stays = beyond(final, ended.rules, run)
    if stays.table is not None:
        on_record([stays.grounds.fit], final.readings, run)
    return stays


def _imperfections(
    joints: Sequence[str], ended: Investigation, run: PieceRunner
) -> Mapping[str, AbsorbedGap]:
    """What imperfections took up beside the base, and beside the model with the effects."""
    found = ended.found
    base = taken_up(found.base, found.base.fit, joints, run)
    same = found.final.fit is found.base.fit
    final = base if same else taken_up(found.final, found.final.fit, joints, run)
    return {"base": base, "with_effects": final}


def _tabulated(ended: Investigation, stays: ResidualModel) -> Sequence[Row]:
    """The tables of what has no name, point by point."""
    if stays.table is None:
        return ()
    return tabulated_rows(ended.found.base.fit, stays.grounds.fit)


def _rows(
    joints: Sequence[str], ended: Investigation, told: Distinguishability, stays: ResidualModel
) -> Mapping[str, Sequence[Row]]:
    found, proof = ended.found, ended.proof
    return {
        GAP.name: gap_rows(
            found,
            joints,
            held_out_readings(proof),
            None if stays.table is None else stays.grounds.fit,
        ),
        CANDIDATES.name: [*design_rows(told), *candidate_rows(found, joints)],
        WHERE.name: where_rows(found, joints),
        CONFUSIONS.name: confusion_rows(told),
        HELD_OUT.name: held_out_rows(proof),
    }


def _field_numbers(ended: Investigation, gap: Sequence[Row]) -> Sequence[Row]:
    """What a tester reads off the curves that effects which stand, named or tied, change."""
    told = {one.name for one in ended.ended.named} | set(ended.ended.tied)
    forms = [one.supposed.form for one in ended.found.standing if one.name in told]
    fits = ended.found.base.fit, ended.found.final.fit
    return field_number_rows(*fits, forms, reaches(gap)) if forms else ()


def _model(ready: Prepared, fit: JointFit, of: str) -> ModelFile:
    file = ready.file
    base = [EVERY] if file is None else [entry.scope.specimens for entry in file.effects]
    given = {name: len(followers(ready.cohort, name)) for name in fit.models}
    return model_file(fit, f"{ready.study.study}_{of}", ready.cohort.name, base, given)
