"""Jobs: a person's skeleton and motions as files that OpenSim replays.

Bodies are slices of the trunk, without head and arms. Names that OpenSim cannot take are changed.
"""

from dataclasses import replace

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.jobs.digest import mark_of, provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.marks import KEY, write_marked
from spinepipe.motion.export import mot, osim, usable
from spinepipe.motion.skeleton import BODIES
from spinepipe.studies.exports import refuse
from spinepipe.studies.kind import WantedFiles
from spinepipe.studies.tracking.extra_inputs import marks_of
from spinepipe.studies.tracking.persons import TrackedPerson, person_of
from spinepipe.studies.tracking.reload_motions import motions
from spinepipe.studies.tracking.settings import Tracking
from spinepipe.tables import read_frame
from spinepipe.units import COORDINATES


def skeleton(root: str, study: str, specimen: str, output: str) -> None:
    """Write the model of a person."""
    settings, cohort = study_of_kind(Tracking, root, study)
    person = person_of(cohort, specimen, cohort.folder, settings.scaling)
    made_by = provenance("skeleton", settings, cohort, [specimen], marks_of(cohort, specimen))
    write_marked(document(person), output, made_by[KEY])


def motion(
    root: str, study: str, specimen: str, trial: str, approach: str, tracked: str, output: str
) -> None:
    """Write the motion of a tracked file; without frames where the fit found no posture."""
    settings, cohort = study_of_kind(Tracking, root, study)
    made_by = provenance("motion", settings, cohort, [specimen], [mark_of(tracked)])
    name = "_".join(usable((specimen, trial, approach)))
    write_marked(motion_text(name, tracked), output, made_by[KEY])


def motion_text(name: str, tracked: str) -> str:
    """OpenSim's motion file of a file of table `tracked` that holds one motion."""
    for moved in motions(read_frame(tracked)):
        return mot(name, moved.time_s, moved.q)
    return mot(name, np.zeros(0), np.zeros((0, len(BODIES), len(COORDINATES))))


def document(person: TrackedPerson) -> str:
    """OpenSim's model of a person."""
    markers = replace(person.markers, names=usable(person.markers.names))
    (name,) = usable((person.name,))
    return osim(person.skeleton, markers, name)


def exported(study: Tracking, cohort: Cohort, wanted: WantedFiles) -> tuple[str, str]:
    """OpenSim's model of a person, and in words what it is: a skeleton, without stiffness.

    Raises
    ------
    InputError
        Where a joint pose or a representation is asked for.
    """
    refuse(wanted)
    person = person_of(cohort, wanted.specimen, cohort.folder, study.scaling)
    size = "made as large as markers say" if study.scaling == "markers" else "of the cohort"
    count = len(person.markers)
    return document(person), f"skeleton {size}, {count} markers, without head and arms"
