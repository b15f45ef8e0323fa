"""A testing machine's files as a cohort: read, cut into cycles, thinned to common load steps."""
