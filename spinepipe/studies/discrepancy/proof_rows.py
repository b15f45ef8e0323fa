"""Rows of the tables held_out and confusions, and what was held out of each reading."""

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from spinepipe.discrepancy.design.told_apart import ToldApart
from spinepipe.discrepancy.gaps import Gap
from spinepipe.discrepancy.proof.held_out import FoldRow, HeldOut
from spinepipe.effects.contract import Array
from spinepipe.jobs.discrepancy.verdict import against_expected
from spinepipe.statics import Status
from spinepipe.tables.discrepancy import NOT_TESTABLE

Row = dict[str, Any]


def held_out_rows(proof: HeldOut) -> list[Row]:
    """One row per fold."""
    return [_fold_row(row) for row in proof.folds]


def _fold_row(row: FoldRow) -> Row:
    return {
        "fold": row.name,
        "kind": row.kind,
        "readings": row.readings,
        "rms_base": _rms(row.base, row.expected),
        "rms_with_effects": _rms(row.with_effects, row.expected),
        "rms_surrogate": _rms(row.surrogate, row.expected),
        "closed": row.closed,
        "status": Status.CONVERGED if row.base is not None else Status.NOT_CONVERGED,
        "message": row.message,
    }


def _rms(gap: Gap | None, expected: float) -> float | None:
    sized = against_expected(gap, expected)
    return None if sized is None else sized.rms


def held_out_readings(
    proof: HeldOut,
) -> Mapping[str, Sequence[tuple[Array, Array, Array]]]:
    """By specimen and load history: fold's name, base and with effects (T, J, 6), SI."""
    names = np.array([*(row.name for row in proof.folds), ""])
    return {
        specimen: [
            (names[fold], base, final)
            for fold, base, final in zip(m.fold, m.base, m.with_effects, strict=True)
        ]
        for specimen, m in proof.motion.items()
    }


def confusion_rows(told: ToldApart) -> list[Row]:
    """One row per pair of effects."""
    return [
        {"effect": one.effect, "other": one.other, "share": float(np.clip(one.share, 0.0, 1.0))}
        for one in told.confusions
    ]


def design_rows(told: ToldApart) -> list[Row]:
    """Rows of the table candidates: what the tests could tell of each effect."""
    return [
        {
            "stage": "design",
            "effect": one.effect,
            "kind": one.best.form.variant.create().kind,
            "variant": json.dumps(dict(one.best.form.variant.options)),
            "spread": one.best.form.spread,
            "scope": "*",
            "shape": "{}",
            "parameters": len(one.best.mean),
            "estimate": None,
            "unit": "",
            "log_evidence": None,
            "delta_chi2": None,
            "gap_share": None,
            "absorbed": float(np.clip(one.absorbed, 0.0, 1.0)),
            "detectable_gap": one.detectable.gap if one.detectable else None,
            "threshold": None,
            "status": Status.CONVERGED if one.testable else NOT_TESTABLE,
            "message": one.why,
        }
        for one in told.judgements
    ]
