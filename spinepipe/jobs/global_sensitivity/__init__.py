"""Jobs of studies of kind global_sensitivity: the design, responses by the batch, indices."""
