"""Results of a run beside published numbers, each with a verdict and its reason."""

from spinepipe.comparison.claim import (
    Claim,
    Limit,
    NotComputed,
    Ours,
    Range,
    Run,
    Verdict,
    judge,
    judged,
)

__all__ = [
    "Claim",
    "Limit",
    "NotComputed",
    "Ours",
    "Range",
    "Run",
    "Verdict",
    "judge",
    "judged",
]
