"""The columns of every CSV file of a cohort folder: one declaration for reader, checks and docs."""

from dataclasses import dataclass
from math import inf
from typing import Literal

__all__ = ["COHORT_YAML", "TABLES", "Column", "TableForm"]

COHORT_YAML = "cohort.yaml"

Kind = Literal["text", "number", "integer"]

LARGEST_ANGLE_DEG = 90.0
LARGEST_COUNT = 1_000_000
LARGEST_COORDINATE_MM = 10_000.0
LARGEST_FORCE_N = 20_000.0
LARGEST_FOLLOWER_N = 2000.0
LARGEST_MOMENT_NM = 500.0
LARGEST_TRANSLATION_MM = 200.0


@dataclass(frozen=True)
class Column:
    """One declared column.

    Attributes
    ----------
    name : header text, unit and positive direction included.
    meaning : what a cell says.
    kind : text, number (decimal point) or integer.
    required : the column must be there and no cell of it may be empty.
    low, high : range of a number.
    open_low, open_high : whether the limit itself is outside the range.
    names : whether texts are names, though they are no key: of groups, say.
    """

    name: str
    meaning: str
    kind: Kind = "number"
    required: bool = False
    low: float = -inf
    high: float = inf
    open_low: bool = False
    open_high: bool = False
    names: bool = False

    @property
    def range_text(self) -> str:
        """The range in words."""
        parts = []
        if self.low > -inf:
            parts.append(f"{'above' if self.open_low else 'at least'} {self.low:g}")
        if self.high < inf:
            parts.append(f"{'below' if self.open_high else 'at most'} {self.high:g}")
        return " and ".join(parts)


@dataclass(frozen=True)
class TableForm:
    """One CSV file of the cohort folder.

    Attributes
    ----------
    stem : file name without ``.csv``.
    row : what one row stands for.
    columns : declared columns in output order.
    keys : columns that together may occur only once.
    carries : whether undeclared columns are allowed and carried through as text.
    places : whether it tells where vertebrae are, so that neither landmarks nor joints are needed.
    """

    stem: str
    row: str
    columns: tuple[Column, ...]
    keys: tuple[str, ...]
    carries: bool = False
    places: bool = False

    @property
    def file(self) -> str:
        """File name."""
        return f"{self.stem}.csv"

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the declared columns."""
        return tuple(column.name for column in self.columns)


def _key(name: str, meaning: str) -> Column:
    return Column(name, meaning, kind="text", required=True)


def _points(names: tuple[str, ...], of: str, *, required: bool) -> tuple[Column, ...]:
    limit = LARGEST_COORDINATE_MM
    axes = ("anterior", "superior", "to the right")
    return tuple(
        Column(
            name,
            f"{of}, {axis}, ground axes, neutral pose",
            required=required,
            low=-limit,
            high=limit,
        )
        for name, axis in zip(names, axes, strict=True)
    )


def _angles(of: str, *, required: bool) -> tuple[Column, ...]:
    axes = {
        "extension_deg": "extension (about +z)",
        "right_bending_deg": "right bending (about +x')",
        "left_rotation_deg": "left rotation (about +y'')",
    }
    limit = LARGEST_ANGLE_DEG
    return tuple(
        Column(name, f"{of}, {axis}", "number", required, -limit, limit, True, True)
        for name, axis in axes.items()
    )


def _loads(names: tuple[str, ...], what: str, limit: float) -> tuple[Column, ...]:
    return tuple(
        Column(name, f"{what} along ground {axis}", required=True, low=-limit, high=limit)
        for name, axis in zip(names, "xyz", strict=True)
    )


def _inertia(axes: str) -> Column:
    return Column(f"i{axes}_kg_m2", f"inertia {axes} about the centre of mass, ground axes")


_SPECIMEN = _key("specimen", "specimen")
_VERTEBRA = _key("vertebra", "vertebra, as listed in cohort.yaml")
_JOINT = _key("joint", "joint, upper vertebra then lower: L4L5 is L4 moving on L5")
_TEST = _key("test", "load case")
_STEP = Column("step", "load step, from 0, in the order applied", "integer", True, 0, LARGEST_COUNT)

SPECIMENS = TableForm(
    "specimens",
    "specimen",
    (
        _SPECIMEN,
        Column("sex", "sex", "text"),
        Column("age_years", "age", low=0, high=130),
        Column("height_m", "standing height", low=0.2, high=2.8),
        Column("mass_kg", "body mass", low=0, high=500, open_low=True),
        Column(
            "degeneration_grade",
            "grade of disc degeneration, 1 to 5 (Pfirrmann or Thompson), the mean over the tested "
            "discs where each was graded",
            low=1,
            high=5,
        ),
    ),
    keys=("specimen",),
    carries=True,
)

LANDMARKS = TableForm(
    "landmarks",
    "specimen x vertebra x landmark",
    (
        _SPECIMEN,
        _VERTEBRA,
        _key("landmark", "landmark"),
        *_points(("x_mm", "y_mm", "z_mm"), "point", required=True),
        Column("sd_mm", "standard deviation of the palpated point per axis", low=0, high=50),
    ),
    keys=("specimen", "vertebra", "landmark"),
)

JOINTS = TableForm(
    "joints",
    "specimen x joint",
    (
        _SPECIMEN,
        _JOINT,
        *_points(("x_mm", "y_mm", "z_mm"), "origin of the joint frame", required=True),
        *_angles("orientation of the joint frame in ground", required=True),
    ),
    keys=("specimen", "joint"),
)

BODIES = TableForm(
    "bodies",
    "specimen x vertebra",
    (
        _SPECIMEN,
        _VERTEBRA,
        Column("mass_kg", "mass", required=True, low=0, high=200, open_low=True),
        *_points(("com_x_mm", "com_y_mm", "com_z_mm"), "centre of mass", required=True),
        *(_inertia(axes) for axes in ("xx", "yy", "zz", "xy", "xz", "yz")),
    ),
    keys=("specimen", "vertebra"),
)

LOADS = TableForm(
    "loads",
    "specimen x test x cycle x step x loaded vertebra",
    (
        _key("specimen", "specimen, * stands for all"),
        _TEST,
        Column(
            "cycle",
            "repeat of the test, empty stands for all",
            "integer",
            low=1,
            high=LARGEST_COUNT,
        ),
        _STEP,
        _VERTEBRA,
        *_loads(("fx_n", "fy_n", "fz_n"), "force", LARGEST_FORCE_N),
        *_loads(("mx_nm", "my_nm", "mz_nm"), "moment", LARGEST_MOMENT_NM),
        *_points(("px_mm", "py_mm", "pz_mm"), "point where the force acts", required=False),
        Column("time_s", "time since the start of the test", low=0),
        Column(
            "follower_n",
            "tension of a cable through the joints' centres, a follower load; it acts in all steps "
            "of the test, step 0 too",
            low=0,
            high=LARGEST_FOLLOWER_N,
        ),
    ),
    keys=("specimen", "test", "cycle", "step", "vertebra"),
)

MOTION = TableForm(
    "motion",
    "specimen x test x cycle x step x joint",
    (
        _SPECIMEN,
        _TEST,
        Column(
            "cycle", "repeat of the test, empty stands for 1", "integer", low=1, high=LARGEST_COUNT
        ),
        _STEP,
        _JOINT,
        *_angles("measured rotation of the joint", required=False),
        *(
            Column(
                f"{axis}_mm",
                f"measured {axis} translation of the joint's origin (not of the load's point)",
                low=-LARGEST_TRANSLATION_MM,
                high=LARGEST_TRANSLATION_MM,
            )
            for axis in ("anterior", "superior", "right")
        ),
    ),
    keys=("specimen", "test", "cycle", "step", "joint"),
)

SUPPORTS = TableForm(
    "supports",
    "specimen x test x joint coordinate that a rig fixes; of rows that fit, the last counts",
    (
        _key("specimen", "specimen, * stands for all"),
        _key("test", "load case, * stands for all"),
        Column("joint", "joint as L4L5, * stands for all", "text"),
        Column("coordinate", "extension, right_bending, … or anterior, superior, right", "text"),
        Column("vertebra", "vertebra that is held by itself: not yet supported", "text"),
        Column("direction", "its direction in ground: not yet supported", "text"),
        _key(
            "state",
            "free; held: as in the neutral pose; prescribed: moved as motion.csv says",
        ),
        Column(
            "reaction",
            "measured: the rig's load on it was measured and stands in loads.csv; "
            "unknown or empty: not",
            "text",
        ),
    ),
    keys=("specimen", "test", "joint", "coordinate"),
)

PRELOAD = TableForm(
    "preload",
    "specimen x test x vertebra with a load that acts before step 0 and all along; all rows act",
    (
        _key("specimen", "specimen, * stands for all"),
        _key("test", "load case, * stands for all"),
        _VERTEBRA,
        *_loads(("fx_n", "fy_n", "fz_n"), "force", LARGEST_FORCE_N),
        *_loads(("mx_nm", "my_nm", "mz_nm"), "moment", LARGEST_MOMENT_NM),
        *_points(("px_mm", "py_mm", "pz_mm"), "point where the force acts", required=False),
    ),
    keys=("specimen", "test", "vertebra"),
)

TABLES = {
    form.stem: form
    for form in (SPECIMENS, LANDMARKS, JOINTS, BODIES, LOADS, MOTION, SUPPORTS, PRELOAD)
}
"""Every CSV file that is read, by stem; other files in the folder are ignored."""
