"""Key findings of a study as sentences, their numbers computed from its tables."""

from collections.abc import Callable

from spinepipe.report.page.bootstrap_findings import bootstraps
from spinepipe.report.page.fit_findings import fits, settled, stiffness
from spinepipe.report.page.method_findings import methods
from spinepipe.report.page.paper_findings import paper
from spinepipe.report.page.precision_findings import precision
from spinepipe.report.page.results import Results
from spinepipe.report.page.variance_findings import dominant
from spinepipe.studies import JointPoseSensitivity

_PERCENT = "\u00a0%"
"""No line ends between a number and its percent sign."""

Finding = Callable[[JointPoseSensitivity, Results], str]


def findings(study: JointPoseSensitivity, results: Results) -> list[str]:
    """The sentences, without those that the study has no table for."""
    makers: tuple[Finding, ...] = (
        fits, stiffness, settled, dominant, precision, methods, bootstraps, paper,
    )  # fmt: skip
    told = [make(study, results) for make in makers]
    return [sentence.replace(" %", _PERCENT) for sentence in told if sentence]
