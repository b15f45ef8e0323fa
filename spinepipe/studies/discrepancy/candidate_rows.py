"""Rows of the table candidates: every effect on every screen, and every refit."""

import json
from collections.abc import Sequence
from typing import Any

import numpy as np

from spinepipe.discrepancy.forms import Form, shape_at
from spinepipe.discrepancy.found import Found, Stage
from spinepipe.discrepancy.refit import Refit
from spinepipe.discrepancy.screen import Tried
from spinepipe.discrepancy.values import border, fitted_values
from spinepipe.effects import Effect
from spinepipe.statics import Status

Row = dict[str, Any]

MOST_FORMS_SHOWN = 5
"""Forms of one effect on a screen that get a row; the others are far behind."""

NOT_FITTED = "the linear problem, no fit"
DEGENERATE = "a shape ran to its bound: no more what its name says"


def candidate_rows(found: Found, joints: Sequence[str]) -> list[Row]:
    """What was tried, stage by stage."""
    excess = max(found.base_gap.excess, np.finfo(float).tiny)
    rows = []
    for stage in found.stages:
        rows += _screened(stage, joints, excess)
        rows += _refitted(stage, joints, excess)
    return rows


def _screened(stage: Stage, joints: Sequence[str], excess: float) -> list[Row]:
    rows = []
    for one in stage.screen.effects:
        for place, tried in enumerate(one.forms[:MOST_FORMS_SHOWN]):
            row = _form_row(f"screen {stage.name}", tried.form, joints)
            row |= _of_screen(tried) | {
                # the effect's evidence is that of all its forms: on the row of the best
                "log_evidence": one.log_evidence if not place else tried.log_evidence,
                "gap_share": _share(tried.explained, excess),
                "threshold": stage.screen.threshold,
                "status": Status.CONVERGED,
                "message": NOT_FITTED,
            }
            rows.append(row)
    return rows


def _of_screen(tried: Tried) -> Row:
    effect = tried.form.variant.create()
    shapes = {
        effect.parameters[column].name: border(
            effect.parameters[column].unit, shape_at(effect.parameters[column], sds)
        )[0]
        for column, sds in zip(tried.form.variant.shapes, tried.sds, strict=True)
    }
    estimate, unit = _estimate(effect, tried)
    return {
        "shape": json.dumps({name: round(value, 6) for name, value in shapes.items()}),
        "parameters": len(tried.estimate) + len(shapes),
        "estimate": estimate,
        "unit": unit,
        "delta_chi2": tried.explained,
    }


def _estimate(effect: Effect, tried: Tried) -> tuple[float | None, str]:
    """A single strength in the unit of tables."""
    if len(tried.estimate) != 1:
        return None, ""
    p = effect.parameters[tried.strengths[0]]
    assert p.off is not None
    away = float(tried.estimate[0]) * p.prior_scale
    value = p.off * float(np.exp(np.clip(away, -50.0, 50.0))) if p.logarithmic else p.off + away
    return border(p.unit, value)


def _refitted(stage: Stage, joints: Sequence[str], excess: float) -> list[Row]:
    rows, seen = [], set()
    for one in stage.refits:
        row = _form_row(f"refit {stage.name}", one.form, joints) | _of_refit(one, excess)
        row["threshold"] = stage.screen.threshold
        key = (row["effect"], row["variant"], row["spread"], row["scope"], row["shape"])
        if key not in seen:
            seen.add(key)
            rows.append(row)
    return rows


def _of_refit(one: Refit, excess: float) -> Row:
    possible = bool(np.isfinite(one.log_evidence))
    status = Status.CONVERGED if possible and not one.fit.status else Status.NOT_CONVERGED
    row: Row = {
        "shape": "{}",
        "parameters": 0,
        "estimate": None,
        "unit": "",
        "log_evidence": one.log_evidence if possible else None,
        "delta_chi2": one.gain if possible else None,
        "gap_share": _share(one.gain, excess) if possible else None,
        "status": status,
        "message": one.fit.status or ("" if possible else DEGENERATE),
    }
    if not one.fit.usable:
        return row
    number = len(one.fit.hypothesis.supposed) - 1
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


def _share(drop: float, excess: float) -> float | None:
    return float(drop / excess) if excess > 1.0 else None


def _form_row(stage: str, form: Form, joints: Sequence[str]) -> Row:
    return {
        "stage": stage,
        "effect": form.name,
        "kind": form.variant.create().kind,
        "variant": json.dumps(dict(form.variant.options)),
        "spread": form.spread,
        "scope": scope_words(form, joints),
        "absorbed": None,
        "detectable_gap": None,
    }


def scope_words(form: Form, joints: Sequence[str]) -> str:
    """Where a form acts, in words; ``*`` for everywhere."""
    words = [joints[form.joint]] if form.joint is not None else []
    words += [form.specimen] if form.specimen is not None else []
    return " of ".join(words) or "*"
