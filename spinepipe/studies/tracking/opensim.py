"""Jobs: a person's skeleton and motions as files that OpenSim replays.

Bodies are slices of the trunk, without head and arms. Names that OpenSim cannot take are changed.
"""

from dataclasses import replace

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.jobs.digest import mark_of, provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.marks import KEY, write_marked
from spinepipe.motion.export import mot, opensim_names, osim
from spinepipe.motion.skeleton import BODIES
from spinepipe.studies.exports import Exported, refuse
from spinepipe.studies.kind import WantedFiles
from spinepipe.studies.recordings import motion_digests
from spinepipe.studies.tracking.persons import TrackedPerson, person_of
from spinepipe.studies.tracking.settings import Tracking
from spinepipe.studies.tracking.tracked_motions import motions
from spinepipe.tables import read_frame
from spinepipe.units import COORDINATES


def skeleton(root: str, study: str, specimen: str, output: str) -> None:
    """Write the model of a person."""
    settings, cohort = study_of_kind(Tracking, root, study)
    person = person_of(cohort, specimen, cohort.folder, settings.scaling)
    made_by = provenance("skeleton", settings, cohort, [specimen], motion_digests(cohort, specimen))
    write_marked(document(person), output, made_by[KEY])


def motion(
    root: str, study: str, specimen: str, trial: str, approach: str, tracked: str, output: str
) -> None:
    """Write the motion of a tracked file; without frames where the fit found no posture."""
    settings, cohort = study_of_kind(Tracking, root, study)
    made_by = provenance("motion", settings, cohort, [specimen], [mark_of(tracked)])
    name = "_".join(opensim_names((specimen, trial, approach)))
    time_s, q = np.zeros(0), np.zeros((0, len(BODIES), len(COORDINATES)))
    for one in motions(read_frame(tracked)):
        time_s, q = one.time_s, one.q
    write_marked(mot(name, time_s, q), output, made_by[KEY])


def document(person: TrackedPerson) -> str:
    """OpenSim's model of a person."""
    markers = replace(person.markers, names=opensim_names(person.markers.names))
    (name,) = opensim_names((person.name,))
    return osim(person.skeleton, markers, name)


def exported(study: Tracking, cohort: Cohort, wanted: WantedFiles) -> Exported:
    """OpenSim's model of a person, and in words what it is: a skeleton, without stiffness.

    Raises
    ------
    InputError
        Where a joint pose, a representation or a test is asked for.
    """
    refuse(wanted)
    person = person_of(cohort, wanted.specimen, cohort.folder, study.scaling)
    size = "made as large as markers say" if study.scaling == "markers" else "of the cohort"
    count = len(person.markers)
    return Exported(document(person), f"skeleton {size}, {count} markers, without head and arms")
