"""Job: the values of all factors in all samples of a study."""

import numpy as np
import pyarrow as pa

from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.studies.global_sensitivity.sampling import drawn_in_units
from spinepipe.studies.global_sensitivity.settings import GlobalSensitivity
from spinepipe.studies.global_sensitivity.tables import DESIGN
from spinepipe.tables import to_arrow, write


def run(root: str, study: str, output: str) -> None:
    """Write ``design.parquet``: sample by sample, factor by factor."""
    settings, cohort = study_of_kind(GlobalSensitivity, root, study)
    values = drawn_in_units(settings)
    samples, count = values.shape
    columns = {
        "sample": np.repeat(np.arange(samples), count),
        "factor": _repeated(settings.factor_names, samples),
        "value": values.ravel(),
        "group": _repeated(settings.groups, samples),
        "unit": _repeated(settings.units, samples),
    }
    made_by = provenance("design", settings, cohort, ())
    write(to_arrow(DESIGN, columns), output, made_by)


def _repeated(words: tuple[str, ...], times: int) -> pa.Array:
    """The words that many times over."""
    return pa.array(words).take(pa.array(np.tile(np.arange(len(words)), times)))
