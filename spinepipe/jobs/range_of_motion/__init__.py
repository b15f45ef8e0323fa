"""Jobs of studies of kind range_of_motion: frames, stiffness sets, motion and its summaries."""
