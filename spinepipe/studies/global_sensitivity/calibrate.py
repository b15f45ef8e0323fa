"""Job: stiffness of one specimen calibrated to its measured motion, in one batch of samples."""

from collections.abc import Mapping, Sequence
from typing import Any

from spinepipe.calibration import fit
from spinepipe.cohort import Cohort
from spinepipe.designs import specimen_seed
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.model import RefusedModel
from spinepipe.statics import with_parameters
from spinepipe.status import Status
from spinepipe.studies.global_sensitivity.batch import Batch, batch_of, made_of_batches
from spinepipe.studies.global_sensitivity.settings import GlobalSensitivity
from spinepipe.studies.global_sensitivity.start import problem_of
from spinepipe.studies.global_sensitivity.tables import CALIBRATED
from spinepipe.tables import from_rows, write
from spinepipe.units import STIFFNESS_COLUMNS

STARTS = 1


def run(
    root: str,
    study: str,
    design: str,
    specimen: str,
    parts: Mapping[str, Mapping[str, str]],
    base: Sequence[str] = (),
) -> None:
    """Write a file of each batch, one row per sample: stiffness that all joints share.

    Parameters
    ----------
    base : file of the specimen's fitted stiffness, where factors start from it.
    """
    settings, cohort = study_of_kind(GlobalSensitivity, root, study)
    made_by = made_of_batches("calibrate", settings, cohort, specimen, design, base)
    for path, place in parts.items():
        one = batch_of(root, settings, cohort, design, base, specimen, int(place["batch"]), True)
        rows = [_refused(one.first + sample, why) for sample, why in one.varied.refused.items()]
        for lane, sample in enumerate(one.varied.kept.tolist()):
            rows.append(_fitted(settings, cohort, specimen, one, lane, one.first + sample))
        rows.sort(key=lambda row: int(row["sample"]))
        write(from_rows(CALIBRATED, rows, specimen=specimen), path, made_by)


def _fitted(
    settings: GlobalSensitivity,
    cohort: Cohort,
    specimen: str,
    batch: Batch,
    place: int,
    sample: int,
) -> dict[str, Any]:
    options = settings.calibration
    try:
        # the sample's spine and loads, and the readings in the frames that it has
        model = batch.varied.spines.model(place)
        cases = [varied.case(place) for varied in batch.varied.cases]
        problem = problem_of(options, cohort, batch.start, model, cases, options.free)
        seed = specimen_seed(settings.seed, f"{specimen}/{sample}")
        found = fit(problem, STARTS, seed, options.identifiable_below)
    except RefusedModel as error:
        return _refused(sample, str(error))
    values = with_parameters(problem.model, problem.free, found.x).effects[0].values[0]
    row: dict[str, Any] = {
        name: float(value) if found.status.usable else None
        for name, value in zip(STIFFNESS_COLUMNS, values, strict=True)
    }
    return {**row, "sample": sample, "status": found.status.value, "message": found.message}


def _refused(sample: int, message: str) -> dict[str, Any]:
    row: dict[str, Any] = dict.fromkeys(STIFFNESS_COLUMNS)
    return {**row, "sample": sample, "status": Status.REFUSED.value, "message": message}
