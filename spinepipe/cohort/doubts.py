"""What a sound cohort most likely has wrong: units and signs that no cell gives away.

Each joint's motion is held against what its load gives with published stiffness, without a fit:
a mistake is told before anything runs, and where no fit would find a pose. These doubts are told
and nothing is refused: a joint may be fused, a specimen no spine of a person. What
`doubtful_places` and its neighbours find may be certain: then no run starts, unless cohort.yaml
says that it is meant.

Not told: units that leave the motion within a factor of five (lbf for N, kgf for N), joints whose
moment is made by a force with a lever arm of less than a centimetre, and tests with supports,
whose loads a rig shares.
"""

import re
from collections import defaultdict
from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import log, sqrt

import numpy as np

from spinepipe.anatomy.stiffness_range import plausible, range_of_level
from spinepipe.cohort.answers import Answer, answers_of_test, of_specimens, typical
from spinepipe.cohort.cohort import Cohort
from spinepipe.cohort.doubt import Doubt
from spinepipe.cohort.doubtful_masses import doubtful_masses
from spinepipe.cohort.doubtful_order import doubtful_order
from spinepipe.cohort.doubtful_persons import doubtful_persons
from spinepipe.cohort.doubtful_places import (
    doubtful_points,
    doubtful_sizes,
    file_of,
    first_row,
)
from spinepipe.cohort.doubtful_postures import (
    doubtful_landmarks,
    doubtful_postures,
    doubtful_shapes,
    doubtful_sides,
)
from spinepipe.cohort.doubtful_readings import doubtful_readings, doubtful_sizes_of_readings
from spinepipe.cohort.doubtful_rigs import doubtful_rigs
from spinepipe.cohort.doubtful_series import doubtful_series
from spinepipe.cohort.load_tests import DRIVEN, PUSHED
from spinepipe.cohort.loaded_cycles import LoadedCycle, loaded_cycles
from spinepipe.cohort.motion_size import PLAUSIBLE, Unit, geometric_mean, is_plausible, unit_like
from spinepipe.cohort.neutral_pose import neutral_poses
from spinepipe.problems import Problem
from spinepipe.units import COORDINATE_COLUMNS, COORDINATES, ROTATIONS, to_si

AGAINST = -0.9
"""Correlation of motion and load below which a joint moves against its load."""

CLEAR = 5.0
"""SDs of one reading that motion must exceed to tell a sign."""

USUAL_SD = 0.1
"""SD of one reading, deg and mm, of a cohort that does not tell its own."""

LOAD_COLUMNS = {
    **{name: f"m{axis}_nm" for name, axis in zip(DRIVEN, "xyz", strict=True)},
    **{name: f"f{axis}_n" for name, axis in zip(PUSHED, "xyz", strict=True)},
}
"""Column of loads.csv that drives each coordinate where joints are upright."""


WAYS = (
    ({"flexion"}, "extension_deg", -1.0),
    ({"extension"}, "extension_deg", 1.0),
    ({"right", "bending"}, "right_bending_deg", 1.0),
    ({"left", "bending"}, "right_bending_deg", -1.0),
    ({"left", "rotation"}, "left_rotation_deg", 1.0),
    ({"right", "rotation"}, "left_rotation_deg", -1.0),
)
"""Words in the name of a test, the column that it turns, and to which side."""

OTHER_SIDE: Mapping[str, set[str]] = {
    "flexion": {"extension"},
    "extension": {"flexion"},
    "right": {"left"},
    "left": {"right"},
    "bending": {"rotation"},
    "rotation": {"bending"},
}
"""Words beside which a name tells no side."""


@dataclass(frozen=True)
class _Told:
    """A joint's answer to its load as the doubts see it.

    Attributes
    ----------
    ratio : measured motion over that with the middle of the published stiffness of the level;
        below 0 where it goes against its load.
    """

    answer: Answer
    joint: str
    ratio: float

    @property
    def beyond(self) -> float:
        """Size of the motion over that with the nearest published stiffness; 1 within the range."""
        low, high = range_of_level(self.joint, self.answer.coordinate)
        reach = sqrt(high / low)
        return max(abs(self.ratio) / reach, 1.0) * min(abs(self.ratio) * reach, 1.0)

    @property
    def place(self) -> tuple[str, str, str]:
        """Specimen, test and coordinate."""
        return self.answer.specimen, self.answer.test, self.answer.coordinate


def suspicions(cohort: Cohort) -> tuple[Doubt, ...]:
    """All that looks wrong, one for each column and what is behind it.

    What explains a reading keeps quiet what would be said of it besides.
    """
    geometry = tuple(_geometry(cohort) if cohort.has_frames else ())
    readings = (*doubtful_readings(cohort), *doubtful_series(cohort))
    rigs = (*doubtful_rigs(cohort), *doubtful_persons(cohort))
    cycles = tuple(_trusted(cohort, geometry, (*readings, *rigs)))
    order = doubtful_order(cohort, cycles)
    answers = tuple(_answers(cohort, cycles, order.places, readings))
    explained = order.doubts or answers
    found = (
        *geometry,
        *rigs,
        *(one for one in readings if not (order.doubts and one.group == "zeroing")),
        *order.doubts,
        *answers,
        *(() if explained or geometry else doubtful_sizes_of_readings(cohort)),
    )
    return tuple(dict.fromkeys(found))


def _answers(
    cohort: Cohort,
    cycles: Sequence[LoadedCycle],
    explained: Container[tuple[str, str]],
    readings: Sequence[Doubt],
) -> Iterator[Doubt]:
    """Units and signs of motion against its loads, where nothing else is behind them.

    Parameters
    ----------
    explained : specimens and tests that follow their loads in another order. readings : doubts
        about columns of motion.
    """
    told = [one for one in _told(cohort, cycles) if one.place[:2] not in explained]
    told = [one for one in told if not _spoilt(cohort, one.place[2], readings)]
    turned = {one.place[:2] for one in told if one.place[2] in ROTATIONS}
    spoilt = {one.problem.column for one in readings}
    named = [
        (place, one)
        for place, one in _against_names(cohort)
        if place not in turned and place not in explained and one.column not in spoilt
    ]
    problems = (*_sizes(cohort, told), *_signs(cohort, told), *(one for _, one in named))
    yield from (Doubt(problem, "motion") for problem in problems)


def _geometry(cohort: Cohort) -> Iterator[Doubt]:
    """Of joints, then of what stands beside joints that are trusted: one mistake is told once."""
    poses = list(neutral_poses(cohort))
    landmarks = doubtful_landmarks(cohort)
    left = [pose for pose in poses if pose.specimen not in landmarks.specimens]
    sizes = doubtful_sizes(cohort, left)
    left = [pose for pose in left if pose.specimen not in sizes.specimens]
    postures = doubtful_postures(cohort, left)
    trusted = [pose for pose in left if pose.specimen not in postures.specimens]
    shapes = doubtful_shapes(cohort, landmarks.specimens | sizes.specimens)
    for found in (landmarks, sizes, postures, shapes):
        yield from found.doubts
    if not shapes.doubts:
        yield from doubtful_sides(cohort, landmarks.specimens)
    yield from doubtful_points(cohort, trusted)
    yield from doubtful_masses(cohort, trusted)


def _trusted(
    cohort: Cohort, geometry: Sequence[Doubt], readings: Sequence[Doubt]
) -> Iterator[LoadedCycle]:
    """Cycles whose loads on the joints are known: not of forces where places are doubted."""
    places = {"joints.csv", "landmarks.csv", "loads.csv", "preload.csv"}
    doubted = {one.problem.file.split("/")[-1] for one in geometry} & places
    loads = file_of(cohort, "loads")
    if any(one.problem.file == loads and one.problem.column != "time_s" for one in readings):
        return
    if doubted & {"joints.csv", "landmarks.csv"}:
        return
    for cycle in loaded_cycles(cohort):
        if not (doubted and cycle.pushed):
            yield cycle


def _spoilt(cohort: Cohort, coordinate: str, readings: Sequence[Doubt]) -> bool:
    """Whether a column is doubted already, whatever its motion is over its load."""
    column = _motion_column(coordinate)
    file = file_of(cohort, "motion")
    return any(one.problem.file == file and one.problem.column == column for one in readings)


def _told(cohort: Cohort, cycles: Sequence[LoadedCycle]) -> Iterator[_Told]:
    """Every joint that a test drives, cycle by cycle."""
    for cycle in cycles:
        from_start = cohort.zeroed_at_step_0 or cycle.read_steps == 1  # from the neutral pose
        of_test = (cycle.specimen, cycle.test, cycle.loads, cycle.readings, from_start)
        for answer in answers_of_test(*of_test):
            joint = cohort.joint_names[answer.joint]
            ratio = answer.slope * plausible(joint, answer.coordinate)
            if ratio != 0.0:
                yield _Told(answer, joint, ratio)


def _sizes(cohort: Cohort, told: Sequence[_Told]) -> Iterator[Problem]:
    """Motion that is too large or too small for its load, grouped by what may be behind it."""
    found: dict[tuple[str, str, Unit | None], list[tuple[str, str, float]]] = defaultdict(list)
    for specimen in cohort.specimen_names:
        own = [one for one in told if one.answer.specimen == specimen]
        for (_, test, coordinate), ratio, unit in _of_specimen(own):
            stem = "loads" if unit is not None and unit.of_loads else "motion"
            found[stem, coordinate, unit].append((specimen, test, ratio))
    for (stem, coordinate, unit), places in found.items():
        yield _size(cohort, stem, coordinate, unit, places)


def _of_specimen(
    told: Sequence[_Told],
) -> Iterator[tuple[tuple[str, str, str], float, Unit | None]]:
    """Tests and coordinates of a specimen whose joints move too far or too little in the median.

    A unit of loads or angles is mostly of all tests: where it explains all of them better, those
    that are just inside of what is plausible are told too. Not so of translations, whose published
    stiffness spans a factor of thirty.
    """
    for rotations in (False, True):  # translations have no unit in common with rotations
        of_place: dict[tuple[str, str, str], list[_Told]] = defaultdict(list)
        for one in told:
            if (one.answer.coordinate in ROTATIONS) == rotations:
                of_place[one.place].append(one)
        sizes = {place: typical([o.ratio for o in ones]) for place, ones in of_place.items()}
        together = geometric_mean(list(sizes.values())) if sizes else 1.0
        shared = _shared(together, sizes) if rotations else None
        for place, ones in of_place.items():
            beyond = typical([one.beyond for one in ones])
            if shared is not None:
                yield place, together, shared
            elif not is_plausible(beyond):
                yield place, beyond, unit_like(sizes[place], place[2])


def _shared(together: float, of_place: Mapping[tuple[str, str, str], float]) -> Unit | None:
    """The unit that all tests of a specimen have wrong; None where some are better without it."""
    if is_plausible(together):
        return None
    sizes, coordinate = list(of_place.values()), next(iter(of_place))[2]
    unit = unit_like(together, coordinate)
    if unit is None or any(abs(log(size / unit.factor)) > abs(log(size)) for size in sizes):
        return None
    return unit


def _size(
    cohort: Cohort,
    stem: str,
    coordinate: str,
    unit: Unit | None,
    places: Sequence[tuple[str, str, float]],
) -> Problem:
    ratio = geometric_mean([ratio for _, _, ratio in places])
    column = LOAD_COLUMNS[coordinate] if stem == "loads" else _motion_column(coordinate)
    found = (
        f"{_motion_column(coordinate)} {ratio:.3g} times as large as the load gives with published "
        f"stiffness nearest to it ({_whose(cohort, [(name, test) for name, test, _ in places])})"
    )
    allowed = f"1/{PLAUSIBLE:g} to {PLAUSIBLE:g} times, as joints were seen to have"
    remedy = (
        f"suspected: {unit}; convert the column"
        if unit is not None
        else "look for a wrong unit of motion or loads, and for joints that are fused or cut"
    )
    line = first_row(cohort, stem, places[0][0], places[0][1], column)
    return Problem(file_of(cohort, stem), line, column, found, allowed, remedy)


def _signs(cohort: Cohort, told: Sequence[_Told]) -> Iterator[Problem]:
    """Motion against its load: of single joints, and of all joints of a test."""
    driven: Mapping[tuple[str, str, str], set[str]] = defaultdict(set)
    against: Mapping[tuple[str, str, str], set[str]] = defaultdict(set)
    for one in told:
        driven[one.place].add(one.joint)
        if _is_against(cohort, one):
            against[one.place].add(one.joint)
    found: dict[tuple[str, str, tuple[str, ...]], list[str]] = defaultdict(list)
    for (specimen, test, coordinate), joints in against.items():
        whole = joints == driven[specimen, test, coordinate]
        key = () if whole else tuple(name for name in cohort.joint_names if name in joints)
        found[test, coordinate, key].append(specimen)
    for (test, coordinate, named), specimens in found.items():
        yield _sign(cohort, test, coordinate, named, specimens)


def _against_names(cohort: Cohort) -> Iterator[tuple[tuple[str, str], Problem]]:
    """Specimens and tests that turn all joints to the other side than the test's name says."""
    if cohort.motion is None:
        return
    for (specimen, test), rows in cohort.motion.groupby(["specimen", "test"], sort=False):
        place = str(specimen), str(test)
        words = set(re.split(r"[^a-z]+", place[1].lower()))
        for way, column, sign in WAYS:
            read = rows[column].dropna()
            turned = read[read != 0.0] * sign
            other = set().union(*(OTHER_SIDE[word] for word in way))
            if way <= words and not words & other and len(turned) and (turned < 0.0).all():
                line = first_row(cohort, "motion", *place, column)
                found = f"{column} of the other sign in all readings of {specimen}, test {test}"
                allowed = "flexion and left bending negative, extension and left rotation positive"
                remedy = f"suspected: the sign of {column}, or the name of the test"
                told = (file_of(cohort, "motion"), line, column)
                yield place, Problem(*told, found, allowed, remedy)


def _is_against(cohort: Cohort, one: _Told) -> bool:
    """Whether a joint moves against its load, clear of the noise, as far as joints move."""
    sd = cohort.measurement_sd
    size = (USUAL_SD, USUAL_SD) if sd is None else (sd.translation_mm, sd.rotation_deg)
    noise = to_si(np.repeat(size, 3))[COORDINATES.index(one.answer.coordinate)]
    far = abs(one.ratio) >= 1.0 / PLAUSIBLE
    return far and one.answer.correlation < AGAINST and one.answer.rms > CLEAR * noise


def _sign(
    cohort: Cohort, test: str, coordinate: str, joints: Sequence[str], specimens: Sequence[str]
) -> Problem:
    column = _motion_column(coordinate)
    which = f"of {', '.join(joints)}" if joints else "of all joints"
    found = f"{column} {which} against the load ({_whose(cohort, [(s, test) for s in specimens])})"
    allowed = "motion with the load that drives it"
    driving = f"{LOAD_COLUMNS[coordinate]} in {file_of(cohort, 'loads')}"
    remedy = f"suspected: the sign of {column}" + (
        ", or vertebrae exchanged; turn it" if joints else f", or of {driving}; turn one of them"
    )
    line = first_row(cohort, "motion", specimens[0], test, column, joints[0] if joints else None)
    return Problem(file_of(cohort, "motion"), line, column, found, allowed, remedy)


def _whose(cohort: Cohort, places: Sequence[tuple[str, str]]) -> str:
    """Tests and specimens in words."""
    tests = list(dict.fromkeys(test for _, test in places))
    whose = of_specimens(dict.fromkeys(name for name, _ in places), cohort.specimen_names)
    return f"{whose}, test{'s' if len(tests) > 1 else ''} {', '.join(tests)}"


def _motion_column(coordinate: str) -> str:
    return COORDINATE_COLUMNS[COORDINATES.index(coordinate)]
