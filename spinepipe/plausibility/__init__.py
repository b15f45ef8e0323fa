"""What is most likely wrong in files that are sound cell by cell, and what would mend it."""
