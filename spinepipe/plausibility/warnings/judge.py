"""All that looks wrong in a cohort, one line for each column and what is behind it.

What explains a reading keeps quiet what would be said of it besides: places before loads, columns
and steps before sizes and signs.
"""

from collections.abc import Iterator, Sequence

from spinepipe.cohort.cohort import Cohort
from spinepipe.cohort.load_response import LoadedCycle, loaded_cycles
from spinepipe.plausibility.warnings import columns, lengths, postures, readings
from spinepipe.plausibility.warnings.bodies import masses, persons_of_specimens
from spinepipe.plausibility.warnings.levels import neutral_poses
from spinepipe.plausibility.warnings.order import order
from spinepipe.plausibility.warnings.response import responses
from spinepipe.plausibility.warnings.warning import PlausibilityWarning, file_of

Warnings = Sequence[PlausibilityWarning]


def of_cohort(cohort: Cohort) -> tuple[PlausibilityWarning, ...]:
    """Warnings about the tables that every cohort has."""
    geometry = tuple(_geometry(cohort) if cohort.has_frames else ())
    read = tuple(readings.readings(cohort))
    rigs = (*columns.rigs(cohort), *persons_of_specimens(cohort))
    cycles = tuple(_trusted(cohort, geometry, (*read, *rigs)))
    other = order(cohort, cycles)
    motion = file_of(cohort, "motion")
    spoilt = {str(one.problem.column) for one in read if one.problem.file == motion}
    answers = tuple(responses(cohort, cycles, other.places, spoilt))
    found = (
        *geometry,
        *rigs,
        *(one for one in read if not (other.warnings and one.group == "zeroing")),
        *other.warnings,
        *answers,
        *(() if other.warnings or answers or geometry else readings.too_small(cohort)),
    )
    return tuple(dict.fromkeys(found))


def _geometry(cohort: Cohort) -> Iterator[PlausibilityWarning]:
    """Of joints, then of what stands beside joints that are trusted: one mistake is told once."""
    poses = list(neutral_poses(cohort))
    landmarks = postures.exchanged_landmarks(cohort)
    left = [pose for pose in poses if pose.specimen not in landmarks.specimens]
    sizes = lengths.sizes(cohort, left)
    left = [pose for pose in left if pose.specimen not in sizes.specimens]
    stand = postures.postures(cohort, left)
    trusted = [pose for pose in left if pose.specimen not in stand.specimens]
    shapes = postures.shapes(cohort, landmarks.specimens | sizes.specimens)
    for found in (landmarks, sizes, stand, shapes):
        yield from found.warnings
    if not shapes.warnings:
        yield from postures.sides(cohort, landmarks.specimens)
    yield from lengths.points(cohort, trusted)
    yield from masses(cohort, trusted)


def _trusted(cohort: Cohort, geometry: Warnings, readings: Warnings) -> Iterator[LoadedCycle]:
    """Cycles whose loads on the joints are known: not of forces where places are doubted."""
    places = {"joints.csv", "landmarks.csv", "loads.csv", "preload.csv"}
    doubted = {one.problem.file.split("/")[-1] for one in geometry} & places
    loads = file_of(cohort, "loads")
    if any(one.problem.file == loads and one.problem.column != "time_s" for one in readings):
        return
    if not doubted & {"joints.csv", "landmarks.csv"}:
        for cycle in loaded_cycles(cohort):
            if not (doubted and cycle.pushed):
                yield cycle
