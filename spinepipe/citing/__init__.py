"""Methods to copy into a paper: what was done, with what, and references."""
