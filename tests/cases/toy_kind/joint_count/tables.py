"""Tables of joint counts."""

from spinepipe.tables import Column, Table
from spinepipe.tables.schema import SPECIMEN

JOINTS = Table(
    "joints",
    "One row per specimen.",
    ("specimen",),
    (SPECIMEN, Column("joints", "integer", "number of joints", low=1)),
)

TOTALS = Table(
    "totals", "One row.", ("joints",), (Column("joints", "integer", "joints of all", low=1),)
)

SHARES = Table(
    "shares",
    "One row per specimen.",
    ("specimen",),
    (SPECIMEN, Column("share", "number", "of all joints", "1", low=0, high=1)),
)
