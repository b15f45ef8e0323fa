"""Search what the base model of a study lacks, prove it on held-out data, and write it down."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from spinepipe.cohort import Cohort
from spinepipe.discrepancy.design.told_apart import told_apart
from spinepipe.discrepancy.grounds import NoBase
from spinepipe.discrepancy.investigation import Investigation, investigate
from spinepipe.discrepancy.mistakes.data_errors import before_a_fit
from spinepipe.discrepancy.model_files import model_file
from spinepipe.discrepancy.prepared import GUESSED_SD, declared_sd, measured
from spinepipe.discrepancy.where import places, residual_frame
from spinepipe.files import appearing
from spinepipe.jobs.discrepancy.candidate_rows import candidate_rows
from spinepipe.jobs.discrepancy.proof_rows import (
    confusion_rows,
    design_rows,
    held_out_readings,
    held_out_rows,
)
from spinepipe.jobs.discrepancy.rows import gap_rows, where_rows
from spinepipe.jobs.discrepancy.store import Store
from spinepipe.jobs.discrepancy.verdict import verdict_data
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.jobs.provenance import provenance
from spinepipe.model.file import ModelFile, read_model, write_model
from spinepipe.studies import Discrepancy
from spinepipe.tables import (
    CANDIDATES,
    CONFUSIONS,
    GAP,
    HELD_OUT,
    WHERE,
    from_rows,
    write,
)

JOB = "discrepancy.search"
Row = dict[str, Any]


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

    Raises
    ------
    NoBase
        When the base model has no fit and the data do not show why.
    """
    settings, cohort = study_of_kind(Discrepancy, root, study)
    results = _Results(settings, cohort, root, Path(verdict).parent / "store")
    data, rows = results.verdict()
    metadata = provenance(JOB, settings, cohort)
    files = {gap: GAP, candidates: CANDIDATES, where: WHERE, confusions: CONFUSIONS,
             held_out: HELD_OUT}  # fmt: skip
    for path, table in files.items():
        write(from_rows(table, rows[table.name]), path, metadata)
    for path, model in zip((model_base, model_with_effects), results.models(), strict=True):
        write_model(model, path)
    with appearing(verdict) as temporary:
        temporary.write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")


class _Results:
    """All that a search comes to."""

    def __init__(self, study: Discrepancy, cohort: Cohort, root: str, folder: Path) -> None:
        self.study, self.cohort = study, cohort
        store = Store(folder, f"spinepipe.jobs.{JOB}")
        self.ended = self._investigated(root, store)
        grounds, trials = self.ended.grounds, self.ended.rules.trials
        needed = self.ended.found.stages[0].screen.threshold + study.margin
        declared = declared_sd(study, cohort)
        self.told = told_apart(grounds, trials, needed, declared, study.seed, store)

    def _investigated(self, root: str, store: Store) -> Investigation:
        study, cohort = self.study, self.cohort
        try:
            return investigate(study, cohort, _base_file(root, study), store)
        except NoBase as trouble:
            sd = declared_sd(study, cohort)
            sd = GUESSED_SD if sd is None else sd
            readings, zeroed = measured(study, cohort), cohort.zeroed_at_step_0
            errors = before_a_fit(readings, cohort.joint_names, sd, zeroed=zeroed)
            seen = "; ".join(f"{e.what} ({e.where}): {e.evidence}" for e in errors)
            raise NoBase(f"{trouble}. {seen}".strip()) from None

    def verdict(self) -> tuple[Mapping[str, Any], Mapping[str, Sequence[Row]]]:
        """The verdict as plain data, and the rows of the tables by name."""
        joints, ended, told = self.cohort.joint_names, self.ended, self.told
        found = ended.found
        final = places(residual_frame(ended.grounds, found.final.fit, joints))
        data = verdict_data(self.cohort, ended, told, final, self.study.false_alarm)
        return data, {
            GAP.name: gap_rows(found, joints, held_out_readings(ended.proof)),
            CANDIDATES.name: [*design_rows(told), *candidate_rows(found, joints)],
            WHERE.name: where_rows(found, joints),
            CONFUSIONS.name: confusion_rows(told),
            HELD_OUT.name: held_out_rows(ended.proof),
        }

    def models(self) -> tuple[ModelFile, ModelFile]:
        """The base and the model with effects."""
        base, final = self.ended.grounds.fit, self.ended.found.final.fit
        count = len(next(iter(base.models.values())).effects)
        name, cohort = self.study.study, self.cohort.name
        return (
            model_file(base, f"{name}_base", cohort, count),
            model_file(final, f"{name}_with_effects", cohort, count),
        )


def _base_file(root: str, study: Discrepancy) -> ModelFile | None:
    return None if study.base.model is None else read_model(Path(root) / study.base.model)


__all__ = ["run"]
