"""The numbers of Wang et al. 2021 (OptK) beside those of a run."""
