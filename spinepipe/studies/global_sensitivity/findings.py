"""What the page of a sensitivity study says first."""

from collections.abc import Sequence

from spinepipe.cohort import Cohort
from spinepipe.report.global_sensitivity.drivers import driver, most
from spinepipe.report.global_sensitivity.measures import Measures, measures_of
from spinepipe.report.global_sensitivity.panels import Panel, outputs
from spinepipe.report.global_sensitivity.sureness import pairs, runs, settled, without
from spinepipe.report.page.document import Headline
from spinepipe.report.page.results import Results
from spinepipe.report.words import count
from spinepipe.studies import GlobalSensitivity

MOST_OUTPUTS = 12
DOUBTFUL = ("too_many_failed", "too_few")
"""Why an output has no index, where that casts doubt on the study."""


def opening(study: GlobalSensitivity, cohort: Cohort, results: Results) -> Headline:
    """The leading factors in a sentence, how sure they are, and what casts doubt on them."""
    indices = results.table("indices")
    found, measures = _outputs(cohort, results)
    words = most(found, measures, cohort.joint_names) if measures else ""
    sure = [runs(study, indices)]
    if measures:
        grown = results.table("convergence")
        sure.append(settled(grown, found, measures, cohort.joint_names))
        if indices["ci_low"].notna().any():
            sure.append(f"In brackets: {100.0 * study.confidence:g} % confidence intervals.")
    doubts = tuple(words for status, words in without(indices) if status in DOUBTFUL)
    return Headline(
        words or "No output has an index.", " ".join(part for part in sure if part), doubts
    )


def findings(study: GlobalSensitivity, cohort: Cohort, results: Results) -> list[str]:
    """A sentence or two for each output, then interactions and outputs without an index."""
    indices = results.table("indices")
    found, measures = _outputs(cohort, results)
    shown = found[:MOST_OUTPUTS] if measures else []
    told = [driver(panel, measures, cohort.joint_names) for panel in shown if measures]
    if len(found) > MOST_OUTPUTS:
        told.append(f"{count(len(found) - MOST_OUTPUTS, 'more output')}: see the tables.")
    told.append(pairs(indices, found))
    told += [words for status, words in without(indices) if status not in DOUBTFUL]
    told.append(_of_the_dummy(study))
    return [sentence for sentence in told if sentence]


def _outputs(cohort: Cohort, results: Results) -> tuple[Sequence[Panel], Measures | None]:
    indices = results.table("indices")
    measures = measures_of(indices) if len(indices) else None
    return (outputs(cohort, indices, measures) if measures else []), measures


def _of_the_dummy(study: GlobalSensitivity) -> str:
    if not study.dummy:
        return "There is no dummy factor (dummy: false), so nothing tells an index from noise."
    return _EXACT.get(study.design.method, "")


_EXACT = {
    "sobol": "In a sobol design S1 and ST of the dummy, and of every factor without any effect, "
    "are exactly 0: there the intervals show the noise, and a factor is above the dummy where its "
    "interval is above 0.",
    "morris": "In a morris design the indices of the dummy, and of every factor without any "
    "effect, are exactly 0: there the intervals show the noise.",
}
"""What the dummy can say in these designs."""
