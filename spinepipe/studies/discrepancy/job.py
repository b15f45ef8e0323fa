"""What is written where the base model cannot be fitted: why, and what looks wrong in the data."""

from collections.abc import Mapping, Sequence
from typing import Any

from spinepipe.cohort import Cohort
from spinepipe.discrepancy.base import BUSHING
from spinepipe.discrepancy.grounds import NoBase
from spinepipe.discrepancy.mistakes.data_errors import before_a_fit
from spinepipe.discrepancy.mistakes.suspected import SuspectedError
from spinepipe.discrepancy.noise import Noise
from spinepipe.discrepancy.outcome import Verdict
from spinepipe.discrepancy.prepared import measured, with_noise
from spinepipe.jobs.discrepancy.results import Results
from spinepipe.jobs.discrepancy.verdict import noise_data
from spinepipe.model.file import EffectEntry, ModelFile, Values
from spinepipe.studies import Discrepancy
from spinepipe.units import STIFFNESS_COLUMNS

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
        verdict=_verdict(cohort, noise, errors, str(trouble), study.false_alarm),
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


def _verdict(
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
