"""Job: passive elements of one person, from motions of one kind or of two kinds together."""

from collections.abc import Sequence

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.motion.objective import Watched
from spinepipe.motion.passive import PassiveLaw
from spinepipe.motion.trajectory import OptimalMotions, solve
from spinepipe.studies.tracking.approaches import begun, fitting, seen_in
from spinepipe.studies.tracking.approaches_of_trials import trials_of_law
from spinepipe.studies.tracking.extra_inputs import marks_of
from spinepipe.studies.tracking.laws import highest, stiffness_rows, without
from spinepipe.studies.tracking.persons import person_of
from spinepipe.studies.tracking.settings import Tracking
from spinepipe.studies.tracking.tables import STIFFNESS
from spinepipe.tables import from_rows, write


def run(root: str, study: str, specimen: str, law: str, output: str) -> None:
    """Write rows of `stiffness`; law : name of the calibration."""
    settings, cohort = study_of_kind(Tracking, root, study)
    person = person_of(cohort, specimen, cohort.folder, settings.scaling)
    names = trials_of_law(cohort, specimen, law)
    seen = [seen_in(settings, person, one) for one in person.trials if one.name in names]
    made_by = provenance("calibrate", settings, cohort, [specimen], marks_of(cohort, specimen))
    try:
        ask = fitting(settings, person)
        ready = [begun(ask, one) for one in seen]
        solved = solve(ask, [one for one, _ in ready], [start for _, start in ready])
    except (ValueError, np.linalg.LinAlgError) as why:
        rows = list(without(str(why)))
    else:
        assert solved.law is not None
        high = loads_in(solved, solved.law, seen)
        rows = list(stiffness_rows(solved.law, person.passive, high, solved.status, solved.message))
    known = {"specimen": specimen, "law": law}
    write(from_rows(STIFFNESS, [known | row for row in rows]), output, made_by)


def loads_in(solved: OptimalMotions, law: PassiveLaw, seen: Sequence[Watched]) -> Array:
    """(17, 6, 2) N and N m, largest passive load of each side in solved motions."""
    motions = [
        one.grid.at_nodes(coefficients)[0][:, 1:]
        for one, coefficients in zip(seen, solved.coefficients, strict=True)
    ]
    return highest(law, motions)
