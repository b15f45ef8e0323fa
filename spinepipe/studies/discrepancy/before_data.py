"""What `spinepipe new study --design` says: an answer of a few lines, and all of it as a table."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.files import appearing
from spinepipe.model.file import read_model
from spinepipe.studies.discrepancy.alternatives import run_in_words
from spinepipe.studies.discrepancy.design.planned import planned_experiment
from spinepipe.studies.discrepancy.settings import Discrepancy
from spinepipe.studies.discrepancy.verdict import SURE
from spinepipe.studies.discrepancy.words import general

MOST_ROWS = 10


def prospects(
    study: Discrepancy, cohort: Cohort, root: Path, cycles: int, gaps: Sequence[float], to: Path
) -> Iterator[str]:
    """Lines for the terminal; the table is written to ``to``, .csv or .parquet.

    Raises
    ------
    InputError
        As `planned_experiment` does.
    """
    file = None if study.base.model is None else read_model(root / study.base.model)
    found = planned_experiment(study, cohort, file, cycles, gaps)
    table = pd.DataFrame([asdict(one) for one in found.prospects])
    with appearing(to) as temporary:
        if to.suffix == ".parquet":
            table.to_parquet(temporary, index=False)
        else:
            table.to_csv(temporary, index=False)
    first = [one for one in found.prospects if one.gap == gaps[0]]
    sure = sum(one.probability >= SURE for one in first)
    yield (
        f"Of {len(first)} effects that make a misfit of {gaps[0]:g} SD of one reading, {sure} "
        f"would be named with a probability of {SURE:g} or more."
    )
    mean = table["probability"].mean()
    for words, then in found.runs[:1]:
        yield (
            f"Most is gained by: {run_in_words(words)} "
            f"(probability, mean of all: {mean:.2f} now, {then:.2f} with it)."
        )
    yield (
        f"{'least probable':28s}" + "".join(f"{gap:>7g}" for gap in gaps) + "  most like; best run"
    )
    for one in sorted(first, key=lambda one: one.probability)[:MOST_ROWS]:
        same = table[table["effect"] == one.effect].set_index("gap")["probability"]
        rival = one.why or general(one.rival or "nothing missing")
        run = f"; {run_in_words(one.further_run)} ({one.with_run:.2f})" if one.further_run else ""
        sizes = "".join(f"{same[gap]:7.2f}" for gap in gaps)
        yield f"{general(one.effect):28s}{sizes}  {rival}{run}"
    yield f"All {len(first)} effects: {to}"
