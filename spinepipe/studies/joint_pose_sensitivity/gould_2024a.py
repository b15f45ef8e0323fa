"""The paper that asked what joint-pose studies ask, and the cohort rebuilt from it."""

from spinepipe.anatomy.published import Reproduction

GOULD_2024A = Reproduction("gould_2024a", "palanca_l1l4", "Gould et al. 2024")
