"""Rows of the tables, from what a search found, its proof and its advice.

Words are those of `spinepipe.studies.discrepancy.verdict`. Gaps are in noise SD. *Excess* is chi2
less its degrees of freedom. A *form* is an effect with its variant, spread and place; its
*strengths* are off at a known value, its *shapes* say nothing while the strengths are off. Readings
have places t, j, c: load step, joint from below, coordinate. *Display units* are those of tables:
mm, deg.
"""

import csv
import io
import json
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from spinepipe.model import Support
from spinepipe.status import Status
from spinepipe.studies.discrepancy.design.advice import Advice
from spinepipe.studies.discrepancy.design.distinguishability import Distinguishability
from spinepipe.studies.discrepancy.proof.held_out import HeldOut
from spinepipe.studies.discrepancy.search.gaps import KEYS, places, residual_frame
from spinepipe.studies.discrepancy.search.hypothesis import CandidateForm
from spinepipe.studies.discrepancy.search.imperfections import AbsorbedGap, NuisancePlace
from spinepipe.studies.discrepancy.search.joint_fit import JointFit
from spinepipe.studies.discrepancy.search.model_files import display_value, fitted_values
from spinepipe.studies.discrepancy.search.refit import Refit
from spinepipe.studies.discrepancy.search.search_state import SearchResult, SearchStage
from spinepipe.studies.discrepancy.tables import NEXT_TESTS
from spinepipe.studies.discrepancy.verdict import share_of_gap
from spinepipe.units import COORDINATE_UNITS, COORDINATES, DISPLAY_PER_SI, LOAD_UNITS

Row = dict[str, Any]

MOST_FORMS_SHOWN = 5
"""Forms of one effect on a screen that get a row; the others are far behind."""

GIVEN_UP: Row = {"held_out_fold": "", "held_out_base": None, "held_out_with_effects": None}
"""Columns of ``gap`` that versions before filled."""

NOT_FITTED = "the linear problem, no fit"
"""Message of what was screened: its numbers are of readings linearised at the fit before."""

FITTED = "fitted"
MOST_PROBABLE, NO_FIT = "in the most probable set", "no fit: probability 0"

DEGENERATE = "a shape ran to its bound: no more what its name says"
"""Message of a refit without evidence."""


def gap_rows(
    found: SearchResult,
    joints: Sequence[str],
    tabulated: JointFit | None = None,
) -> list[Row]:
    """Every reading, mean over cycles, with what both models say.

    Cycles of one test that were loaded differently are readings apart; here they are averaged.

    Parameters
    ----------
    joints : names, from below. tabulated : the fit with tables in the model file for what has no
        name, where there is one.
    """
    collected: dict[tuple[Any, ...], list[Row]] = {}
    for name in found.base.readings:
        for key, row in _rows_of(found, name, joints, tabulated):
            collected.setdefault(key, []).append(row)
    return [_averaged(key, rows) for key, rows in collected.items()]


def _rows_of(
    found: SearchResult,
    name: str,
    joints: Sequence[str],
    tabulated: JointFit | None,
) -> Iterator[tuple[tuple[Any, ...], Row]]:
    """Place (values of `KEYS`) and row of each reading of a specimen, in display units.

    ``load`` : N or N m on the coordinate, in the neutral pose. ``noise_sd`` : of the mean over
    cycles.
    """
    readings, noise = found.base.readings[name], found.base.noise
    fits = {"base": found.base.fit, "with_effects": found.final.fit, "with_table": tabulated}
    modelled = {model: None if fit is None else fit.predicted[name] for model, fit in fits.items()}
    for number, test in enumerate(readings.tests):
        # (T,) SD of each step's reading over that of a raw one: zeroing adds the error of step 0
        size = np.sqrt(np.diagonal(noise.correlations(len(test.count))))
        sd = size[:, None] * noise.sd * DISPLAY_PER_SI
        for t, j, c in zip(*np.nonzero(test.count), strict=True):
            factor, count = DISPLAY_PER_SI[c], int(test.count[t, j, c])
            row: Row = {
                "unit": COORDINATE_UNITS[COORDINATES[c]],
                "held_at": None,
                "load": float(readings.applied[number][t, j, c]),
                "measured": float(test.mean[t, j, c] * factor),
                "readings": count,
                "noise_sd": float(sd[t, c] / np.sqrt(count)),
                **GIVEN_UP,
            }
            for model, motion in modelled.items():
                row[model] = None if motion is None else float(motion[number][t, j, c] * factor)
            step = test.case.steps[t]
            rig = next((one for one in step.supports if one.place == 6 * j + c), None)
            key = (name, test.case.test, step.step, joints[j], COORDINATES[c])
            yield key, row if rig is None else _as_load(rig, row, int(c))


def _as_load(rig: Support, row: Row, coordinate: int) -> Row:
    """A row of a reaction, in loads: what is listed, and what the models hold at that motion.

    The rig holds the coordinate, so what was measured is a load, and the cohort lists it. Its
    reading is then 0 by definition, and a model's reading is the load that the rig must add to the
    listed one, times `Support.read_as`. Both are turned back into loads here.
    """
    # mm or deg of a reading for each N or N m
    assert rig.read_as is not None
    per, load = float(DISPLAY_PER_SI[coordinate]) * rig.read_as, row["load"]
    held_at = rig.value * float(DISPLAY_PER_SI[coordinate])
    found = row | {"unit": LOAD_UNITS[COORDINATES[coordinate]], "held_at": held_at}
    found["noise_sd"] = row["noise_sd"] / per
    for name in ("measured", "base", "with_effects", "with_table"):
        found[name] = None if row[name] is None else load + row[name] / per
    return found


def _averaged(key: tuple[Any, ...], rows: Sequence[Row]) -> Row:
    """One row of those that several load histories of a test have at a place.

    Means are weighted by the number of readings; a model has one only where it has all rows.
    """
    at = dict(zip(KEYS, key, strict=True))
    if len(rows) == 1:
        return at | rows[0]
    readings = sum(row["readings"] for row in rows)
    found: Row = {"readings": readings, "unit": rows[0]["unit"], **GIVEN_UP}
    held = [row["held_at"] for row in rows]
    found["held_at"] = None if None in held else sum(held) / len(held)
    for name in ("load", "measured", "base", "with_effects", "with_table"):
        told = [row[name] * row["readings"] for row in rows if row[name] is not None]
        found[name] = sum(told) / readings if len(told) == len(rows) else None
    # of a mean of n readings it is as 1 / sqrt(n)
    found["noise_sd"] = rows[0]["noise_sd"] * float(np.sqrt(rows[0]["readings"] / readings))
    return at | found


def where_rows(found: SearchResult, joints: Sequence[str]) -> list[Row]:
    """Gaps of both models in every way of pooling; ``*`` for what is pooled over."""
    rows = []
    for model, fit in (("base", found.base.fit), ("with_effects", found.final.fit)):
        for place in places(residual_frame(found.base, fit, joints)):
            low, high = place.gap.interval
            rows.append(
                {
                    "by": place.by,
                    **{key: str(place.at.get(key, "*")) for key in KEYS},
                    "readings": place.gap.readings,
                    "model": model,
                    "gap": place.gap.gap,
                    "gap_low": low,
                    "gap_high": high,
                    "rms_residual": place.gap.rms,
                }
            )
    return rows


def candidate_rows(found: SearchResult, needed: float, joints: Sequence[str]) -> list[Row]:
    """What was tried, stage by stage: forms on the screen, then those that were refitted.

    Parameters
    ----------
    needed : log evidence from which a single effect is sure.
    """
    # chi2 of the base beyond noise, kept positive to be divided by
    excess = max(found.base_gap.excess, np.finfo(float).tiny)
    not_fitted = (
        f"not fitted: all that was only looked at holds {found.unfitted:.2f} of the probability"
    )
    rows = []
    for stage in found.stages:
        rows += _screened(stage, joints, excess, not_fitted)
        rows += _refitted(stage, joints, excess)
    return [row | {"threshold": needed} for row in rows]


def _screened(
    stage: SearchStage, joints: Sequence[str], excess: float, not_fitted: str
) -> list[Row]:
    """Rows of the best forms of each effect on a screen."""
    rows = []
    fitted = {one.form for one in stage.refits}
    for one in stage.screen.effects:
        for place, tried in enumerate(one.forms[:MOST_FORMS_SHOWN]):
            scope = _scope(tried.form, joints)
            row = _form_row(f"screen {stage.name}", stage.beside, tried.form, scope)
            row |= {
                "parameters": len(tried.estimate) + len(tried.form.variant.shapes),
                "delta_chi2": tried.explained,
                # the effect's evidence is that of all its forms: on the row of the best
                "log_evidence": one.log_evidence if not place else tried.log_evidence,
                "gap_share": _share(tried.explained, excess),
                "message": NOT_FITTED,
                "decision": FITTED if tried.form in fitted else not_fitted,
            }
            rows.append(row)
    return rows


def _scope(form: CandidateForm, joints: Sequence[str]) -> str:
    """Where a form acts, in words; ``*`` for everywhere."""
    words = [joints[form.joint]] if form.joint is not None else []
    words += [form.specimen] if form.specimen is not None else []
    return " of ".join(words) or "*"


def _form_row(stage: str, beside: Sequence[str], form: CandidateForm, scope: str) -> Row:
    """What is known of a form before it is tried; the rest is empty."""
    return {
        "stage": stage,
        "beside": ", ".join(beside),
        "effect": form.name,
        "kind": form.variant.create().kind,
        "variant": json.dumps(dict(form.variant.options)),
        "spread": form.spread,
        "scope": scope,
        "shape": "{}",
        "parameters": 0,
        "estimate": None,
        "unit": "",
        "log_evidence": None,
        "delta_chi2": None,
        "gap_share": None,
        "absorbed": None,
        "detectable_gap": None,
        "threshold": None,
        "status": Status.CONVERGED,
        "message": "",
        "decision": "",
    }


def _decision(one: Refit, behind: float) -> str:
    """What became of a set of effects that was fitted."""
    if not np.isfinite(one.log_evidence):
        return NO_FIT if one.fit.status or not one.fit.usable else DEGENERATE
    if behind <= 0.0:
        return MOST_PROBABLE
    return f"with it all are {behind:.1f} log odds behind the most probable set"


def _share(drop: float, excess: float) -> float | None:
    """A drop of chi2 over the base's excess; None where that is no more than 1, mere noise.

    The columns call it ``gap_share``: it is a share of the excess, not of its root, the gap.
    """
    return float(drop / excess) if excess > 1.0 else None


def _refitted(stage: SearchStage, joints: Sequence[str], excess: float) -> list[Row]:
    """Rows of the refits of a stage; of those that ended at the same form and shape, the first."""
    rows, seen = [], set()
    for one, behind in zip(stage.refits, stage.behind, strict=True):
        scope = _scope(one.form, joints)
        row = _form_row(f"refit {stage.name}", stage.beside, one.form, scope)
        row |= _of_refit(one, excess) | {"decision": _decision(one, behind)}
        key = (row["effect"], row["variant"], row["spread"], row["scope"], row["shape"])
        if key not in seen:
            seen.add(key)
            rows.append(row)
    return rows


def _of_refit(one: Refit, excess: float) -> Row:
    """Numbers of a refit, in display units; evidence that is not finite stands for none."""
    possible = bool(np.isfinite(one.log_evidence))
    status = Status.CONVERGED if possible and not one.fit.status else Status.NOT_CONVERGED
    row: Row = {
        "log_evidence": one.log_evidence if possible else None,
        "delta_chi2": one.gain if possible else None,
        "gap_share": _share(one.gain, excess) if possible else None,
        "status": status,
        "message": one.fit.status or ("" if possible else DEGENERATE),
    }
    if not one.fit.usable:
        return row
    number = len(one.fit.hypothesis.supposed) - 1  # the form on trial stands behind all others
    own = [u for u in one.fit.hypothesis.unknowns if u.supposed == number]
    values = fitted_values(one.fit, number)
    strengths = [v for v, u in zip(values, own, strict=True) if u.is_strength]
    shapes = {
        v.name: round(v.value, 6) for v, u in zip(values, own, strict=True) if not u.is_strength
    }
    row |= {"shape": json.dumps(shapes), "parameters": len(own)}
    if len(strengths) == 1:
        row |= {"estimate": strengths[0].value, "unit": strengths[0].unit}
    return row


def confusion_rows(told: Distinguishability) -> list[Row]:
    """One row per ordered pair of effects, see `Confusion`."""
    return [
        {
            "effect": one.effect,
            "other": one.other,
            "share": one.share,
            "gap_told_apart": one.gap,
        }
        for one in told.confusions
    ]


def held_out_rows(proof: HeldOut) -> list[Row]:
    """One row per fold, a set of readings that was held out at once.

    ``rms_*`` : root of chi2 over what a right model would leave; ``gap_*`` : what is beyond, noise
    SD, with its 95 % interval. ``surrogate`` : of a model that versions before had, empty.
    """
    rows = []
    for one in proof.folds:
        models = {
            "base": one.base,
            "with_effects": one.with_effects,
            "surrogate": None,
        }
        row: Row = {"fold": one.name, "kind": one.kind, "readings": one.readings}
        for model, gap in models.items():
            row[f"rms_{model}"] = None if gap is None else gap.rms
            row[f"gap_{model}"] = None if gap is None else gap.gap
            ends = (None, None) if gap is None else gap.interval
            row[f"gap_{model}_low"], row[f"gap_{model}_high"] = ends
        row |= {
            "closed": one.closed,
            "gap_closed": None if one.closed is None else share_of_gap(one.closed),
            "worse": one.worse,
            "status": Status.CONVERGED if one.base is not None else Status.NOT_CONVERGED,
            "message": one.message,
        }
        rows.append(row)
    return rows


def imperfection_rows(taken: AbsorbedGap, model: str) -> Iterator[Row]:
    """One row per imperfection, and one per mean over several of a kind.

    ``model`` : whose fit took them up. ``chance`` : how often random errors make as large a mean.
    """
    for one in taken.each:
        yield _size_row(one.at, model, one.size, one.sd) | {
            "taken_chi2": one.chi2,
            "places": 1,
            "chance": None,
            "common": False,
        }
    for mean in taken.common:
        yield _size_row(mean.at, model, mean.size, mean.sd) | {
            "taken_chi2": None,
            "places": mean.count,
            "chance": mean.chance,
            "common": mean.certain,
        }


def _size_row(at: NuisancePlace, model: str, size: float, sd: float) -> Row:
    """Where, and how large: ``size`` and ``sd`` in prior SDs, ``value`` in ``unit``."""
    prior, unit = display_value(at.unit, at.sd)
    return {
        "model": model,
        "specimen": at.specimen,
        "kind": at.kind,
        "component": at.component,
        "joint": at.joint,
        "test": at.test,
        "value": size * prior,
        "unit": unit,
        "prior_sd": prior,
        "in_prior_sds": size,
        "posterior_sd": sd,
    }


def advice_rows(found: Sequence[Advice]) -> list[Row]:
    """One row per subject and run, in the order of the advice.

    Of several with the same subject and run: the first one's numbers, in the place of the last.
    ``subject`` is an effect, two names that are tied, or what has no name; gains are log evidence.
    """
    rows: dict[tuple[str, str], Row] = {}
    # from behind, so that the first of several is written last and stays
    for one in reversed(found):
        rows[one.subject, one.test] = {
            "effect_or_pair": one.subject,
            "test": one.test,
            "cycles": one.cycles,
            "gain_in_log_evidence": one.gain,
            "gain_per_cycle": one.per_cycle,
            "status": one.status,
            "message": one.message,
        }
    return list(rows.values())[::-1]


def advice_csv(rows: Sequence[Row]) -> str:
    """The rows as comma-separated text under the names of the table's columns, to 4 digits."""
    content = io.StringIO()
    names = [column.name for column in NEXT_TESTS.columns]
    writer = csv.DictWriter(content, names, lineterminator="\n")
    writer.writeheader()
    for row in rows:
        values = ((name, row[name]) for name in names)
        writer.writerow({n: f"{v:.4g}" if isinstance(v, float) else v for n, v in values})
    return content.getvalue()
