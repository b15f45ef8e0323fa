"""Results for other programs: few tables per study, one unit a column, no row a sum of others."""
