"""The paper that asked what cohort-stiffness studies ask, and the cohort rebuilt from it."""

from spinepipe.anatomy.published import Reproduction

GOULD_2024B = Reproduction("gould_2024b", "t12s1_phantom", "Gould et al. 2024b")
