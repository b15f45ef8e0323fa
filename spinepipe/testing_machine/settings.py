"""The small YAML that says what the columns of a testing machine's files are."""

from typing import Annotated, Literal

from pydantic import BaseModel, Field

from spinepipe.cohort.cohort import FORM, Accuracy, Group
from spinepipe.imports.imported import ImportSettings, LineText
from spinepipe.testing_machine.channels import (
    LoadUnit,
    MotionUnit,
    TimeUnit,
    Towards,
)
from spinepipe.testing_machine.instruments import (
    LoadCell,
    MarkerClusters,
    Point,
    Rotations,
)

_Column = LineText | Annotated[int, Field(ge=1)]
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
    thousands: Literal["point", "comma", "space", "apostrophe"] | None = Field(
        default=None,
        description="what stands between thousands; null: nothing",
    )
    sheet: _Column | None = Field(
        default=None,
        description="name or number of the sheet of a workbook; may be left out where it has one",
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
    empty_cells: Literal["refused", "left_out"] = Field(
        default="refused",
        description="left_out: rows in which a motion has an empty cell, NaN or #N/A are left out, "
        "as where a camera loses a marker; how many is said",
    )


class TimeChannel(BaseModel):
    """The column of time."""

    model_config = FORM

    column: _Column = Field(description="name or number of the column")
    unit: TimeUnit = Field(
        description="unit of its numbers; clock: times such as 12:34:56.7, with a date or without"
    )


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
    joint: LineText = Field(description="which joint moves")
    positive: Towards = Field(description="where a positive number moves the upper vertebra")


class Sync(BaseModel):
    """A signal that both files have, as of a trigger."""

    model_config = FORM

    load: _Column = Field(description="its column in the file with the loads")
    motion: _Column = Field(description="its column in the file with the motion")


class MotionFiles(BaseModel):
    """Files of a camera beside those with the loads: `motion_file` of `files` names them."""

    model_config = FORM

    form: FileForm = Field(default_factory=FileForm, description="how it writes its files")
    time: TimeChannel | None = Field(default=None, description="its column of time")
    rate_hz: float | None = Field(
        default=None,
        gt=0,
        le=100_000,
        description="or frames a second, each in a row; blank lines are none",
    )
    sync: Sync | None = Field(
        default=None,
        description="signal in both files by which clocks are compared; null: `shift_s`, else the "
        "rates of load and motion",
    )
    markers: MarkerClusters | None = Field(
        default=None, description="markers whose motion is wanted, in the place of `motion`"
    )


class TestFile(BaseModel):
    """One file: one test of one specimen, with one or more cycles."""

    __test__ = False  # not for pytest
    model_config = FORM

    file: LineText = Field(description="its path, relative to this YAML")
    glob: LineText | None = Field(
        default=None,
        description="instead of `file`: a pattern of paths with *, ? and **/; {specimen} and "
        "{test} in it tell these",
    )
    specimen: LineText = Field(description="whose test it is")
    test: LineText = Field(description="name of the load case")
    driving: _Column | None = Field(
        default=None,
        description="column of the load that goes up and down; may be left out where there is "
        "only one",
    )
    preconditioning_cycles: int = Field(
        default=0, ge=0, le=1000, description="cycles at the beginning that are left out"
    )
    form: FileForm | None = Field(default=None, description="of this file, instead of the common")
    time: TimeChannel | None = Field(default=None, description="instead of the common one")
    loads: tuple[LoadChannel, ...] | None = Field(
        default=None, strict=False, description="of this file, instead of all common ones"
    )
    motion: tuple[MotionChannel, ...] | None = Field(
        default=None, strict=False, description="of this file, instead of all common ones"
    )
    motion_file: LineText | None = Field(
        default=None,
        description="file of its motion, if another; {stem} is the name of `file` without its end",
    )
    shift_s: float | None = Field(
        default=None,
        ge=-100_000,
        le=100_000,
        description="seconds from the first row of the motion's file to that of this one; null: "
        "found from the rows",
    )
    load_point_mm: Point | None = Field(
        default=None, description="where forces act in this file, if elsewhere"
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
        min_length=1,
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


OF_A_FILE = ("form", "time", "loads", "motion", "load_point_mm")
"""Keys that a file may have of its own."""


class MachineMapping(ImportSettings):
    """The keys of the YAML that `spinepipe import` reads."""

    kind: Literal["testing_machine"] = Field(
        default="testing_machine", description="what the files are"
    )
    loaded: str | None = Field(
        default=None, description="vertebra on which the load acts; null: the most cranial"
    )
    load_point_mm: Point | None = Field(
        default=None,
        description="where forces act on it: anterior, superior, to the right in ground, neutral "
        "pose; needed with forces",
    )
    load_cell: LoadCell | None = Field(default=None, description="what reads the loads")
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
    loads: tuple[LoadChannel, ...] = Field(
        default=(), strict=False, description="columns of loads; files may have their own"
    )
    motion: tuple[MotionChannel, ...] = Field(
        default=(),
        strict=False,
        description="columns of motion; files may have their own, and with markers there are none",
    )
    motion_files: MotionFiles | None = Field(
        default=None, description="files with the motion alone, on a clock of their own"
    )
    rotations: Rotations | None = Field(
        default=None,
        description="order of three rotations; null: z, x', y'' (extension, right "
        "bending, left rotation, each about axes that those before have turned)",
    )
    steps: LoadSteps = Field(default_factory=LoadSteps, description="load steps that are kept")
    files: tuple[TestFile, ...] = Field(strict=False, min_length=1, description="the files")

    @property
    def loaded_vertebra(self) -> str:
        """Vertebra on which the load acts."""
        return self.loaded or self.vertebrae[-1]

    def of_file(self, of: TestFile) -> "MachineMapping":
        """The mapping with what a file says of itself in place of what is common."""
        own = {key: getattr(of, key) for key in OF_A_FILE}
        return self.model_copy(update={key: one for key, one in own.items() if one is not None})

    def driving(self, of: TestFile) -> LoadChannel:
        """The load that goes up and down in a file."""
        if of.driving is None:
            return self.loads[0]
        return next(channel for channel in self.loads if channel.column == of.driving)
