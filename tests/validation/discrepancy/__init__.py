"""Scores of the search for missing effects, on cohorts with a hidden truth.

`python -m tests.validation discrepancy`: each cohort is made, searched and forgotten; one row of
what was true and what was said stays in results/validation. Tables of all rows go to
tests/validation/results. What is scored is in `targets`, what counts as right in `goals`.
"""
