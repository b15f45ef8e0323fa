"""Proof on held-out data: each model on readings that its fit has not seen."""
