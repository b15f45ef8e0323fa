"""Finding about the paper: how many of its numbers ours are inside the range of."""

import pandas as pd

from spinepipe.report.page.results import Results
from spinepipe.studies import JointPoseSensitivity


def paper(study: JointPoseSensitivity, results: Results) -> str:
    """How the published quantities were judged."""
    return judged(results.table("against_gould_2024a"))


def judged(rows: pd.DataFrame) -> str:
    """The same of any table of published quantities with verdicts."""
    if rows.empty:
        return ""
    found = {name: int((rows["verdict"] == name).sum()) for name in rows["verdict"].unique()}
    inside, outside = found.get("inside", 0), found.get("outside", 0)
    others = (
        ("circular", "are what the cohort was built to have"),
        ("recomputed", "only follow from the paper's own numbers"),
        ("contradicted", "are contradicted by other numbers of the paper and not chased"),
        ("not_computed", "are not computed"),
    )
    told = [f"{found[name]} {words}" for name, words in others if name in found]
    words = (
        f"Of {len(rows)} published quantities ours are inside the paper's range for {inside} and "
        f"outside for {outside}"
    )
    return "; ".join(part for part in (words, ", ".join(told)) if part) + "."
