"""Jobs: what one cached target computes, as plain functions from paths to a path."""
