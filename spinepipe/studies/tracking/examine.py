"""Job: a person's recordings before anything is tracked: clusters, size, what is remarkable."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.motion.measures import rigidity
from spinepipe.motion.skeleton import MarkerSet, MarkerTrial
from spinepipe.studies.tracking.extra_inputs import marks_of
from spinepipe.studies.tracking.persons import TrackedPerson, person_of, size_of
from spinepipe.studies.tracking.remarks import Remark, repairs_of, warnings_of
from spinepipe.studies.tracking.scaled_persons import ScaledPerson, size_rows
from spinepipe.studies.tracking.settings import Tracking
from spinepipe.studies.tracking.tables import CLUSTERS, REMARKS, SIZES
from spinepipe.tables import from_rows, write
from spinepipe.units import MM_PER_M

RIGID_MM = 1.0
"""More is not rigid: Wang et al. 2021 found 0.27 mm (SD 0.04), and cameras add some tenths."""


def run(root: str, study: str, specimen: str, clusters: str, remarks: str, sizes: str) -> None:
    """Write the rows of a person, a file for each table."""
    settings, cohort = study_of_kind(Tracking, root, study)
    person = person_of(cohort, specimen, cohort.folder)
    found = size_of(person)
    rigid = [row for one in person.trials for row in cluster_rows(specimen, person.markers, one)]
    made_by = provenance("examine", settings, cohort, [specimen], marks_of(cohort, specimen))
    write(from_rows(CLUSTERS, rigid), clusters, made_by)
    write(from_rows(REMARKS, list(remark_rows(cohort, person, found))), remarks, made_by)
    write(from_rows(SIZES, list(size_rows(specimen, found))), sizes, made_by)


def remark_rows(
    cohort: Cohort, person: TrackedPerson, found: ScaledPerson
) -> Iterator[dict[str, Any]]:
    """Rows of table `remarks`: what is so, then what was put right, each once."""
    remarks = [*warnings_of(person), *repairs_of(cohort, person.name)]
    if found.message:
        remarks.append(Remark("", found.message))
    for remark in dict.fromkeys(remarks):
        yield {"specimen": person.name, "trial": remark.trial, "remark": remark.text}


def cluster_rows(specimen: str, markers: MarkerSet, trial: MarkerTrial) -> Iterator[dict[str, Any]]:
    """Rows of table `clusters` of a trial, by cluster in the order of the set."""
    for name in dict.fromkeys(cluster for cluster in markers.cluster if cluster):
        own = np.array([cluster == name for cluster in markers.cluster])
        found = rigidity(trial.places[:, own], trial.seen[:, own])
        if found.variability_m is None:
            status, told = "too_few", None
        else:
            told = MM_PER_M * found.variability_m
            status = "rigid" if told <= RIGID_MM else "not_rigid"
        yield {
            "specimen": specimen,
            "trial": trial.name,
            "cluster": name,
            "variability_mm": told,
            "variability_percent": found.variability_percent,
            "frames": found.frames,
            "status": status,
        }
