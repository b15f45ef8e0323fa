"""What is too slow for a test: `make validate` measures it and writes tests/validation/results.

Every data set is a target of its own: a run that was cut off goes on where it stood.
"""
