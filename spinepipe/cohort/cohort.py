"""A validated cohort of specimens, what stands in its header, and the digests of its parts."""

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, wraps
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar, TypeVarTuple
from weakref import WeakKeyDictionary

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from pydantic import AliasChoices, BaseModel, BeforeValidator, ConfigDict, Field, StringConstraints

from spinepipe.documents.names import EVERYONE, LONGEST_NAME
from spinepipe.units import COORDINATE_COLUMNS

Array = NDArray[np.float64]

Group = Literal["lengths", "postures", "masses", "loads", "motion", "zeroing", "errors", "persons"]
"""What can be meant though it looks wrong: ``acknowledged_warnings`` in cohort.yaml."""

FORM = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)

VertebraName = Annotated[str, StringConstraints(pattern=r"^[A-Za-z][A-Za-z0-9]*$", max_length=20)]


def _all_or_some(value: object) -> object:
    if isinstance(value, bool) or (
        isinstance(value, list | tuple) and all(isinstance(name, str) for name in value)
    ):
        return value
    raise ValueError("true, false, or a list of tests")


Zeroed = Annotated[
    bool | Annotated[tuple[str, ...], Field(strict=False)], BeforeValidator(_all_or_some)
]
"""Of all tests or of none, or the names of those of which it is true."""


class MeasurementSd(BaseModel):
    """One standard deviation of one reading before zeroing, per component."""

    model_config = FORM

    rotation_deg: float = Field(gt=0, le=45, description="SD of a measured angle, deg")
    translation_mm: float = Field(gt=0, le=50, description="SD of a measured translation, mm")
    force_n: float | None = Field(
        default=None,
        gt=0,
        le=20000,
        description="SD of a rig's measured force, N; for supports.csv alone",
    )
    moment_nm: float | None = Field(
        default=None,
        gt=0,
        le=500,
        description="SD of a rig's measured moment, N m; for supports.csv alone",
    )


_Deg = Annotated[float | None, Field(gt=0, le=45)]
_Mm = Annotated[float | None, Field(gt=0, le=50)]


class Accuracy(BaseModel):
    """What the instrument may be off by as an SD, though repeats agree, per component."""

    model_config = FORM

    rotation_deg: _Deg = Field(default=None, description="of angles, deg")
    translation_mm: _Mm = Field(default=None, description="of translations, mm")
    force_n: float | None = Field(
        default=None, gt=0, le=20000, description="of a rig's force, N; for supports.csv alone"
    )
    moment_nm: float | None = Field(
        default=None, gt=0, le=500, description="of a rig's moment, N m; for supports.csv alone"
    )
    extension_deg: _Deg = Field(default=None, description="of this one, before `rotation_deg`")
    right_bending_deg: _Deg = Field(default=None, description="likewise")
    left_rotation_deg: _Deg = Field(default=None, description="likewise")
    anterior_mm: _Mm = Field(default=None, description="of this one, before `translation_mm`")
    superior_mm: _Mm = Field(default=None, description="likewise")
    right_mm: _Mm = Field(default=None, description="likewise")

    def each(self) -> "Array":
        """(6,) mm and deg, NaN where it is not told."""
        told = self.model_dump(exclude_none=True)
        kinds = ["translation_mm"] * 3 + ["rotation_deg"] * 3
        named = zip(COORDINATE_COLUMNS, kinds, strict=True)
        return np.array([told.get(own, told.get(kind, np.nan)) for own, kind in named])


def sd_of_reading(sd: MeasurementSd | None, accuracy: Accuracy | None) -> "Array":
    """(6,) mm and deg: of each coordinate the larger, NaN where neither tells it."""
    most = np.full(6, np.nan) if accuracy is None else accuracy.each()
    return most if sd is None else np.fmax([sd.translation_mm] * 3 + [sd.rotation_deg] * 3, most)


class CohortHeader(BaseModel):
    """The keys of ``cohort.yaml``."""

    model_config = FORM

    cohort: str = Field(
        pattern=r"^[a-z0-9_]+$",
        max_length=LONGEST_NAME,
        description="the folder's name, of a-z, 0-9 and _ alone",
    )
    title: str = Field(
        min_length=1, max_length=300, description="one line that says what the cohort is"
    )
    source: str = Field(
        min_length=1, description="citation, how the numbers were obtained, licence"
    )
    made_up: bool = Field(
        default=False,
        description="true: nobody was measured; what was put in comes out again, and findings say "
        "that it is no evidence",
    )
    rebuilt: bool = Field(
        default=False,
        description="true: nobody's own readings, but entered or rebuilt from numbers in print",
    )
    vertebrae: tuple[VertebraName, ...] = Field(
        strict=False,
        description="names from caudal to cranial, the first is fixed to ground",
    )
    gravity: bool = Field(description="true: 9.81 m/s2 along -y acts; false: no weight")
    zeroed_at_step_0: Zeroed = Field(
        default=False,
        description="true: the step-0 coordinates were subtracted in every cycle; a list: in those "
        "of the tests that it names",
    )
    measurement_sd: MeasurementSd | None = Field(
        default=None, description="standard deviations of one reading, may be left out"
    )
    accuracy: Accuracy | None = Field(
        default=None,
        description="accuracy of the instrument beside its repeatability, which `measurement_sd` "
        "is: of each coordinate the larger counts as the SD of a reading; a search for missing "
        "effects takes it for an error that all cycles of a test share, a usual one where it is "
        "left out",
    )
    acknowledged_warnings: Annotated[tuple[Group, ...], Field(strict=False)] = Field(
        default=(),
        validation_alias=AliasChoices("acknowledged_warnings", "i_mean_it"),  # as files had it
        description="what looks impossible and is meant: lengths, postures, masses, loads, motion, "
        "zeroing, errors, persons; such refusals of the plausibility checks become warnings",
    )


def joint_names(vertebrae: tuple[str, ...]) -> tuple[str, ...]:
    """Joints of vertebrae listed caudal to cranial: (L4, L3, L2) has L3L4 and L2L3."""
    return tuple(upper + lower for lower, upper in pairwise(vertebrae))


@dataclass(frozen=True, eq=False)
class Cohort:
    """Everything measured on one group of specimens, validated, in the units of the files.

    Tables have all columns of the format in its order, rows in the order of the file, float64
    numbers (NaN: not measured) and int64 ``step``; a table whose file is absent is None.

    Attributes
    ----------
    name, title, source : as in ``cohort.yaml``.
    folder : where it was read.
    vertebrae : caudal to cranial; the first is fixed to ground.
    gravity : whether 9.81 m/s2 acts along -y.
    zeroed_at_step_0 : whether step-0 coordinates were subtracted in every cycle; where the files
        say so of some tests alone, of the others as they were read.
    measurement_sd, accuracy : of one reading, if known; see `reading_sd`.
    specimens : one row each; undeclared columns follow as text, as written.
    landmarks, joints, bodies : geometry and masses in ground, neutral pose.
    loads : ``specimen`` may be ``*`` (all); ``cycle`` is float64, NaN stands for every cycle.
    motion : ``cycle`` is int64, 1 where the file says nothing.
    supports : joint coordinates that rigs fix; names may be ``*``.
    preload : loads that act before step 0 and all along; specimen and test may be ``*``.
    made_up : whether nobody was measured.
    rebuilt : whether it was entered or rebuilt from numbers in print.
    further : tables that a kind of study reads besides, by the stem of their file; rows keep the
        number of their line in it.
    acknowledged_warnings : groups of what looks impossible and is meant.
    digest : sha256 over the names and bytes of the files that were read.
    """

    name: str
    title: str
    source: str
    folder: Path
    vertebrae: tuple[str, ...]
    gravity: bool
    zeroed_at_step_0: bool
    measurement_sd: MeasurementSd | None
    specimens: pd.DataFrame
    landmarks: pd.DataFrame | None
    joints: pd.DataFrame | None
    bodies: pd.DataFrame | None
    loads: pd.DataFrame | None
    motion: pd.DataFrame | None
    digest: str
    further: Mapping[str, pd.DataFrame] = field(default_factory=dict)
    supports: pd.DataFrame | None = None
    preload: pd.DataFrame | None = None
    made_up: bool = False
    rebuilt: bool = False
    acknowledged_warnings: tuple[Group, ...] = ()
    accuracy: Accuracy | None = None

    def reading_sd(self, stated: MeasurementSd | None = None) -> Array | None:
        """(6,) mm and deg, of one reading: ``measurement_sd`` or ``accuracy``, which is larger.

        None where neither tells all coordinates. A study may state another ``measurement_sd``.
        """
        most = sd_of_reading(stated or self.measurement_sd, self.accuracy)
        return most if np.isfinite(most).all() else None

    @property
    def accuracy_sd(self) -> Array:
        """(6,) mm and deg, NaN where it is not told."""
        return sd_of_reading(None, self.accuracy)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Joints, caudal to cranial."""
        return joint_names(self.vertebrae)

    @property
    def specimen_names(self) -> tuple[str, ...]:
        """Specimens in the order of ``specimens.csv``."""
        return tuple(self.specimens["specimen"])

    @property
    def tests(self) -> tuple[str, ...]:
        """Tests in the order in which ``loads.csv`` first names them."""
        return () if self.loads is None else tuple(self.loads["test"].unique())

    @property
    def data(self) -> Any:
        """Motion and loads as `xarray.Dataset`, see `spinepipe.api.arrays.of_cohort`."""
        # by name: what a job computes does not hang on it
        return import_module("spinepipe.api.arrays").of_cohort(self)

    @property
    def has_frames(self) -> bool:
        """Whether it tells where joints are in space: by themselves, or by landmarks."""
        return self.landmarks is not None or self.joints is not None

    def digest_of(self, specimens: Sequence[str]) -> str:
        """sha256 over what a job reads that looks at these specimens alone.

        That is what the header says of the measurement, the names of the tests, and the
        specimens' own rows of every table. Title and source are not part of it.
        """
        return self._parts.of(specimens)

    @cached_property
    def _parts(self) -> "_PartDigests":
        sd = self.measurement_sd
        shared = {
            "cohort": self.name,
            "vertebrae": self.vertebrae,
            "gravity": self.gravity,
            "zeroed_at_step_0": self.zeroed_at_step_0,
            "measurement_sd": None if sd is None else sd.model_dump(mode="json", exclude_none=True),
            "tests": self.tests,
        }
        if self.accuracy is not None:
            shared["accuracy"] = self.accuracy.model_dump(mode="json", exclude_none=True)
        rigs = ("supports", "preload")
        names = ("specimens", "landmarks", "joints", "bodies", "loads", "motion", *rigs)
        tables = {name: getattr(self, name) for name in names}
        return _PartDigests(shared, {**tables, **self.further})


Arguments = TypeVarTuple("Arguments")
Answer = TypeVar("Answer")


def memoize_per_cohort(
    function: Callable[[Cohort, *Arguments], Answer],
) -> Callable[[Cohort, *Arguments], Answer]:
    """Keep answers by cohort object and arguments.

    A cache with a number of entries would keep that many cohorts, tables and all, in a worker that
    serves one study after the other. An answer must not hold the cohort.
    """
    kept: WeakKeyDictionary[Cohort, dict[tuple[*Arguments], Answer]] = WeakKeyDictionary()

    @wraps(function)
    def answer(cohort: Cohort, *arguments: *Arguments) -> Answer:
        known = kept.setdefault(cohort, {})
        if arguments not in known:
            known[arguments] = function(cohort, *arguments)
        return known[arguments]

    return answer


class _PartDigests:
    """Digest of each specimen's rows in the tables of a cohort, taken when first arguments for."""

    def __init__(self, shared: Any, tables: Mapping[str, pd.DataFrame | None]) -> None:
        """``shared`` : what counts for every specimen, plain values."""
        self._shared = json.dumps(shared, sort_keys=True)
        self._tables = {name: table for name, table in tables.items() if table is not None}

    def of(self, specimens: Sequence[str]) -> str:
        """sha256 over what all specimens share and the rows of these."""
        digest = hashlib.sha256(self._shared.encode())
        for specimen in specimens:
            digest.update(f"\n{specimen}".encode())
            for name in self._tables:
                digest.update(f"\n{name}".encode())
                for group in (specimen, EVERYONE):
                    digest.update(self._rows[name].get(group, b""))
        return digest.hexdigest()

    @cached_property
    def _rows(self) -> dict[str, dict[str, bytes]]:
        """Digest of the rows of each specimen in each table, in the order of the file."""
        return {name: _by_specimen(table) for name, table in self._tables.items()}


def _by_specimen(table: pd.DataFrame) -> dict[str, bytes]:
    """A table that names no specimen is everyone's."""
    columns = json.dumps(list(map(str, table.columns))).encode()
    if "specimen" not in table:
        return {EVERYONE: hashlib.sha256(columns + table.to_csv(index=False).encode()).digest()}
    return {
        str(specimen): hashlib.sha256(columns + rows.to_csv(index=False).encode()).digest()
        for specimen, rows in table.groupby("specimen", sort=False)
    }
