"""A specimen varied: many spines and loads from factors with values, for one design."""
