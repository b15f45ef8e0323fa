"""Results of a run beside published numbers, each with a verdict and its reason."""

from spinepipe.comparison.claim import Claim, Ours, Verdict, judge, judged
from spinepipe.comparison.gould_2024a import CLAIMS as GOULD_2024A
from spinepipe.comparison.gould_2024b import CLAIMS as GOULD_2024B
from spinepipe.comparison.ranges import Range
from spinepipe.comparison.run import NotComputed, Run

__all__ = [
    "GOULD_2024A",
    "GOULD_2024B",
    "Claim",
    "NotComputed",
    "Ours",
    "Range",
    "Run",
    "Verdict",
    "judge",
    "judged",
]
