"""One scored cohort: what was true and what the search said, as plain values of JSON."""

import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from spinepipe import cohort as cohorts
from spinepipe.problems import InputError
from spinepipe.studies.discrepancy.search.baseline import NoBase
from spinepipe.studies.discrepancy.search import investigation
from spinepipe.studies.discrepancy.search.investigation import investigate, prepare
from spinepipe.studies.discrepancy.search.outcome import Outcome
from spinepipe.studies.discrepancy.search.regions import values_with_regions
from spinepipe.studies.discrepancy.search.search_state import SearchResult, SelectedTerm
from spinepipe.studies.discrepancy.settings import Discrepancy, DiscrepancyBase
from spinepipe.studies.discrepancy.store import at_once
from tests.generators.hidden import NoEquilibriumError, Recipe, Truth, make
from tests.validation.discrepancy.ablation import replays
from tests.validation.discrepancy.further import (
    held_out_told,
    places_told,
    table_told,
    testable_told,
)

STUDY = Discrepancy(
    study="hidden",
    kind="discrepancy",
    cohort="hidden",
    base=DiscrepancyBase(stiffness="per_specimen"),
    bootstrap=300,
)
RIVALS_KEPT = 5
MOST_SAID = 500

Row = dict[str, Any]


def scored(recipe: Recipe) -> Row:
    """The row of one cohort; trouble is a row with another status than ``scored``."""
    started = time.process_time()
    row: Row = {"recipe": recipe.as_dict(), "status": "scored", "message": ""}
    try:
        with TemporaryDirectory() as place:
            truth = make(recipe, Path(place) / "hidden")
            row |= _truth(truth)
            row["seconds"] = {"make": time.process_time() - started}
            cohort = cohorts.read(Path(place) / "hidden")
        row |= _searched(cohort, truth, row["seconds"])
    except InputError as trouble:
        row |= {"status": "refused", "message": str(trouble)[:MOST_SAID]}
    except NoEquilibriumError as trouble:
        row |= {"status": "no data", "message": str(trouble)}
    except NoBase as trouble:
        row |= {"status": "no base", "message": str(trouble)}
    except Exception as trouble:
        row |= {"status": "failed", "message": f"{type(trouble).__name__}: {trouble}"}
    return row


def _truth(truth: Truth) -> Row:
    names = [hidden.name for hidden in truth.recipe.hidden]
    return {
        "recipe": truth.recipe.as_dict(),
        "truth": {"names": names, "gap": truth.gap, "gaps": list(truth.gaps)},
        "mistakes": truth.errors,
    }


def _searched(cohort: cohorts.Cohort, truth: Truth, seconds: dict[str, float]) -> Row:
    """What the search says, then what is asked besides."""
    started = time.process_time()
    asked: list[Any] = []
    plain = investigation.outcome

    def heard(*arguments: Any) -> Outcome:
        asked[:] = arguments
        return plain(*arguments)

    investigation.outcome = heard
    try:
        ended = investigate(prepare(STUDY, cohort, None), at_once)
    finally:
        investigation.outcome = plain
    found = ended.found
    row = _said(found, ended.ended)
    seconds["search"] = time.process_time() - started
    row["ablation"] = {name: list(said) for name, said in replays(asked).items()}
    started = time.process_time()
    row["held_out"] = held_out_told(ended.proof) if found.standing else None
    names = [hidden.name for hidden in truth.recipe.hidden]
    row["testable"] = testable_told(found, ended.rules, names)
    row["suspected"] = {"errors": [[e.where, e.what, e.evidence] for e in ended.errors]}
    row["places"] = places_told(ended, cohort.joint_names)
    row["table"] = table_told(ended)
    seconds["besides"] = time.process_time() - started
    return row


def _said(found: SearchResult, said: Outcome) -> Row:
    return {
        "verdict": str(said.verdict),
        "why": said.why,
        "named": list(dict.fromkeys(one.name for one in said.named)),
        "tied": list(said.tied),
        "standing": [_standing(found, number) for number in range(len(found.standing))],
        "gap": {
            "base": found.base_gap.gap,
            "final": found.final_gap.gap,
            "base_rms": found.base_gap.rms,
            "final_rms": found.final_gap.rms,
        },
        "left": list(said.left),
        "reason": said.reason,
        "lack": found.lack.log_evidence,
        "shape": {"coordinate": found.lack.coordinate, "words": found.lack.shape},
        "lack_threshold": found.generic_threshold,
        "threshold": found.stages[0].screen.threshold,
        "noise_correlation": float(found.base.noise.correlation),
        "screen": [
            [one.effect, one.log_evidence] for one in found.stages[0].screen.effects[:RIVALS_KEPT]
        ],
    }


def _standing(found: SearchResult, number: int) -> Row:
    """A form that stands, with its values and their regions in the units of tables."""
    one: SelectedTerm = found.standing[number]
    form = one.supposed.form
    values = values_with_regions(found.final.fit, found.final.setting, number)
    return {
        "name": one.name,
        "options": dict(form.variant.options),
        "spread": str(form.spread.value),
        "joint": form.joint,
        "specimen": form.specimen,
        "log_evidence": one.log_evidence,
        "gain": one.gain,
        "rivals": [[rival.name, rival.margin] for rival in one.rivals[:RIVALS_KEPT]],
        "values": [
            {
                "name": value.name,
                "place": list(value.place),
                "value": value.value,
                "low": value.low,
                "high": value.high,
                "unit": value.unit,
                "at_bound": value.at_bound,
                "identifiable": value.identifiable,
            }
            for value in values
        ],
    }
