"""Studies: what is asked of a cohort, validated before anything runs; a folder for each kind."""
