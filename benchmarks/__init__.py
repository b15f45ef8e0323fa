"""Benchmarks: `python -m benchmarks` measures speed side by side with OpenSim in one run."""
