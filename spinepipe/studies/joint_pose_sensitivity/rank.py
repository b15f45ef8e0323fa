"""Job: the best stiffness sets of each specimen, with which all its poses are simulated."""

import json

from spinepipe.files import appearing
from spinepipe.jobs.digest import digest_of
from spinepipe.marks import with_mark
from spinepipe.studies.joint_pose_sensitivity.filters import rank_fits
from spinepipe.studies.joint_pose_sensitivity.inputs import study_and_cohort
from spinepipe.tables import read_frame


def run(root: str, study: str, calibrations: str, output: str) -> None:
    """Write ``best.json``: specimen to its best sets of the reduced dataset; least cost is best."""
    settings, cohort = study_and_cohort(root, study)
    fits = read_frame(calibrations)
    best = {
        specimen: rank_fits(settings, fits[fits["specimen"] == specimen])[: settings.best_models]
        for specimen in cohort.specimen_names
    }
    data = with_mark(best, digest_of("rank", settings, cohort))
    with appearing(output) as temporary:
        temporary.write_text(json.dumps(data, indent=1), encoding="utf-8")
