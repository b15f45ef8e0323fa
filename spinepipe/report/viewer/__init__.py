"""A viewer of vertebrae in 3-D: geometry made here, posed and drawn by a script of the page."""
