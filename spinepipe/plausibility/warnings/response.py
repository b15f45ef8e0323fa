"""Motion against the loads that drive it: too large or too small by a unit, or to the other side.

Each joint's motion is held against what its load gives with published stiffness, without a fit: a
mistake is told before anything runs, and where no fit would find a pose.

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
from spinepipe.cohort.cohort import Array, Cohort
from spinepipe.cohort.load_response import LoadedCycle, LoadResponse, load_responses, typical
from spinepipe.cohort.load_tests import DRIVEN, PUSHED
from spinepipe.plausibility.score import (
    AGAINST,
    CLEAR,
    MistakeHypothesis,
    geometric_mean,
    is_plausible,
    unit_like,
    usual,
)
from spinepipe.plausibility.warnings.loops import open_loops
from spinepipe.plausibility.warnings.order import tests_of
from spinepipe.plausibility.warnings.warning import (
    PlausibilityWarning,
    TableCell,
    file_of,
    first_row,
    warn,
)
from spinepipe.units import COORDINATE_COLUMNS, COORDINATES, ROTATIONS, to_si

USUAL_SD = 0.1
"""SD of one reading, deg and mm, of a cohort that does not tell its own."""

ALONE = 1.6
"""How far the motion of one joint may be from that of a wrong unit, as a factor."""

LOAD_COLUMNS = {
    **{name: f"m{axis}_nm" for name, axis in zip(DRIVEN, "xyz", strict=True)},
    **{name: f"f{axis}_n" for name, axis in zip(PUSHED, "xyz", strict=True)},
}
"""Column of loads.csv that drives each coordinate where joints are upright."""

MOTION_COLUMNS = dict(zip(COORDINATES, COORDINATE_COLUMNS, strict=True))

WAYS = (
    ({"flexion"}, "extension_deg", -1.0),
    ({"extension"}, "extension_deg", 1.0),
    ({"right", "bending"}, "right_bending_deg", 1.0),
    ({"left", "bending"}, "right_bending_deg", -1.0),
    ({"left", "rotation"}, "left_rotation_deg", 1.0),
    ({"right", "rotation"}, "left_rotation_deg", -1.0),
)
"""Words in the name of a test, the column that it turns, and to which side."""

OTHER_SIDE: Mapping[str, str] = {
    **{"flexion": "extension", "extension": "flexion", "right": "left", "left": "right"},
    **{"bending": "rotation", "rotation": "bending"},
}
"""Words beside which a name tells no side."""


@dataclass(frozen=True)
class _Response:
    """A joint's answer to its load.

    Attributes
    ----------
    ratio : measured motion over that with the middle of the published stiffness of the level;
        below 0 where it goes against its load.
    """

    answer: LoadResponse
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


def responses(
    cohort: Cohort,
    cycles: Sequence[LoadedCycle],
    explained: Container[tuple[str, str]],
    spoilt: Container[str],
) -> Iterator[PlausibilityWarning]:
    """Units and signs of motion against its loads, where nothing else is behind them.

    Parameters
    ----------
    explained : specimens and tests that follow their loads in another order. spoilt : columns of
        motion.csv that are doubted already.
    """
    told = [
        one
        for one in _responses(cohort, cycles)
        if one.place[:2] not in explained and MOTION_COLUMNS[one.place[2]] not in spoilt
    ]
    yield from _sizes(cohort, told)
    yield from _signs(cohort, told)
    yield from open_loops(cohort, [one.answer for one in told], _noise(cohort))
    turned = {one.place[:2] for one in told if one.place[2] in ROTATIONS}
    for place, column in _against_names(cohort):
        if place not in turned and place not in explained and column not in spoilt:
            row = first_row(cohort, "motion", filled=column, specimen=place[0], test=place[1])
            yield warn(
                cohort,
                "motion_against_name",
                TableCell("motion", row, column),
                whose=[place[0]],
                test=place[1],
                column=column,
            )


def _responses(cohort: Cohort, cycles: Sequence[LoadedCycle]) -> Iterator[_Response]:
    """Every joint that a test drives, cycle by cycle."""
    for cycle in cycles:
        from_start = cohort.zeroed_at_step_0 or cycle.read_steps == 1  # from the neutral pose
        of_test = (cycle.specimen, cycle.test, cycle.loads, cycle.readings, from_start)
        for answer in load_responses(*of_test):
            joint = cohort.joint_names[answer.joint]
            ratio = answer.slope * plausible(joint, answer.coordinate)
            if ratio != 0.0:
                yield _Response(answer, joint, ratio)


def _sizes(cohort: Cohort, told: Sequence[_Response]) -> Iterator[PlausibilityWarning]:
    """Motion that is too large or too small for its load, grouped by what may be behind it."""
    found: dict[tuple[str, MistakeHypothesis | None, str], list[tuple[str, str, float, float]]] = (
        defaultdict(list)
    )
    for specimen in cohort.specimen_names:
        own = [one for one in told if one.answer.specimen == specimen]
        seen = set()
        for place, ratio, size, unit in _of_specimen(own):
            found[place[2], unit, ""].append((*place[:2], ratio, size))
            seen.add(place)
        for one in own:
            unit = None if one.place in seen else _of_one_joint(one, own)
            alone = (*one.place[:2], abs(one.ratio), abs(one.ratio))
            if unit is not None and alone not in found[one.place[2], unit, one.joint]:
                found[one.place[2], unit, one.joint].append(alone)
    for (coordinate, unit, joint), places in found.items():
        of_loads = unit is not None and unit.table == "loads"
        stem, names = ("loads", LOAD_COLUMNS) if of_loads else ("motion", MOTION_COLUMNS)
        column = names[coordinate]
        where = {"specimen": places[0][0], "test": places[0][1]}
        where |= {"joint": joint} if joint and stem == "motion" else {}
        row = first_row(cohort, stem, filled=column, **where)
        yield warn(
            cohort,
            "motion_over_expected",
            TableCell(stem, row, column),
            remedy=unit and unit.mend(),
            factor=unit and (1.0 / unit.factor if of_loads else unit.factor),
            whose=[name for name, *_ in places],
            tests=tests_of(places),
            of_tests=[test for _, test, *_ in places],
            of_joints=[joint] if joint else (),
            over_expected=geometric_mean([size for *_, size in places]),
            motion=MOTION_COLUMNS[coordinate] + (f" of {joint}" if joint else ""),
            ratio=geometric_mean([ratio for *_, ratio, _ in places]),
        )


def _of_specimen(
    told: Sequence[_Response],
) -> Iterator[tuple[tuple[str, str, str], float, float, MistakeHypothesis | None]]:
    """Tests and coordinates of a specimen whose joints move too far or too little in the median.

    A unit of loads or angles is mostly of all tests: where it explains all of them better, those
    that are just inside of what is plausible are told too. Not so of translations, whose published
    stiffness spans a factor of thirty.
    """
    for rotations in (False, True):  # translations have no unit in common with rotations
        of_place: dict[tuple[str, str, str], list[_Response]] = defaultdict(list)
        for one in told:
            if (one.answer.coordinate in ROTATIONS) == rotations:
                of_place[one.place].append(one)
        sizes = {place: typical([o.ratio for o in ones]) for place, ones in of_place.items()}
        together = geometric_mean(list(sizes.values())) if sizes else 1.0
        shared = _shared(together, list(sizes.values())) if rotations else None
        for place, ones in of_place.items():
            beyond = typical([one.beyond for one in ones])
            if shared is not None:
                yield place, together, together, shared
            elif not is_plausible(beyond):
                yield place, beyond, sizes[place], unit_like(sizes[place], place[2])


def _of_one_joint(one: _Response, own: Sequence[_Response]) -> MistakeHypothesis | None:
    """The unit of angles that a joint has wrong beside joints of its test that move as they should.

    A fused joint moves little too: against the others the factor itself must be there.
    """
    others = [abs(o.ratio) for o in own if o.place == one.place and o.joint != one.joint]
    unit = None if is_plausible(one.beyond) else unit_like(abs(one.ratio), one.place[2])
    if unit is None or not others or unit.table != "motion" or abs(log(unit.factor)) <= log(50.0):
        return None
    off = abs(log(abs(one.ratio) / typical(others))) - abs(log(unit.factor))
    return unit if abs(off) < log(ALONE) else None


def _shared(together: float, sizes: Sequence[float]) -> MistakeHypothesis | None:
    """The unit of rotations that all tests of a specimen have wrong; None where some have not."""
    unit = None if is_plausible(together) else unit_like(together, ROTATIONS[0])
    worse = unit and any(abs(log(size * unit.factor)) > abs(log(size)) for size in sizes)
    return None if worse else unit


def _signs(cohort: Cohort, told: Sequence[_Response]) -> Iterator[PlausibilityWarning]:
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
    for (test, coordinate, named), names in found.items():
        column = MOTION_COLUMNS[coordinate]
        where = {"specimen": names[0], "test": test, **({"joint": named[0]} if named else {})}
        yield warn(
            cohort,
            "joints_against_load" if named else "test_against_load",
            TableCell("motion", first_row(cohort, "motion", filled=column, **where), column),
            whose=names,
            test=test,
            column=column,
            joints=", ".join(named),
            of_joints=named,
            load=f"{LOAD_COLUMNS[coordinate]} in {file_of(cohort, 'loads')}",
        )


def _noise(cohort: Cohort) -> Array:
    """(6,) mm and deg, SD of one reading."""
    sd = cohort.reading_sd()
    return np.full(len(COORDINATES), USUAL_SD) if sd is None else sd


def _is_against(cohort: Cohort, one: _Response) -> bool:
    """Whether a joint moves against its load, clear of the noise, as far as joints move."""
    noise = to_si(_noise(cohort))[COORDINATES.index(one.answer.coordinate)]
    far = abs(one.ratio) >= usual("motion_over_expected").low
    return far and one.answer.correlation < AGAINST and one.answer.rms > CLEAR * noise


def _against_names(cohort: Cohort) -> Iterator[tuple[tuple[str, str], str]]:
    """Specimens and tests that turn all joints to the other side than the test's name says."""
    if cohort.motion is None:
        return
    for (specimen, test), rows in cohort.motion.groupby(["specimen", "test"], sort=False):
        words = set(re.split(r"[^a-z]+", str(test).lower()))
        for way, column, sign in WAYS:
            read = rows[column].dropna()
            turned = read[read != 0.0] * sign
            says = way <= words and not words & {OTHER_SIDE[word] for word in way}
            if says and len(turned) and (turned < 0.0).all():
                yield (str(specimen), str(test)), column
