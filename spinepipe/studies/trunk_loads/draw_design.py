"""Job: the values of the uncertain inputs in all samples of a study."""

from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.studies.trunk_loads.sampling import values_of_design
from spinepipe.studies.trunk_loads.settings import FACTOR_UNITS, TrunkLoads
from spinepipe.studies.trunk_loads.tables import DESIGN
from spinepipe.tables import from_rows, write


def run(root: str, study: str, output: str) -> None:
    """Write ``design.parquet``: sample by sample, factor by factor."""
    settings, cohort = study_of_kind(TrunkLoads, root, study)
    rows = [
        {"sample": sample, "factor": factor, "value": value, "unit": FACTOR_UNITS[factor]}
        for sample, values in enumerate(values_of_design(settings).tolist())
        for factor, value in zip(settings.uncertain.factors, values, strict=True)
    ]
    write(from_rows(DESIGN, rows), output, provenance("draw", settings, cohort, ()))
