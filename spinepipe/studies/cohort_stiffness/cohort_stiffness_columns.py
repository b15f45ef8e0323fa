"""Columns that tables of studies of kind cohort_stiffness share."""

from spinepipe.tables.schema import Column
from spinepipe.units import COORDINATES

REPRESENTATIONS = (
    *("literature", "literature_levels"),
    *("per_specimen", "level_ratio", "per_joint", "partially_pooled"),
)
"""How stiffness is described, from what is taken as published to what is free in each joint."""

SOURCES = ("literature", "own", "others_median", "others_pooled")
STAGES = ("literature", "fitted", "left_out_case", "left_out_specimen")
NO_POSE = "not measured, or no pose was found"

REPRESENTATION = Column(
    "representation",
    "text",
    "literature: one published value for all joints; literature_levels: published values level by "
    "level; per_specimen: one stiffness for all joints of a specimen; level_ratio: published ratio "
    "of levels times one factor; per_joint: each joint its own; partially_pooled: each joint its "
    "own, drawn towards its specimen and its cohort as far as the data ask for it",
    allowed=REPRESENTATIONS,
)
FITTED_TO = Column(
    "fitted_to",
    "text",
    "load cases it was fitted to: a test, all, all_but_<test>, or nothing (literature)",
)
SOURCE = Column(
    "source",
    "text",
    "whose motion it was fitted to: own, others_median (median of the other specimens' own fits), "
    "others_pooled (what the hierarchical fit of the others expects of a new specimen), literature",
    allowed=SOURCES,
)
STAGE = Column(
    "stage",
    "text",
    "literature: not fitted at all; fitted: to these readings; left_out_case: to other load cases "
    "of this specimen; left_out_specimen: to other specimens",
    allowed=STAGES,
)
TEST = Column("test", "text", "load case")
COORDINATE = Column("coordinate", "text", "coordinate of the joint", allowed=COORDINATES)
