"""A search for missing effects as a user runs it, on cohorts that OpenSim and numpy made."""

import contextlib
import json
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from benchmarks.study import Run, copy_of_project, run_workflow
from tests.generators.hidden import Recipe, draw_hidden, make

STUDY = "searched"
VERDICT = f"results/{STUDY}/discrepancy/verdict.json"
_TEXT = """\
study: {study}
kind: discrepancy
cohort: {cohort}
base: {{stiffness: per_specimen}}
"""


def _with_neutral_zone(recipe: Recipe) -> Recipe:
    """Data in which every base model lacks a neutral zone, to a gap of one noise SD."""
    return replace(recipe, gap=1.0, hidden=(draw_hidden("neutral_zone", recipe),))


@dataclass(frozen=True)
class Case:
    """A cohort to search, and within what time and memory."""

    about: str
    recipe: Recipe
    goal: str


SMALL = Case(
    "3 specimens x 6 joints x 3 tests x 7 steps x 3 cycles",
    _with_neutral_zone(Recipe(seed=71)),
    "20 s",
)
FULL = Case(
    "6 specimens x 6 joints x 6 tests x 21 steps x 3 cycles",
    _with_neutral_zone(
        Recipe(seed=71, n_specimens=6, design="directions", steps=10, unloading=True)
    ),
    "240 s, 2 GB",
)
AGAIN = "10 s"


@dataclass(frozen=True)
class Said:
    """What a search came to.

    Attributes
    ----------
    closed : share of the base's gap that is closed on held-out motion. store_mib : what is kept.
    """

    verdict: str
    named: tuple[str, ...]
    log_evidence: float | None
    threshold: float
    held_out_gaps: tuple[float, float]
    closed: float | None
    store_mib: float


def measure(case: Case) -> tuple[Said, list[Run]]:
    """Verdict with held-out proof and thresholds: cold, again, and again by force."""
    with _project(case.recipe) as folder:
        runs = [
            run_workflow(f"verdict, cold: {case.about}", folder, [VERDICT], case.goal),
            run_workflow("asked for again: nothing to do", folder, [VERDICT], AGAIN),
            run_workflow("made again from the store", folder, ["--force", VERDICT], AGAIN),
        ]
        return _said(Path(folder, VERDICT)), runs


@contextlib.contextmanager
def _project(recipe: Recipe) -> Iterator[str]:
    """A copy of the project with one study, of a cohort made by the recipe elsewhere."""
    with copy_of_project() as folder, tempfile.TemporaryDirectory() as cohorts:
        cohort = Path(cohorts, "hidden")
        make(recipe, cohort)
        config = Path(folder, "config")
        text = _TEXT.format(study=STUDY, cohort=cohort)
        (config / "studies" / f"{STUDY}.yaml").write_text(text, encoding="utf-8")
        (config / "config.yaml").write_text(f"studies: [{STUDY}]\n", encoding="utf-8")
        yield folder


def _said(path: Path) -> Said:
    data: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    gap = data["gap"]
    kept = (file.stat().st_size for file in (path.parent / "store").rglob("*") if file.is_file())
    return Said(
        data["verdict"],
        tuple(one["name"] for one in data["effects"]),
        max((one["log_evidence"] for one in data["effects"]), default=None),
        data["threshold"]["log_evidence"],
        (gap["held_out_base"], gap["held_out_with_effects"]),
        gap["held_out_closed"],
        sum(kept) / 2**20,
    )


def in_words(said: Said) -> str:
    """What the search said, in a sentence."""
    names = f" {', '.join(said.named)}" if said.named else ""
    evidence = "" if said.log_evidence is None else f"log evidence {said.log_evidence:.1f}, "
    before, after = said.held_out_gaps
    closed = (
        ""
        if said.closed is None
        else f", {100 * said.closed:.0f} % of the excess misfit (chi squared)"
    )
    return (
        f"{said.verdict}{names}: {evidence}threshold {said.threshold:.1f}; held-out gap "
        f"{before:.2f} to {after:.2f} noise SD{closed}; store {said.store_mib:.0f} MiB."
    )
