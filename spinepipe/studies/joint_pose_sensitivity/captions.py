"""What is said below a figure on the page: its caption, without what does not hold here."""

import re
from collections.abc import Iterator

from spinepipe.cohort import Cohort
from spinepipe.report.agreement import in_rows
from spinepipe.report.page.results import Results
from spinepipe.report.published import OF_JOINT_POSE, paper_of
from spinepipe.report.settling import settling
from spinepipe.studies import JointPoseSensitivity

_SENTENCE_END = re.compile(r"(?<=[.])(?<!et al[.])\s+(?=[A-Z])")
SIMULATED = ("errors", "agreement")
"""Figures of simulated motion."""


def caption(
    name: str, text: str, study: JointPoseSensitivity, cohort: Cohort, results: Results
) -> str:
    """A figure's caption for this study and cohort."""
    false = tuple(_false(cohort, results))
    sentences = _SENTENCE_END.split(" ".join(text.split()))
    kept = [sentence for sentence in sentences if not sentence.startswith(false)]
    if name in SIMULATED and settling(study):
        kept.append(settling(study))
    return " ".join(kept)


def _false(cohort: Cohort, results: Results) -> Iterator[str]:
    """How the sentences begin that speak of something else than this study shows."""
    if paper_of(cohort.name, OF_JOINT_POSE) is None:
        yield "For the cohort rebuilt from"
    several = len(cohort.specimen_names) > 1
    yield "With one specimen," if several else "With several specimens,"
    agreement = results.table("agreement")
    if not agreement.empty:
        rows = in_rows(agreement, cohort)
        yield "With few joints and directions," if rows else "With many joints and directions,"
