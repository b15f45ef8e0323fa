"""Sensitivity: what an output hangs on, from tables of results (not from derivatives)."""
