"""A kind of study made for a test: how many joints each specimen of a cohort has."""
