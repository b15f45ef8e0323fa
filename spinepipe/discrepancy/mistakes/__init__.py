"""Mistakes in the files that no effect should explain."""
