"""Runs that are disturbed, huge or never end: what is lost, repeated or left behind.

`kills`: every kind of study killed again and again. `targets`: a study of 24,000 jobs, one in a
hundred of which fails. `memory`: fifty studies in one pool of workers. Copies of the project are
made in a temporary folder; what was measured is kept in `results/validation/soak`, part by part, so
a run that was cut off goes on with the next part.
"""
