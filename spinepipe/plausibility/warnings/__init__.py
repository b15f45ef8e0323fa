"""What is most likely wrong in cohorts that are sound cell by cell, and what would mend it.

No result hangs on these files: a warning may be reworded, and nothing is computed again.
"""
