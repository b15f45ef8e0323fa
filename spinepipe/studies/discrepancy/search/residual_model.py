"""Beyond the library: a formula and a table for what stays when no effect of the library fits.

Neither is a name. The table is an effect, `tabulated_law`, fitted by the full simulator along with
everything and carried into the model file, so that predictions are better even so; it stays only
if it predicts readings that were left out.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from spinepipe.effects import PlaceSpread
from spinepipe.effects.tabulated_law import ITSELF
from spinepipe.studies.discrepancy.proof.held_out import proof_of_terms
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.formula import formula
from spinepipe.studies.discrepancy.search.gaps import whole_gap
from spinepipe.studies.discrepancy.search.hypothesis import ActiveTerm, CandidateForm, Variant
from spinepipe.studies.discrepancy.search.joint_fit import joint_fit
from spinepipe.studies.discrepancy.search.lack_of_fit import OWN, LackOfFit, lack_of_fit
from spinepipe.studies.discrepancy.search.refit import laplace, standing
from spinepipe.studies.discrepancy.search.screen import LEAST_THRESHOLD, exceeded
from spinepipe.studies.discrepancy.search.search_state import Rules
from spinepipe.studies.discrepancy.store import PieceRunner
from spinepipe.studies.discrepancy.verdict import EVERY
from spinepipe.studies.discrepancy.verdict_unnamed import Formula, Tabulated
from spinepipe.units import COORDINATES

TABLE = "tabulated_law"
MOST_TABLES = 3
DIGITS = 3


@dataclass(frozen=True)
class ResidualModel:
    """What stays, described. ``grounds`` : with the tables; as before where there are none."""

    formula: Formula | None
    table: Tabulated | None
    grounds: BaselineFit


def model_residual(baseline: BaselineFit, rules: Rules, run: PieceRunner) -> ResidualModel:
    """What the baseline's fit leaves as a formula, and as tables."""
    asked = (rules.coordinates, rules.draws, rules.seed)
    found = run(formula, baseline, *asked, rules.false_alarm)
    lack = run(lack_of_fit, baseline, *asked)
    after, table = run(fit_tables, baseline, lack, found, rules.false_alarm)
    return ResidualModel(found, table, after)


def fit_tables(
    baseline: BaselineFit, lack: LackOfFit, found: Formula | None, false_alarm: float
) -> tuple[BaselineFit, Tabulated | None]:
    """The baseline with a table at each place that has evidence; None where there is none.

    Parameters
    ----------
    lack : what the generic basis sees beside the baseline's fit. found : the formula of the same.
    """
    forms = list(dict.fromkeys(_forms(baseline, lack, found, false_alarm)))
    at, chosen = baseline, list[CandidateForm]()
    while len(chosen) < MOST_TABLES:
        places = {one.variant for one in chosen}
        best = _best(at, [form for form in forms if form.variant not in places])
        if best is None:
            break
        at, form = best
        chosen.append(form)
    if not chosen:
        return baseline, None
    closed = proof_of_terms(baseline, at).closed
    place = "; ".join(_where(baseline, form) for form in chosen)
    return at, Tabulated(place, whole_gap(at, at.fit).gap, closed)


def _best(
    baseline: BaselineFit, forms: Sequence[CandidateForm]
) -> tuple[BaselineFit, CandidateForm] | None:
    """The table with the most evidence of those that predict what is left out, beside the rest."""
    fits = [(fitted, form) for form in forms if (fitted := _fitted(baseline, form)) is not None]
    for (_, at), form in sorted(fits, key=lambda pair: -pair[0][0]):
        proof = proof_of_terms(baseline, at)
        if proof.beats_base or not proof.tells:
            return at, form
    return None


def _forms(
    baseline: BaselineFit, lack: LackOfFit, found: Formula | None, false_alarm: float
) -> Iterator[CandidateForm]:
    """Tables worth a fit: where the generic basis or the formula sees a load over some motion."""
    joints = next(iter(baseline.fit.models.values())).joints
    for coordinate, one in lack.at.items():
        evident = one.log_evidence > max(LEAST_THRESHOLD, exceeded(one.null, false_alarm))
        if not evident or one.family != OWN:
            continue
        # the same everywhere, and as the lack differs
        variant = _variant(baseline, coordinate, coordinate)
        yield CandidateForm(variant, PlaceSpread.SHARED)
        if one.spread is not PlaceSpread.SHARED and len(joints) > 1:
            yield CandidateForm(variant, PlaceSpread.BY_JOINT)
        if len(baseline.readings) > 1:
            yield CandidateForm(variant, PlaceSpread.BY_SPECIMEN)
        if one.spread is PlaceSpread.EACH:
            yield CandidateForm(variant, PlaceSpread.EACH)
    for term in found.terms if found is not None else ():
        for along in dict.fromkeys((*term.of, *(term.of and (term.coordinate,)))):
            joint = None if term.joint == EVERY[0] else joints.index(term.joint)
            specimen = None if term.specimen == EVERY[0] else term.specimen
            variant = _variant(baseline, term.coordinate, along)
            yield CandidateForm.at(variant, joint, specimen)


def _variant(baseline: BaselineFit, coordinate: str, along: str) -> Variant:
    """The table, as far as all specimens move: beyond, one would tell of the others."""
    at = COORDINATES.index(along)
    furthest = []  # motion of each specimen in that coordinate, m or rad, in the model or as read
    for name, one in baseline.readings.items():
        moved = [np.abs(test.mean[..., at][test.count[..., at] > 0]) for test in one.tests]
        moved += [np.abs(predicted[..., at]) for predicted in baseline.fit.predicted[name]]
        furthest.append(max(float(of_test.max(initial=0.0)) for of_test in moved))
    reach = float(f"{min(furthest):.{DIGITS}g}")
    over = ITSELF if along == coordinate else along
    return Variant(TABLE, (("coordinate", coordinate), ("over", over), ("reach", reach)))


def _fitted(baseline: BaselineFit, form: CandidateForm) -> tuple[float, BaselineFit] | None:
    """Log evidence of the table, and the baseline with it; None without evidence or fit."""
    before = baseline.fit
    off = form.variant.off(())
    supposed = (*standing(before), ActiveTerm(form, off))
    fit = joint_fit(baseline.suppose(supposed), baseline.setting, before.poses)
    if not fit.usable:
        return None
    evidence = laplace(fit, len(supposed) - 1, before.chi2 - fit.chi2)
    return (evidence, baseline.at(fit)) if evidence > LEAST_THRESHOLD else None


def _where(baseline: BaselineFit, form: CandidateForm) -> str:
    """In words: what is tabulated over what, and where."""
    options = dict(form.variant.options)
    joints = next(iter(baseline.fit.models.values())).joints
    over = "" if options["over"] == ITSELF else f" over {options['over']}"
    joint = "every joint" if form.joint is None else joints[form.joint]
    differ = form.spread in (PlaceSpread.BY_JOINT, PlaceSpread.BY_SPECIMEN, PlaceSpread.EACH)
    apart = f", {form.spread.value}" if differ else ""
    of = "" if form.specimen is None else f" of {form.specimen}"
    return f"{options['coordinate']}{over} at {joint}{of}{apart}".replace("_", " ")
