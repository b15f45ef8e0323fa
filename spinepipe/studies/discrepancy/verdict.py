"""The verdict as plain data, in the keys of the result format."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.discrepancy.design.told_apart import ToldApart
from spinepipe.discrepancy.forms import Form
from spinepipe.discrepancy.found import Found, Standing
from spinepipe.discrepancy.gaps import Gap
from spinepipe.discrepancy.investigation import Investigation
from spinepipe.discrepancy.noise import Noise
from spinepipe.discrepancy.outcome import Outcome, Verdict
from spinepipe.discrepancy.proof.held_out import HeldOut
from spinepipe.discrepancy.screen import LEAST_THRESHOLD
from spinepipe.discrepancy.values import fitted_values
from spinepipe.discrepancy.where import Place, worst
from spinepipe.units import BORDER_PER_SI, ROTATIONS

Data = dict[str, Any]

EVERY = ["*"]
MOST_RIVALS = 5


def verdict_data(
    cohort: Cohort,
    investigation: Investigation,
    told: ToldApart,
    places: Sequence[Place],
    false_alarm: float,
) -> Data:
    """All keys of ``verdict.json``."""
    found, proof, ended = investigation.found, investigation.proof, investigation.ended
    screen = found.stages[0].screen
    return {
        "cohort": cohort.name,
        "verdict": ended.verdict.value,
        "why": ended.why,
        "effects": [_effect(found, one, cohort) for one in ended.named],
        "candidates_in_set": list(ended.tied),
        "not_testable": [vars(one) for one in told.not_testable],
        "noise": noise_data(found.base.noise),
        "rms_residual": {"unit": "noise sd", **_pairs(found, proof, "rms")},
        "gap": {"unit": "noise sd", **_pairs(found, proof, "gap"), "held_out_closed": proof.closed},
        "smallest_detectable": [vars(one) for one in told.smallest_detectable],
        "unknown": _unknown(found, ended, places),
        "suspected_data_errors": [vars(one) for one in investigation.errors],
        "threshold": {
            "log_evidence": screen.threshold,
            "false_alarm": false_alarm,
            "draws": screen.draws,
        },
        "families": [list(one) for one in told.families],
    }


def _effect(found: Found, one: Standing, cohort: Cohort) -> Data:
    number = next(k for k, standing in enumerate(found.standing) if standing is one)
    variant = one.supposed.form.variant
    return {
        "name": one.name,
        "kind": variant.create().kind.value,
        "scope": _scope(one.supposed.form, cohort),
        "variant": dict(variant.options),
        "spread": one.supposed.form.spread.value,
        "parameters": [
            {
                "name": "@".join([value.name, *value.place]),
                "value": value.value,
                "unit": value.unit,
                "ci95": [value.low, value.high],
                "at_bound": value.at_bound,
            }
            for value in fitted_values(found.final.fit, number)
        ],
        "log_evidence": one.log_evidence,
        "rivals": [
            {"name": rival.name, "log_evidence_margin": rival.margin}
            for rival in one.rivals[:MOST_RIVALS]
        ],
    }


def _scope(form: Form, cohort: Cohort) -> Data:
    options = dict(form.variant.options)
    coordinate = options.get("coordinate")
    if coordinate is None:
        coordinates = list(options.get("pair", EVERY))
    else:
        coordinates = list(ROTATIONS) if coordinate == "rotations" else [coordinate]
    return {
        "joints": EVERY if form.joint is None else [cohort.joint_names[form.joint]],
        "coordinates": coordinates,
        "specimens": EVERY if form.specimen is None else [form.specimen],
    }


def noise_data(noise: Noise) -> Data:
    """SDs of one reading in the units of tables, and how they are known."""
    sd = noise.sd * BORDER_PER_SI
    data: Data = {"source": noise.source}
    for name, part in (("rotation_sd_deg", sd[3:]), ("translation_sd_mm", sd[:3])):
        read = part[np.isfinite(part)]
        data[name] = float(np.sqrt(np.mean(read**2))) if len(read) else None
    return data | {"serial_correlation": noise.correlation, "outliers_left_out": noise.outliers}


def _pairs(found: Found, proof: HeldOut, name: str) -> Data:
    """In sample and held out, base and with effects."""
    gaps = {
        "base": found.base_gap,
        "with_effects": found.final_gap,
        "held_out_base": against_expected(proof.base, proof.expected),
        "held_out_with_effects": against_expected(proof.with_effects, proof.expected),
    }
    return {key: _size(gap, name) for key, gap in gaps.items()}


def against_expected(gap: Gap | None, expected: float) -> Gap | None:
    """A held-out gap beside what a right model leaves: noise, and nuisances left open."""
    return None if gap is None else Gap(gap.chi2, expected, gap.readings)


def _size(gap: Gap | None, name: str) -> float | None:
    return None if gap is None else float(getattr(gap, name))


def _shape(found: Found) -> str | None:
    """What the generic basis finds missing, None where it has no evidence."""
    evident = found.lack.log_evidence > max(LEAST_THRESHOLD, found.generic_threshold)
    return found.lack.shape if evident else None


def _unknown(found: Found, ended: Outcome, places: Sequence[Place]) -> Data | None:
    if ended.verdict is not Verdict.UNKNOWN:
        return None
    largest = worst(places, 3)
    where = "; ".join(
        f"{p.at['joint']}, {str(p.at['coordinate']).replace('_', ' ')}, test {p.at['test']} "
        f"(gap {p.gap.gap:.1f})"
        for p in largest
    )
    return {"where": where or "no single place stands out", "shape": _shape(found)}
