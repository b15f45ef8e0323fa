"""What a reader of results must know of a person's input though nothing of it is refused."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.motion.skeleton import BODIES
from spinepipe.studies.tracking.persons import TrackedPerson, marker_set, recording, trial_rows
from spinepipe.studies.tracking.trial_preview import runs

LONGEST_CHAIN = 5
"""Levels in a row without a marker between them; motion cannot be shared out among more."""


@dataclass(frozen=True)
class Remark:
    """Something about a trial; about the person where its name is empty."""

    trial: str
    text: str


def warnings_of(person: TrackedPerson) -> tuple[Remark, ...]:
    """Levels that markers do not tell apart, and gaps that are filled by what is around them."""
    return (*_chains(person), *_filled(person))


def _chains(person: TrackedPerson) -> Iterator[Remark]:
    """Runs of levels between bodies with markers, and beyond the last of them."""
    marked = sorted(set(person.markers.body.tolist()))
    ends = [*marked, len(BODIES) - 1]
    for low, high in pairwise(ends):
        if high - low > LONGEST_CHAIN:
            yield Remark(
                "",
                f"{high - low} levels from {BODIES[low]} to {BODIES[high]} without a marker "
                f"between them: how they share their motion is not told by markers",
            )


def _filled(person: TrackedPerson) -> Iterator[Remark]:
    for trial in person.trials:
        gaps = [len(runs(~seen)) for seen in trial.seen.T]
        if any(gaps):
            most = int(np.argmin(trial.seen.mean(axis=0)))
            lost = 100.0 * (1.0 - float(trial.seen[:, most].mean()))
            yield Remark(
                trial.name,
                f"{sum(gaps)} short gaps, most of {person.markers.names[most]}, "
                f"out of sight in {lost:.1f} % of the frames",
            )


def repairs_of(cohort: Cohort, specimen: str) -> tuple[Remark, ...]:
    """What was read otherwise than it stands in files of motion, and markers that are ignored."""
    names = marker_set(cohort, specimen).names
    found = []
    for row in trial_rows(cohort, specimen):
        read = recording(row, cohort.name, cohort.folder)
        trial = str(row["trial"])
        found += [Remark(trial, text) for text in read.repaired]
        spare = [name for name in read.names if name not in names]
        if spare:
            found.append(Remark(trial, f"not in the set and ignored: {', '.join(spare)}"))
    return tuple(found)
