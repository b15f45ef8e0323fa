"""Files of a laboratory as a cohort folder: one settings file says what they are."""
