"""What is wrong with the settings of a testing machine's files taken together."""

from collections import Counter
from collections.abc import Iterator, Mapping

import numpy as np

from spinepipe.cohort.cohort import joint_names
from spinepipe.documents.names import ALLOWED, ALLOWED_FOLDER, folder_fault, name_fault
from spinepipe.documents.yaml_text import YamlDocument
from spinepipe.problems import InputProblem, did_you_mean, one_of
from spinepipe.testing_machine.channels import (
    ANGLES,
    DIRECTIONS,
    FORCES,
    LOAD_COLUMNS,
    MOMENTS,
    mistyped,
)
from spinepipe.testing_machine.settings import (
    OF_A_FILE,
    LoadChannel,
    MachineMapping,
    MotionChannel,
    TestFile,
)


def check_mapping(document: YamlDocument, mapping: MachineMapping) -> Iterator[InputProblem]:
    """What is wrong with the keys taken together, each problem at its line."""
    yield from _names(document, mapping)
    keys = {key: key for key in OF_A_FILE}
    common = not mapping.files
    for number, of in enumerate(mapping.files):
        told = {key: f"files.{number}.{key}" for key in OF_A_FILE if getattr(of, key) is not None}
        common |= not told
        if told:
            yield from _of_file(document, mapping.of_file(of), keys | told)
    if common:
        yield from _of_file(document, mapping, keys)
    yield from _driving(document, mapping)
    yield from _motion_files(document, mapping)


def _of_file(
    document: YamlDocument, mapping: MachineMapping, keys: Mapping[str, str]
) -> Iterator[InputProblem]:
    """What is wrong with form and columns of a file; `keys` tell where each of them stands."""
    beside = mapping.motion_files
    marked = beside is not None and beside.markers is not None
    for key in ("loads",) if marked else ("loads", "motion"):
        if not getattr(mapping, key):
            yield _at(document, keys[key], "0 of them", "at least 1", "add what is missing")
    joints = joint_names(mapping.vertebrae)
    for number, channel in enumerate(mapping.motion):
        if channel.joint not in joints:
            remedy = did_you_mean(channel.joint, joints, "correct the joint or vertebrae")
            key = f"{keys['motion']}.{number}.joint"
            yield _at(document, key, f"'{channel.joint}'", one_of(joints), remedy)
    forces = any(channel.unit in FORCES for channel in mapping.loads)
    if forces and mapping.load_point_mm is None:
        allowed = "a point, as there are forces and no masses that would tell one"
        yield _at(
            document, keys["load_point_mm"], "nothing", allowed, "add `load_point_mm: [x, y, z]`"
        )
    yield from _channels(document, mapping, keys)
    yield from _instruments(document, mapping)
    form = mapping.form
    if form.first_line is not None and form.first_line <= form.names_line:
        allowed = f"a line below the names, which are in line {form.names_line}"
        key = f"{keys['form']}.first_line"
        yield _at(document, key, str(form.first_line), allowed, "correct one of them")
    if form.thousands is not None and form.thousands in (form.decimal, form.delimiter):
        key, allowed = f"{keys['form']}.thousands", "another sign than between decimals and cells"
        yield _at(document, key, f"'{form.thousands}'", allowed, "correct one of them")


def _instruments(document: YamlDocument, mapping: MachineMapping) -> Iterator[InputProblem]:
    """Columns without which rotations and loads of a file cannot be converted."""
    rotations = Counter(
        one.joint for one in mapping.motion if mapping.rotations and DIRECTIONS[one.positive].turns
    )
    for joint, there in rotations.items():
        if there < 3:
            found = f"{there} of the three rotations of {joint}"
            allowed = "all three: fewer are no rotation that could be told in another order"
            remedy = "add them, or delete `rotations` if they are angles of z, x', y''"
            yield _at(document, "rotations", found, allowed, remedy)
    cell, loads = mapping.load_cell, {DIRECTIONS[one.positive].load for one in mapping.loads}
    if cell is not None and cell.point_mm is not None and len(loads) < len(LOAD_COLUMNS):
        found = f"no column for {', '.join(sorted(set(LOAD_COLUMNS) - loads))}"
        allowed = "three forces and three moments, as moved moments depend on all"
        yield _at(document, "load_cell.point_mm", found, allowed, "add them, or delete the key")
    if cell is not None and cell.tare_s is not None and mapping.time is None:
        remedy = "add `time:`, or delete the key"
        yield _at(document, "load_cell.tare_s", "no time", "`time`", remedy)


def _at(document: YamlDocument, key: str, found: str, allowed: str, remedy: str) -> InputProblem:
    return InputProblem(*document.place_of(key), found, allowed, remedy)


def _names(document: YamlDocument, mapping: MachineMapping) -> Iterator[InputProblem]:
    moving = mapping.vertebrae[1:]
    if mapping.loaded is not None and mapping.loaded not in moving:
        remedy = did_you_mean(mapping.loaded, moving, "load a vertebra that moves")
        yield _at(document, "loaded", f"'{mapping.loaded}'", one_of(moving), remedy)
    seen = list[TestFile]()
    for number, of in enumerate(mapping.files):
        if (fault := folder_fault(of.specimen)) is not None:
            key = f"files.{number}.specimen"
            yield _at(document, key, fault, ALLOWED_FOLDER, "rename the specimen")
        if (fault := name_fault(of.test)) is not None:
            yield _at(document, f"files.{number}.test", fault, ALLOWED, "rename the test")
        what = of.model_copy(update={"specimen": "", "test": "", "preconditioning_cycles": 0})
        if what in seen:
            found, allowed = f"{of.file} once more", "each file once, but for columns of its own"
            yield _at(document, f"files.{number}.file", found, allowed, "delete it, or correct it")
        seen.append(what)


def _motion_files(document: YamlDocument, mapping: MachineMapping) -> Iterator[InputProblem]:
    """What the keys about two files of one test lack."""
    beside = mapping.motion_files
    for number, of in enumerate(mapping.files):
        key = f"files.{number}"
        if (of.motion_file is None) != (beside is None):
            found = "nothing" if of.motion_file is None else "a file, and no `motion_files`"
            allowed = "`motion_files`, and such a file of each test, or neither"
            yield _at(document, f"{key}.motion_file", found, allowed, "add what is missing")
        if of.shift_s is not None and (beside is None or beside.sync is not None):
            allowed = "two files, and one way to compare their clocks"
            yield _at(document, f"{key}.shift_s", f"{of.shift_s:g}", allowed, "delete it or `sync`")
    if beside is None:
        return
    if mapping.time is None:
        yield _at(document, "time", "nothing", "the column of time of the loads", "add `time:`")
    if (beside.time is None) == (beside.rate_hz is None):
        found = "neither" if beside.time is None else "both"
        yield _at(document, "motion_files", found, "one of time and rate_hz", "correct it")
    if (marks := beside.markers) is not None:
        wrong = set(mapping.vertebrae[1:]) ^ set(marks.clusters) - {mapping.vertebrae[0]}
        if wrong:
            key, found = "motion_files.markers.clusters", ", ".join(sorted(wrong))
            allowed = f"each of {', '.join(mapping.vertebrae)} (the first may be left out)"
            yield _at(document, key, f"{found} wrong or missing", allowed, "correct the names")
        ways = [DIRECTIONS[way] for way in marks.axes]
        axes = [[way.sign * (way.load == f"f{axis}_n") for axis in "xyz"] for way in ways]
        if np.linalg.det(axes) < 0.5:
            found = f"{', '.join(marks.axes)}: an axis twice, or a left-handed frame"
            allowed = "a right-handed frame, such as anterior, superior, right"
            yield _at(document, "motion_files.markers.axes", found, allowed, "correct it")
        for key in ("motion", "rotations"):
            if getattr(mapping, key):
                allowed = "one of them: rotations are those of the markers"
                yield _at(document, key, "columns and markers", allowed, "delete it or the markers")


def _channels(
    document: YamlDocument, mapping: MachineMapping, keys: Mapping[str, str]
) -> Iterator[InputProblem]:
    """Directions that do not fit their unit, and quantities that two columns give."""
    channels: list[tuple[str, LoadChannel | MotionChannel, str]] = [
        (f"{keys['loads']}.{number}.positive", one, DIRECTIONS[one.positive].load)
        for number, one in enumerate(mapping.loads)
    ]
    channels += [
        (
            f"{keys['motion']}.{number}.positive",
            one,
            f"{one.joint} {DIRECTIONS[one.positive].motion}",
        )
        for number, one in enumerate(mapping.motion)
    ]
    again = Counter(quantity for *_, quantity in channels)
    for key, channel, quantity in channels:
        turns = channel.unit in MOMENTS or channel.unit in ANGLES
        fit = tuple(word for word, one in DIRECTIONS.items() if one.turns == turns)
        if channel.positive not in fit:
            found = f"'{channel.positive}' in {channel.unit}"
            yield _at(document, key, found, one_of(fit), "correct the direction or the unit")
        if again[quantity] > 1:
            found, allowed = f"{quantity} from two columns", "one column for each"
            yield _at(document, key, found, allowed, "delete one of them or correct its direction")


def _driving(document: YamlDocument, mapping: MachineMapping) -> Iterator[InputProblem]:
    for number, of in enumerate(mapping.files):
        columns = [channel.column for channel in mapping.of_file(of).loads]
        key = f"files.{number}.driving"
        if of.driving is None and len(columns) > 1:
            remedy = "add `driving:`, the load that goes up and down"
            yield _at(
                document, key, "nothing: the key is missing", one_of(map(str, columns)), remedy
            )
        elif of.driving is not None and of.driving not in columns:
            remedy = mistyped(str(of.driving), map(str, columns), "name a column of loads")
            yield _at(document, key, f"'{of.driving}'", one_of(map(str, columns)), remedy)
