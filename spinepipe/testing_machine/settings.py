"""The small YAML that says what the columns of a testing machine's files are."""

from collections import Counter
from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, StringConstraints

from spinepipe.cohort.cohort import Accuracy, Group, VertebraName, joint_names
from spinepipe.documents.names import ALLOWED, ALLOWED_FOLDER, folder_fault, name_fault
from spinepipe.documents.yaml_text import YamlDocument
from spinepipe.problems import InputProblem, did_you_mean, one_of
from spinepipe.testing_machine.channels import (
    ANGLES,
    DIRECTIONS,
    FORCES,
    MOMENTS,
    LoadUnit,
    MotionUnit,
    TimeUnit,
    Towards,
)

FORM = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)

_Text = Annotated[str, StringConstraints(min_length=1)]
_Column = _Text | Annotated[int, Field(ge=1)]
_Millimetres = Annotated[float, Field(ge=-10_000, le=10_000)]
_Size = Annotated[float, Field(gt=0, le=20_000)]


class FileForm(BaseModel):
    """How the machine writes its files."""

    model_config = FORM

    delimiter: Literal["comma", "semicolon", "tab", "space"] = Field(
        default="comma", description="what separates cells; space: any number of them"
    )
    decimal: Literal["point", "comma"] = Field(
        default="point", description="what separates whole numbers from decimals"
    )
    names_line: int = Field(
        default=1,
        ge=0,
        le=10_000,
        description="line that holds the names of the columns, the first line is 1; 0: none does, "
        "and columns are told by their number from 1",
    )
    first_line: int | None = Field(
        default=None,
        ge=1,
        le=100_000,
        description="line of the first numbers, where units or remarks stand before; null: the "
        "one after the names",
    )
    encoding: Literal["utf-8", "latin-1", "utf-16"] = Field(
        default="utf-8", description="how letters are written"
    )


class TimeChannel(BaseModel):
    """The column of time."""

    model_config = FORM

    column: _Column = Field(description="name or number of the column")
    unit: TimeUnit = Field(description="unit of its numbers")


class LoadChannel(BaseModel):
    """A column with a force or moment on the loaded vertebra, along an axis fixed in ground."""

    model_config = FORM

    column: _Column = Field(description="name or number of the column")
    unit: LoadUnit = Field(description="unit of its numbers")
    positive: Towards = Field(description="where a positive number pushes or turns")


class MotionChannel(BaseModel):
    """A column with the motion of a joint, the upper vertebra relative to the lower one."""

    model_config = FORM

    column: _Column = Field(description="name or number of the column")
    unit: MotionUnit = Field(description="unit of its numbers")
    joint: _Text = Field(description="which joint moves")
    positive: Towards = Field(description="where a positive number moves the upper vertebra")


class TestFile(BaseModel):
    """One file: one test of one specimen, with one or more cycles."""

    __test__ = False  # not for pytest
    model_config = FORM

    file: _Text = Field(description="its path, relative to this YAML")
    specimen: _Text = Field(description="whose test it is")
    test: _Text = Field(description="name of the load case")
    driving: _Column | None = Field(
        default=None,
        description="column of the load that goes up and down; may be left out where there is "
        "only one",
    )
    preconditioning_cycles: int = Field(
        default=0, ge=0, le=1000, description="cycles at the beginning that are left out"
    )


class LoadSteps(BaseModel):
    """Load steps to which every cycle is thinned."""

    model_config = FORM

    per_side: int = Field(
        default=5,
        ge=1,
        le=200,
        description="equal steps from the reference to the largest load that every cycle reaches, "
        "on each side",
    )
    levels: tuple[_Size, ...] | None = Field(
        default=None,
        strict=False,
        description="sizes of the driving load instead, N or N m, without zero",
    )
    reference: float | None = Field(
        default=None,
        ge=0,
        le=20_000,
        description="size of the driving load at which cycles begin and end, N or N m; null: "
        "zero, or the end of its range at which it starts if it never comes near zero",
    )
    smallest_reversal: float = Field(
        default=0.2,
        gt=0,
        lt=1,
        description="share of the range of the driving load by which it must turn back for a "
        "reversal to count",
    )


class MachineMapping(BaseModel):
    """The keys of the YAML that `spinepipe import` reads."""

    model_config = FORM

    kind: Literal["testing_machine"] = Field(
        default="testing_machine", description="what the files are"
    )
    cohort: str = Field(
        pattern=r"^[a-z0-9_]+$", description="name of the cohort folder that is made"
    )
    title: _Text = Field(description="one line that says what the cohort is")
    source: _Text = Field(description="who tested what, when, how; licence")
    vertebrae: tuple[VertebraName, ...] = Field(
        strict=False,
        description="names from caudal to cranial, the first is fixed to ground",
    )
    loaded: str | None = Field(
        default=None, description="vertebra on which the load acts; null: the most cranial"
    )
    load_point_mm: tuple[_Millimetres, ...] | None = Field(
        default=None,
        strict=False,
        min_length=3,
        max_length=3,
        description="where forces act on it: anterior, superior, to the right in ground, neutral "
        "pose; needed with forces",
    )
    zeroed: bool = Field(
        default=True,
        description="true: the reading of step 0 is subtracted in every cycle, as machines count "
        "from anywhere; false: readings stay, their zero is the neutral pose",
    )
    accuracy: Accuracy | None = Field(
        default=None, description="of the instruments, as in cohort.yaml, which gets it too"
    )
    acknowledged_warnings: tuple[Group, ...] = Field(
        default=(),
        strict=False,
        description="what looks wrong and is meant, as in cohort.yaml, which gets it too; else "
        "nothing is written",
    )
    form: FileForm = Field(default_factory=FileForm, description="how the machine writes its files")
    time: TimeChannel | None = Field(default=None, description="the column of time")
    loads: tuple[LoadChannel, ...] = Field(strict=False, description="columns of loads")
    motion: tuple[MotionChannel, ...] = Field(strict=False, description="columns of motion")
    steps: LoadSteps = Field(default_factory=LoadSteps, description="load steps that are kept")
    files: tuple[TestFile, ...] = Field(strict=False, description="the files")

    @property
    def loaded_vertebra(self) -> str:
        """Vertebra on which the load acts."""
        return self.loaded or self.vertebrae[-1]

    def driving(self, of: TestFile) -> LoadChannel:
        """The load that goes up and down in a file."""
        if of.driving is None:
            return self.loads[0]
        return next(channel for channel in self.loads if channel.column == of.driving)


def check_mapping(document: YamlDocument, mapping: MachineMapping) -> Iterator[InputProblem]:
    """What is wrong with the keys taken together, each problem at its line."""
    yield from _fewest(document, mapping)
    yield from _names(document, mapping)
    yield from _directions(document, mapping)
    yield from _columns(document, mapping)
    yield from _driving(document, mapping)
    form = mapping.form
    if form.first_line is not None and form.first_line <= form.names_line:
        allowed = f"a line below the names, which are in line {form.names_line}"
        yield _at(document, "form.first_line", str(form.first_line), allowed, "correct one of them")


def _at(document: YamlDocument, key: str, found: str, allowed: str, remedy: str) -> InputProblem:
    return InputProblem(document.file, document.line_of(key), key, found, allowed, remedy)


def _fewest(document: YamlDocument, mapping: MachineMapping) -> Iterator[InputProblem]:
    """Lists that must not be empty (a rule of pydantic would speak up for their bad items too)."""
    fewest = {"vertebrae": 2, "loads": 1, "motion": 1, "files": 1}
    for key, least in fewest.items():
        there = len(getattr(mapping, key))
        if there < least:
            yield _at(document, key, f"{there} of them", f"at least {least}", "add what is missing")
    if mapping.steps.levels is not None and not mapping.steps.levels:
        remedy = "name levels, or delete the key"
        yield _at(document, "steps.levels", "an empty list", "at least 1", remedy)


def _names(document: YamlDocument, mapping: MachineMapping) -> Iterator[InputProblem]:
    moving = mapping.vertebrae[1:]
    if mapping.loaded is not None and mapping.loaded not in moving:
        remedy = did_you_mean(mapping.loaded, moving, "load a vertebra that moves")
        yield _at(document, "loaded", f"'{mapping.loaded}'", one_of(moving), remedy)
    joints = joint_names(mapping.vertebrae)
    for number, channel in enumerate(mapping.motion):
        if channel.joint not in joints:
            remedy = did_you_mean(channel.joint, joints, "correct the joint or vertebrae")
            key = f"motion.{number}.joint"
            yield _at(document, key, f"'{channel.joint}'", one_of(joints), remedy)
    for number, of in enumerate(mapping.files):
        if (fault := folder_fault(of.specimen)) is not None:
            key = f"files.{number}.specimen"
            yield _at(document, key, fault, ALLOWED_FOLDER, "rename the specimen")
        if (fault := name_fault(of.test)) is not None:
            yield _at(document, f"files.{number}.test", fault, ALLOWED, "rename the test")
    forces = any(channel.unit in FORCES for channel in mapping.loads)
    if forces and mapping.load_point_mm is None:
        allowed = "a point, as there are forces and no masses that would tell one"
        yield _at(document, "load_point_mm", "nothing", allowed, "add `load_point_mm: [x, y, z]`")


def _directions(document: YamlDocument, mapping: MachineMapping) -> Iterator[InputProblem]:
    """A unit tells whether something turns or shifts; the direction must do so too."""
    sides: tuple[tuple[str, tuple[LoadChannel | MotionChannel, ...]], ...] = (
        ("loads", mapping.loads),
        ("motion", mapping.motion),
    )
    for side, channels in sides:
        for number, channel in enumerate(channels):
            turns = channel.unit in MOMENTS or channel.unit in ANGLES
            fit = tuple(word for word, one in DIRECTIONS.items() if one.turns == turns)
            if channel.positive not in fit:
                key = f"{side}.{number}.positive"
                found = f"'{channel.positive}' in {channel.unit}"
                yield _at(document, key, found, one_of(fit), "correct the direction or the unit")


def _columns(document: YamlDocument, mapping: MachineMapping) -> Iterator[InputProblem]:
    """Each column once, each quantity once; numbers only where there are no names."""
    named: list[tuple[str, _Text | int]] = []
    if mapping.time is not None:
        named.append(("time.column", mapping.time.column))
    named += [(f"loads.{n}.column", one.column) for n, one in enumerate(mapping.loads)]
    named += [(f"motion.{n}.column", one.column) for n, one in enumerate(mapping.motion)]
    times = Counter(column for _, column in named)
    for key, column in named:
        if times[column] > 1:
            yield _at(document, key, f"column {column!r} twice", "each column once", "correct one")
        if mapping.form.names_line == 0 and isinstance(column, str):
            allowed = "a number from 1, as names_line is 0"
            yield _at(document, key, f"'{column}'", allowed, "tell the column's number")
    meant: list[tuple[str, tuple[str, ...]]] = [
        (f"loads.{n}.positive", (DIRECTIONS[one.positive].load,))
        for n, one in enumerate(mapping.loads)
    ]
    meant += [
        (f"motion.{n}.positive", (one.joint, DIRECTIONS[one.positive].coordinate))
        for n, one in enumerate(mapping.motion)
    ]
    again = Counter(quantity for _, quantity in meant)
    for key, quantity in meant:
        if again[quantity] > 1:
            found, allowed = f"{' '.join(quantity)} from two columns", "one column for each"
            yield _at(document, key, found, allowed, "delete one of them or correct its direction")


def _driving(document: YamlDocument, mapping: MachineMapping) -> Iterator[InputProblem]:
    columns = [channel.column for channel in mapping.loads]
    for number, of in enumerate(mapping.files):
        key = f"files.{number}.driving"
        if of.driving is None and len(columns) > 1:
            remedy = "add `driving:`, the load that goes up and down"
            yield _at(
                document, key, "nothing: the key is missing", one_of(map(str, columns)), remedy
            )
        elif of.driving is not None and of.driving not in columns:
            remedy = did_you_mean(str(of.driving), map(str, columns), "name a column of loads")
            yield _at(document, key, f"'{of.driving}'", one_of(map(str, columns)), remedy)
