"""Jobs of studies of kind discrepancy."""
