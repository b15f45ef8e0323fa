"""All claims of Gould et al. 2024 (doi 10.3389/fbioe.2024.1304334), in the order of the paper."""

from spinepipe.comparison import (
    best_model,
    bootstraps,
    closed_forms,
    correlations,
    counts,
    datasets,
    experiment,
    factors,
    joint_frames,
    nominal,
    normality,
    pose_sampling,
    precision,
    stiffness_ranges,
    ten_best,
    two_factor,
)

CLAIMS = (
    *experiment.claims(),
    *counts.claims(),
    *nominal.claims(),
    *bootstraps.claims(),
    *stiffness_ranges.claims(),
    *ten_best.claims(),
    *best_model.claims(),
    *pose_sampling.claims(),
    *normality.claims(),
    *correlations.claims(),
    *two_factor.claims(),
    *factors.claims(),
    *joint_frames.claims(),
    *datasets.claims(),
    *precision.claims(),
    *closed_forms.claims(),
)
