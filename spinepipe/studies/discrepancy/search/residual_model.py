"""A table for what stays when no effect of the library fits: it is no name.

It is that of the search, fitted by the full simulator along with everything and carried into the
model file, so that predictions are better even so; it stays only if it predicts readings that were
left out.
"""

from dataclasses import dataclass

from spinepipe.effects import PlaceSpread
from spinepipe.effects.tabulated_law import ITSELF
from spinepipe.studies.discrepancy.proof.held_out import held_out
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.gaps import whole_gap
from spinepipe.studies.discrepancy.search.hypothesis import CandidateForm
from spinepipe.studies.discrepancy.search.search_state import SearchResult
from spinepipe.studies.discrepancy.search.something_else import TABLE
from spinepipe.studies.discrepancy.store import PieceRunner
from spinepipe.studies.discrepancy.verdict_unnamed import Tabulated


@dataclass(frozen=True)
class ResidualModel:
    """What stays, described. ``grounds`` : with the tables; as before where there are none."""

    table: Tabulated | None
    grounds: BaselineFit


def model_residual(found: SearchResult, run: PieceRunner) -> ResidualModel:
    """The tables of a search beside what its final model says."""
    after = found.with_tables
    if after is None:
        return ResidualModel(None, found.final)
    proof = run(held_out, found.final, after)
    if proof.tells and not proof.beats_base:
        return ResidualModel(None, found.final)
    forms = [o.form for o in after.fit.hypothesis.supposed if o.form.name == TABLE]
    place = "; ".join(_where(form) for form in forms)
    return ResidualModel(Tabulated(place, whole_gap(after, after.fit).gap, proof.closed), after)


def _where(form: CandidateForm) -> str:
    """In words: what is tabulated over what, and where."""
    options = dict(form.variant.options)
    over = "" if options["over"] == ITSELF else f" over {options['over']}"
    apart = "" if form.spread is PlaceSpread.SHARED else f", {form.spread.value}"
    return f"{options['coordinate']}{over} at every joint{apart}".replace("_", " ")
