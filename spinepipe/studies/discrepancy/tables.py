"""Tables of studies of kind discrepancy; what their columns are stands in tables.csv."""

from spinepipe.schema import declared

GAP = declared(__file__, "gap")
CANDIDATES = declared(__file__, "candidates")
WHERE = declared(__file__, "where")
CONFUSIONS = declared(__file__, "confusions")
HELD_OUT = declared(__file__, "held_out")
IMPERFECTIONS = declared(__file__, "imperfections")
NEXT_TESTS = declared(__file__, "next_tests")
FIELD_NUMBERS = declared(__file__, "field_numbers")
TABULATED = declared(__file__, "tabulated")

MODELS = WHERE.column("model").allowed
"""The two models that are compared; without a named effect they are the same."""

ADVICE = NEXT_TESTS.column("status").allowed
"""What becomes of a run that could be added; the last two are of versions before."""

UNNAMED = "what no effect explains"
"""How the subject of advice begins that is on what has no name."""
