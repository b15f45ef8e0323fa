"""Tables of studies of kind range_of_motion; what their columns are stands in tables.csv."""

from spinepipe.schema import declared

FRAMES = declared(__file__, "frames")
STIFFNESS_SETS = declared(__file__, "stiffness_sets")
RANGE_OF_MOTION = declared(__file__, "range_of_motion")
ROM_SUMMARY = declared(__file__, "rom_summary")
ROM_VARIANCE = declared(__file__, "rom_variance")

EVERY = "*"
"""Stands for all specimens."""

FACTORS = ("specimen", "pose", "stiffness", "rest")
"""Parts of the variance in `rom_variance`."""
