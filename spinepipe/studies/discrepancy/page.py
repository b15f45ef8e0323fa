"""The report of a search for missing effects."""

from collections.abc import Iterator, Mapping

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.report.discrepancy.findings import findings, warnings
from spinepipe.report.discrepancy.headline import headline, how_sure
from spinepipe.report.discrepancy.tables import shown_tables
from spinepipe.report.discrepancy.verdict import Answer, Verdict
from spinepipe.report.page.document import Document, Headline, Picture
from spinepipe.report.page.results import Results
from spinepipe.studies import Discrepancy

QUESTION = (
    "Where do model and measurement disagree, which effect does the model lack, what happens when "
    "it is added, and how sure is that?"
)
TITLES = {
    "gap_map": "Where the model is off, before and after",
    "gap_by_step": "The gap along the load",
    "effect_evidence": "Evidence for each effect",
    "gap_held_out": "Proof on motion held out",
    "effect_confusions": "What these tests could tell apart, and see",
}
READ = ("where", "candidates", "held_out", "confusions")
"""Tables whose rows the page needs; of the others it tells where they come from."""


def discrepancy_page(study: Discrepancy, cohort: Cohort, results: Results, verdict: Verdict) -> str:
    """The report as one HTML document that fetches nothing; the same results, the same bytes."""
    whole = Document(
        question=QUESTION,
        findings=findings(verdict, results),
        pictures=[
            Picture.of(name, TITLES[name], svg, " ".join(results.captions[name].split()))
            for name, svg in _ordered(results.pictures, verdict)
        ],
        tables=shown_tables(verdict, results),
        metadata=results.metadata,
        left_out=tuple(left_out(study)),
        poses=pd.DataFrame(),
        headline=Headline(headline(verdict), _joined(how_sure(verdict)), warnings(verdict)),
    )
    return whole.html(study, cohort)


def _ordered(pictures: Mapping[str, str], verdict: Verdict) -> list[tuple[str, str]]:
    """Where nothing is missing, what could have been seen comes first."""
    first = "effect_confusions" if verdict.answer is Answer.NULL else ""
    return sorted(pictures.items(), key=lambda pair: pair[0] != first)


def left_out(study: Discrepancy) -> Iterator[str]:
    """Parts that the settings leave out, each with the setting that does."""
    parts = (
        (
            "prediction of left-out specimens",
            "held_out: specimens: false",
            study.held_out.specimens,
        ),
        ("prediction of left-out tests", "held_out: tests: false", study.held_out.tests),
    )
    yield from (f"{part} ({setting})" for part, setting, done in parts if not done)
    if study.effects is not None:
        yield f"all effects but {', '.join(study.effects)} (effects)"
    for name, size in study.nuisance:
        if not size:
            yield f"nuisance {name} (nuisance: {name}: 0)"


def _joined(words: str) -> str:
    """No line ends between a number and its percent sign."""
    return words.replace(" %", "\u00a0%")
