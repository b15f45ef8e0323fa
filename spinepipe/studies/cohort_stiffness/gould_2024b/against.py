"""All claims of Gould et al. 2024b (doi 10.3389/fbioe.2024.1372088), in the order of the paper."""

from spinepipe.comparison.gould_2024b import (
    error_orders,
    error_patterns,
    group_tests,
    implied_motion,
    level_patterns,
    mean_errors,
    model_tests,
    own_numbers,
    rotations,
    set_up,
    signed_rank,
    stiffness_table,
)

CLAIMS = (
    *set_up.claims(),
    *own_numbers.claims(),
    *rotations.claims(),
    *implied_motion.claims(),
    *stiffness_table.claims(),
    *mean_errors.claims(),
    *group_tests.claims(),
    *signed_rank.claims(),
    *model_tests.claims(),
    *error_patterns.claims(),
    *error_orders.claims(),
    *level_patterns.claims(),
)
