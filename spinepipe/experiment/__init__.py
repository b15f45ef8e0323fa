"""What laboratories report of an experiment: loops of load and rotation, and axes of motion.

Everything here is computed from arrays alone; of cohorts, models and studies it knows nothing.
"""
