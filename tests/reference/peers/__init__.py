"""Other people's engines, told to solve the same chain: OpenSim and pinocchio.

Nothing in here imports spinepipe, so that agreement with it is evidence.
"""
