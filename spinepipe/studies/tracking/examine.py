"""Job: a person's recordings before anything is tracked: clusters, size, what is remarkable."""

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.motion.marker_groups import rigidity, runs
from spinepipe.motion.scaling import SEGMENTS
from spinepipe.motion.skeleton import BODIES, MarkerSet, MarkerTrial
from spinepipe.problems import InputProblem
from spinepipe.studies.recordings import motion_digests, read_recording, trial_rows
from spinepipe.studies.tracking.persons import (
    ScaledPerson,
    TrackedPerson,
    marker_set,
    person_of,
    size_of,
)
from spinepipe.studies.tracking.settings import Tracking
from spinepipe.studies.tracking.tables import CLUSTERS, REMARKS, SIZES
from spinepipe.tables import from_rows, write
from spinepipe.units import MM_PER_M

RIGID_MM = 1.0
"""More is not rigid: Wang et al. 2021 found 0.27 mm (SD 0.04), and cameras add some tenths."""

LONGEST_CHAIN = 5
"""Levels in a row without a marker between them; motion cannot be shared out among more."""

Remark = tuple[str, str]
"""Trial that it is about, empty where it is about the person, and text."""


def run(root: str, study: str, specimen: str, clusters: str, remarks: str, sizes: str) -> None:
    """Write the rows of a person, a file for each table."""
    settings, cohort = study_of_kind(Tracking, root, study)
    person = person_of(cohort, specimen, cohort.folder)
    found = size_of(person)
    rigid = [row for one in person.trials for row in cluster_rows(specimen, person.markers, one)]
    # what is so, then what was put right, each once
    told = [*warnings_of(person), *repairs_of(cohort, specimen)]
    told += [("", found.message)] if found.message else []
    noted = [
        {"specimen": specimen, "trial": trial, "remark": text}
        for trial, text in dict.fromkeys(told)
    ]
    made_by = provenance("examine", settings, cohort, [specimen], motion_digests(cohort, specimen))
    write(from_rows(CLUSTERS, rigid), clusters, made_by)
    write(from_rows(REMARKS, noted), remarks, made_by)
    write(from_rows(SIZES, list(size_rows(specimen, found))), sizes, made_by)


def told(_study: Tracking, cohort: Cohort, _root: Path) -> tuple[str, tuple[InputProblem, ...]]:
    """What `spinepipe check` says of files of motion: what was put right, a line for each file."""
    rows = [row for name in cohort.specimen_names for row in trial_rows(cohort, name)]
    repaired = {
        f"{cohort.name}/{row['file']}": read_recording(row, cohort.name, cohort.folder).repaired
        for row in rows
    }
    lines = [f"\n      {file}: {'; '.join(texts)}" for file, texts in repaired.items() if texts]
    return f"put right while reading:{''.join(lines)}" if lines else "", ()


def warnings_of(person: TrackedPerson) -> Iterator[Remark]:
    """Levels that markers do not tell apart, and gaps that are filled by what is around them."""
    # runs of levels between bodies with markers, and beyond the last of them
    ends = [*sorted(set(person.markers.body.tolist())), len(BODIES) - 1]
    for low, high in pairwise(ends):
        if high - low > LONGEST_CHAIN:
            yield (
                "",
                f"{high - low} levels from {BODIES[low]} to {BODIES[high]} without a marker "
                f"between them: how they share their motion is not told by markers",
            )
    for trial in person.trials:
        gaps = [len(runs(~seen)) for seen in trial.seen.T]
        if any(gaps):
            most = int(np.argmin(trial.seen.mean(axis=0)))
            lost = 100.0 * (1.0 - float(trial.seen[:, most].mean()))
            yield (
                trial.name,
                f"{sum(gaps)} short gaps, most of {person.markers.names[most]}, "
                f"out of sight in {lost:.1f} % of the frames",
            )


def repairs_of(cohort: Cohort, specimen: str) -> Iterator[Remark]:
    """What was read otherwise than it stands in files of motion, and markers that are ignored."""
    names = marker_set(cohort, specimen).names
    for row in trial_rows(cohort, specimen):
        read = read_recording(row, cohort.name, cohort.folder)
        trial = str(row["trial"])
        yield from ((trial, text) for text in read.repaired)
        # without the subject, who may be called by name: this stands on the page
        spare = [name.rpartition(":")[2] for name in read.names if name not in names]
        if spare:
            yield trial, f"not in the set and ignored: {', '.join(spare)}"


def cluster_rows(specimen: str, markers: MarkerSet, trial: MarkerTrial) -> Iterator[dict[str, Any]]:
    """Rows of table `clusters` of a trial, by cluster in the order of the set."""
    for name in dict.fromkeys(cluster for cluster in markers.cluster if cluster):
        own = np.array([cluster == name for cluster in markers.cluster])
        found = rigidity(trial.places[:, own], trial.seen[:, own])
        if found.variability_m is None:
            status, variability = "too_few", None
        else:
            variability = MM_PER_M * found.variability_m
            status = "rigid" if variability <= RIGID_MM else "not_rigid"
        yield {
            "specimen": specimen,
            "trial": trial.name,
            "cluster": name,
            "variability_mm": variability,
            "variability_percent": found.variability_percent,
            "frames": found.frames,
            "status": status,
        }


def size_rows(specimen: str, found: ScaledPerson) -> Iterator[dict[str, Any]]:
    """Rows of table `sizes`, by part of the skeleton."""
    fit = found.fit
    first, second = ("", "") if fit is None else fit.largest_pair
    for k, segment in enumerate(SEGMENTS):
        yield {
            "specimen": specimen,
            "segment": segment,
            "factor": None if fit is None else float(fit.factors[k]),
            "n_pairs": 0 if fit is None else fit.n_pairs,
            "rms_mm": None if fit is None else fit.rms_mm,
            "largest_mm": None if fit is None else fit.largest_mm,
            "first_marker": first,
            "second_marker": second,
            "status": found.status,
            "message": found.message,
        }
