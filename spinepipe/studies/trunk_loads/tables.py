"""Tables of studies of kind trunk_loads; what their columns are stands in tables.csv."""

from spinepipe.schema import declared

TASKS = declared(__file__, "tasks")
LEVELS_TABLE = declared(__file__, "levels")
MUSCLES = declared(__file__, "muscles")
PATHS = declared(__file__, "paths")
ITERATIONS = declared(__file__, "iterations")
UPRIGHT = declared(__file__, "upright")
MASSES = declared(__file__, "masses")
REMARKS = declared(__file__, "remarks")
SCALING = declared(__file__, "scaling")
SIMPLIFIED = declared(__file__, "simplified")
PRESSURES = declared(__file__, "pressures")
TUNING = declared(__file__, "tuning")
AGREEMENT = declared(__file__, "agreement")
DESIGN = declared(__file__, "design")
RESPONSES = declared(__file__, "responses")
INTERVALS = declared(__file__, "intervals")
DRIVERS = declared(__file__, "drivers")
LIFT_LOADS = declared(__file__, "lift_loads")
LIFT_FRAMES = declared(__file__, "lift_frames")
LIFT_BANDS = declared(__file__, "lift_bands")
LIFT_PATHS = declared(__file__, "lift_paths")
PER_LIFT = (LIFT_LOADS, LIFT_FRAMES, LIFT_BANDS, LIFT_PATHS)
"""Of a person and recorded lift."""

AGAINST_GHEZELBASH_2016 = declared(__file__, "against_ghezelbash_2016")

SIMPLIFICATIONS = SIMPLIFIED.column("simplification").allowed
TIERS = PRESSURES.column("tier").allowed
QUANTITIES = INTERVALS.column("quantity").allowed

REGION = ("low", "high", "open_below", "open_above", "identifiable")
"""Columns of how far a fitted number may go."""
