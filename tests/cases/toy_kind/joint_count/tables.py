"""Tables of joint counts; what their columns are stands in tables.csv."""

from spinepipe.schema import declared

JOINTS = declared(__file__, "joints")
TOTALS = declared(__file__, "totals")
SHARES = declared(__file__, "shares")
