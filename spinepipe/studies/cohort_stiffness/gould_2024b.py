"""The paper that asked what cohort-stiffness studies ask, and the cohort rebuilt from it."""

from spinepipe.report.published import Rebuilt

GOULD_2024B = Rebuilt("gould_2024b", "t12s1_phantom", "Gould et al. 2024b")
