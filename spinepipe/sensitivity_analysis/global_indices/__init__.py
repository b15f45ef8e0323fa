"""Global sensitivity: designs of factors, indices of outputs with intervals, their noise floor."""
