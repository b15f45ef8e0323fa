"""Job: the values of all factors in all samples of a study."""

import numpy as np
import pyarrow as pa

from spinepipe.jobs.global_sensitivity.drawn import design_of
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.jobs.provenance import provenance
from spinepipe.sensitivity.global_indices import values_of
from spinepipe.studies import GlobalSensitivity
from spinepipe.studies.drawn_from import spreads_of
from spinepipe.tables import DESIGN, to_arrow, write


def run(root: str, study: str, output: str) -> None:
    """Write ``design.parquet``: sample by sample, factor by factor."""
    settings, cohort = study_of_kind(GlobalSensitivity, root, study)
    design = design_of(settings)
    values = values_of(design, spreads_of(settings)) * np.array(settings.per_si)
    samples, count = values.shape
    columns = {
        "sample": np.repeat(np.arange(samples), count),
        "factor": _repeated(settings.factor_names, samples),
        "value": values.ravel(),
        "group": _repeated(settings.groups, samples),
        "unit": _repeated(settings.units, samples),
    }
    made_by = provenance("global_sensitivity.design", settings, cohort)
    write(to_arrow(DESIGN, columns), output, made_by)


def _repeated(words: tuple[str, ...], times: int) -> pa.Array:
    """The words that many times over."""
    return pa.array(words).take(pa.array(np.tile(np.arange(len(words)), times)))
