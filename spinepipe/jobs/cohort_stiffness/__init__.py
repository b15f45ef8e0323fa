"""Jobs of studies of kind cohort_stiffness."""
