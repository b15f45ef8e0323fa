"""Tables of studies of kind global_sensitivity; what their columns are stands in tables.csv."""

from spinepipe.schema import declared

DESIGN = declared(__file__, "design")
BASE_STIFFNESS = declared(__file__, "base_stiffness")
BASE_MOTION = declared(__file__, "base_motion")
RESPONSES = declared(__file__, "responses")
CALIBRATED = declared(__file__, "calibrated")
INDICES = declared(__file__, "indices")
FAILED_RUNS = declared(__file__, "failed_runs")
CONVERGENCE = declared(__file__, "convergence")

EVERY = "*"
"""All tests, or all joints: of stiffness."""
