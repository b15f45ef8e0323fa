"""Figures of tracked motions."""
