"""Which physics a model of a cohort lacks."""

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

import pandas as pd

from spinepipe.api import plot
from spinepipe.api.result import Result, concluded, frame
from spinepipe.api.study import Say, model_path, study_of
from spinepipe.cohort import Cohort
from spinepipe.model.file import ModelFile, read_model
from spinepipe.progress import Progress, silent
from spinepipe.studies.discrepancy.job import TABLES, DiscrepancyResults, searched
from spinepipe.studies.discrepancy.settings import Discrepancy
from spinepipe.studies.discrepancy.store import at_once
from spinepipe.studies.discrepancy.tables import CANDIDATES, GAP, HELD_OUT, NEXT_TESTS
from spinepipe.studies.discrepancy.verdict import write_verdict


@dataclass(frozen=True, eq=False, repr=False)
class MissingEffects(Result):
    """What a search for missing effects came to.

    Attributes
    ----------
    table : the effects that are missing for certain: ``name``, ``log_evidence``, coordinates.
    depends_on : noise, threshold, and residuals with and without the effects.
    search : how the search ended and what was not tried, in a sentence.
    verdict : ``NAMED``, ``PART``, ``SET``, ``NULL`` or ``UNKNOWN``; ``why`` in a sentence.
    probabilities : that each effect is missing, something else is, nothing is; likeliest first.
    alternatives : effects that the data cannot exclude. not_testable : effects that these tests
        cannot show, and the test that would. next_tests : tests that would tell more.
    misfit : measured and predicted motion, with and without the effects.
    left_out : misfit on each left-out test, predicted from the others, and on each left-out
        specimen, predicted from the others and half of its own load steps.
    model : the base with its effects; it can be the ``base`` of `spinepipe.calibration`.
    """

    depends_on: pd.DataFrame
    search: str
    verdict: str
    why: str
    probabilities: pd.DataFrame
    alternatives: pd.DataFrame
    not_testable: pd.DataFrame
    next_tests: pd.DataFrame
    candidates: pd.DataFrame
    misfit: pd.DataFrame
    left_out: pd.DataFrame
    model: ModelFile

    def plot(self, ax: Any = None) -> Any:
        """How probable each effect is, see `spinepipe.plot.effects`."""
        return plot.effects(self, ax=ax)

    @property
    def effects(self) -> pd.DataFrame:
        """The same as ``table``."""
        return self.table


def find_missing_effects(
    cohort: Cohort,
    *,
    base: Literal["per_specimen", "per_joint"] | ModelFile | Path = "per_specimen",
    effects: Sequence[str] | None = None,
    tests: Sequence[str] | None = None,
    effort: Literal["quick", "standard", "full"] | None = None,
    settings: Mapping[str, Any] | None = None,
    say: Say = silent,
) -> MissingEffects:
    """Find where a model and measured motion disagree, and name the effect that is missing.

    The numbers are those of a study of kind ``discrepancy`` with these settings, to the bit.

    Parameters
    ----------
    base : linear bushings of one stiffness per specimen or per joint, or a model.
    effects : names that are tried; all by default, see docs/effects.md.
    effort : how many fits the search may make; ``standard`` unless `settings` say otherwise.
    settings : any further keys of such a study, as in its file, such as
        ``{"measurement_sd": {"rotation_deg": 0.1, "translation_mm": 0.1}}``; they come before the
        others.
    say : told how far the search is, such as `print`.

    Raises
    ------
    InputError
        With all that keeps these data from being searched.
    """
    words = base if isinstance(base, str) else None
    with model_path(None if isinstance(base, str) else base) as path:
        asked = {
            "base": {"stiffness": words} if path is None else {"model": path},
            "effects": None if effects is None else list(effects),
            "tests": None if tests is None else list(tests),
            "effort": effort,
            **(settings or {}),
        }
        study = study_of(Discrepancy, cohort, asked)
        file = None if path is None else read_model(path)
    return _result(study, cohort, searched(study, cohort, file, at_once, Progress(say)))


def _result(study: Discrepancy, cohort: Cohort, found: DiscrepancyResults) -> MissingEffects:
    """The same in frames."""
    verdict = found.verdict
    tables = {one.name: frame(one, found.rows.get(one.name, ())) for one in TABLES}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "verdict.json"
        write_verdict(verdict, path, "0" * 64)
        conclusions = concluded(study, cohort, tables, {"verdict": str(path)})
    named = [
        {"name": one.name, "log_evidence": one.log_evidence, "spread": one.spread, **one.variant}
        for one in verdict.effects
    ]
    noise, rms = verdict.noise, verdict.rms_residual
    depends_on = [
        ("noise of a rotation", noise.rotation_sd_deg, "deg"),
        ("noise of a translation", noise.translation_sd_mm, "mm"),
        ("log evidence required", verdict.threshold.log_evidence, ""),
        ("residual (RMS) without the effects", rms.base, rms.unit),
        ("residual (RMS) with them", rms.with_effects, rms.unit),
        ("residual (RMS) of left-out readings, without", rms.held_out_base, rms.unit),
        ("residual (RMS) of left-out readings, with", rms.held_out_with_effects, rms.unit),
    ]
    ranked = sorted(verdict.probabilities.items(), key=lambda one: -one[1])
    # of the places where a page has it, the one that names what was not tried
    of_search = [one.text for one in conclusions if (one.place, one.rule) == ("light", "ended")]
    return MissingEffects(
        table=pd.DataFrame(named, columns=None if named else ["name", "log_evidence", "spread"]),
        conclusions=conclusions,
        depends_on=pd.DataFrame(depends_on, columns=["quantity", "value", "unit"]),
        search="".join(of_search),
        verdict=verdict.verdict.value,
        why=verdict.why,
        probabilities=pd.DataFrame(ranked, columns=["name", "probability"]),
        alternatives=pd.DataFrame([asdict(one) for one in verdict.in_set]),
        not_testable=pd.DataFrame([asdict(one) for one in verdict.not_testable]),
        next_tests=tables[NEXT_TESTS.name],
        candidates=tables[CANDIDATES.name],
        misfit=tables[GAP.name],
        left_out=tables[HELD_OUT.name],
        model=found.model_with_effects,
    )
