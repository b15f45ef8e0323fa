"""Job: the numbers of Ghezelbash et al. 2016 beside those of a run on its volunteers.

doi 10.1007/s10237-016-0792-3.
"""

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.comparison.claim import Run, judged
from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.studies.trunk_loads.ghezelbash_2016.eq_6 import claims_of_eq_6
from spinepipe.studies.trunk_loads.ghezelbash_2016.flexion import claims_of_flexion
from spinepipe.studies.trunk_loads.ghezelbash_2016.found import ASKED, SUBJECTS
from spinepipe.studies.trunk_loads.ghezelbash_2016.own_numbers import claims_of_own_numbers
from spinepipe.studies.trunk_loads.ghezelbash_2016.persons_and_tasks import (
    claims_of_persons_and_tasks,
)
from spinepipe.studies.trunk_loads.ghezelbash_2016.postures_and_equations import (
    claims_of_postures_and_equations,
)
from spinepipe.studies.trunk_loads.ghezelbash_2016.pressures import claims_of_pressures
from spinepipe.studies.trunk_loads.ghezelbash_2016.product import asked_of
from spinepipe.studies.trunk_loads.ghezelbash_2016.rotations_and_settings import (
    claims_of_rotations_and_settings,
)
from spinepipe.studies.trunk_loads.settings import TrunkLoads
from spinepipe.studies.trunk_loads.table_of_claims import AGAINST_GHEZELBASH_2016
from spinepipe.tables import from_rows, read_frames, write

CLAIMS = (
    *claims_of_pressures(),
    *claims_of_flexion(),
    *claims_of_eq_6(),
    *claims_of_postures_and_equations(),
    *claims_of_persons_and_tasks(),
    *claims_of_rotations_and_settings(),
    *claims_of_own_numbers(),
)
"""All claims of the paper: what a run found first, what it was asked last."""


def run(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``against_ghezelbash_2016.parquet``; what needs an absent table is not computed."""
    settings, cohort = study_of_kind(TrunkLoads, root, study)
    rows = judged(CLAIMS, Run({**read_frames(tables), **facts(cohort)}, asked_of(settings)))
    origin = provenance("against_ghezelbash_2016", settings, cohort)
    write(from_rows(AGAINST_GHEZELBASH_2016, rows), output, origin)


def facts(cohort: Cohort) -> dict[str, pd.DataFrame]:
    """Persons and tasks of the cohort's folder, under names that no table of results has."""
    files = {SUBJECTS: "subjects", ASKED: "tasks"}
    return {name: cohort.further[file] for name, file in files.items() if file in cohort.further}
