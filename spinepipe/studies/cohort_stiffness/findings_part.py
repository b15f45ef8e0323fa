"""Key findings of a cohort study as sentences, what casts doubt on all others first."""

from collections.abc import Callable, Iterator

from spinepipe.report.cohort.claim_findings import beside_the_paper, claims
from spinepipe.report.cohort.doubt_findings import bounds, failed, identifiable, optima, signs
from spinepipe.report.cohort.error_findings import loaded_errors, ranking
from spinepipe.report.cohort.spread_findings import spreads
from spinepipe.report.page.results import Results
from spinepipe.studies import CohortStiffness

Finding = Callable[[CohortStiffness, Results], Iterator[str]]

MAKERS: tuple[Finding, ...] = (
    *(signs, failed, bounds, optima, identifiable),
    *(ranking, claims, loaded_errors, spreads, beside_the_paper),
)


def findings(study: CohortStiffness, results: Results) -> list[str]:
    """The sentences, without those that the study has no table for."""
    told = [sentence for make in MAKERS for sentence in make(study, results)]
    return [sentence.replace(" %", "\u00a0%") for sentence in told]
