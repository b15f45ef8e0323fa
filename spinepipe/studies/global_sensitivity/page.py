"""The report of a global sensitivity study."""

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.report.global_sensitivity.findings import findings, opening
from spinepipe.report.global_sensitivity.tables import shown_tables
from spinepipe.report.page.document import Document, Picture
from spinepipe.report.page.results import Results
from spinepipe.studies import GlobalSensitivity

QUESTION = (
    "Which uncertain inputs drive the results of this spine's simulations, how sure is that, and "
    "which inputs need not be known better?"
)
TITLES = {
    "factor_indices": "What each output hangs on",
    "index_convergence": "Indices against the number of runs",
    "top_factors": "Outputs over the leading factors",
}
READ = ("indices", "convergence")
"""Tables whose rows the page needs; of the others it tells where they come from."""


def sensitivity_page(study: GlobalSensitivity, cohort: Cohort, results: Results) -> str:
    """The report as one HTML document that fetches nothing; the same results, the same bytes."""
    whole = Document(
        question=QUESTION,
        findings=findings(study, cohort, results),
        pictures=[
            Picture.of(name, TITLES[name], svg, " ".join(results.captions[name].split()))
            for name, svg in results.pictures.items()
        ],
        tables=shown_tables(cohort, results),
        metadata=results.metadata,
        left_out=left_out(study),
        poses=pd.DataFrame(),
        headline=opening(study, cohort, results),
    )
    return whole.html(study, cohort)


def left_out(study: GlobalSensitivity) -> tuple[str, ...]:
    """Parts that the settings leave out, each with the setting that does."""
    parts = (
        ("joint motion", "outputs: motion: []", bool(study.outputs.motion)),
        ("joint loads", "outputs: joint_load: []", bool(study.outputs.joint_load)),
        ("calibrated stiffness", "outputs: stiffness: false", study.outputs.stiffness),
        ("noise floor", "dummy: false", study.dummy),
        ("interactions of two factors", "design: second_order: false",
         study.design.method != "sobol" or study.design.second_order),
        ("all load steps but the largest", "steps: peak", study.steps == "all"),
    )  # fmt: skip
    return tuple(f"{part} ({setting})" for part, setting, done in parts if not done)
