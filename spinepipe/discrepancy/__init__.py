"""Discrepancy: where simulation and measurement disagree, and which effect the model lacks."""
