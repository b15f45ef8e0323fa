"""The verdict as plain data, in the keys of the result format.

The verdict of a search for missing effects.

Read the verdict of a search from its JSON file.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.studies.discrepancy.design.told_apart import ToldApart
from spinepipe.studies.discrepancy.proof.held_out import HeldOut
from spinepipe.studies.discrepancy.search.gaps import Gap, Place, worst
from spinepipe.studies.discrepancy.search.hypothesis import Form
from spinepipe.studies.discrepancy.search.inquiry import Found, Standing
from spinepipe.studies.discrepancy.search.investigation import Investigation
from spinepipe.studies.discrepancy.search.model_files import fitted_values
from spinepipe.studies.discrepancy.search.noise import Noise as FittedNoise
from spinepipe.studies.discrepancy.search.outcome import Outcome
from spinepipe.studies.discrepancy.search.outcome import Verdict as Ending
from spinepipe.studies.discrepancy.search.screen import LEAST_THRESHOLD
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


def noise_data(noise: FittedNoise) -> Data:
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
    if ended.verdict is not Ending.UNKNOWN:
        return None
    largest = worst(places, 3)
    where = "; ".join(
        f"{p.at['joint']}, {str(p.at['coordinate']).replace('_', ' ')}, test {p.at['test']} "
        f"(gap {p.gap.gap:.1f})"
        for p in largest
    )
    return {"where": where or "no single place stands out", "shape": _shape(found)}


class Answer(StrEnum):
    """What the search came to."""

    NAMED = "NAMED"
    SET = "SET"
    NULL = "NULL"
    UNKNOWN = "UNKNOWN"


@dataclass(frozen=True)
class Estimate:
    """A parameter with its 95 % interval, both None where there is none.

    Attributes
    ----------
    name : with the places it is of behind it: ``width@L4L5@s01``.
    at_bound : whether it ended at a bound, and its value says no more than that.
    """

    name: str
    value: float | None
    unit: str
    low: float | None
    high: float | None
    at_bound: bool = False


@dataclass(frozen=True)
class Rival:
    """Another name, and by how much log evidence it is behind."""

    name: str
    margin: float | None


@dataclass(frozen=True)
class Missing:
    """An effect that is missing, or one that may be.

    Attributes
    ----------
    scope : joints, coordinates, specimens and tests; ``*`` stands for all.
    log_evidence : against the model without it, None where it was not told.
    options : of its variant, in words, but for its coordinates. spread : how values may differ.
    """

    name: str
    kind: str
    scope: Mapping[str, tuple[str, ...]]
    parameters: tuple[Estimate, ...]
    log_evidence: float | None
    rivals: tuple[Rival, ...]
    options: tuple[str, ...] = ()
    spread: str = ""


@dataclass(frozen=True)
class NotTestable:
    """An effect that these tests cannot show, why, and the test that would."""

    name: str
    why: str
    test_that_would_tell: str


@dataclass(frozen=True)
class Detectable:
    """The smallest gap, noise SD, at which an effect would be named."""

    name: str
    gap: float


@dataclass(frozen=True)
class Suspicion:
    """Readings that look like an error of the data."""

    where: str
    what: str
    evidence: str


@dataclass(frozen=True)
class Before:
    """One measure of the misfit in noise SD: of fits and held out, before and with the effects."""

    base: float | None
    with_effects: float | None
    held_out_base: float | None
    held_out_with_effects: float | None
    held_out_closed: float | None


@dataclass(frozen=True)
class Noise:
    """What counts as noise, and how that is known: from repeats, or declared."""

    source: str
    rotation_sd_deg: float | None
    translation_sd_mm: float | None
    serial_correlation: float | None


@dataclass(frozen=True)
class Verdict:
    """All that a search says in a few words; see docs/studies/discrepancy.md."""

    cohort: str
    answer: Answer
    why: str
    effects: tuple[Missing, ...]
    candidates: tuple[Missing, ...]
    not_testable: tuple[NotTestable, ...]
    smallest_detectable: tuple[Detectable, ...]
    suspicions: tuple[Suspicion, ...]
    noise: Noise
    rms_residual: Before
    gap: Before
    unknown_where: str
    unknown_shape: str
    threshold: float | None
    false_alarm: float | None
    draws: int | None
    detected_from: str

    @property
    def named(self) -> tuple[str, ...]:
        """Names of the effects that are missing for certain."""
        return tuple(effect.name for effect in self.effects)

    @property
    def in_set(self) -> tuple[str, ...]:
        """Names of those that cannot be told apart, each once."""
        return tuple(dict.fromkeys(one.name for one in self.candidates))


Told = Mapping[str, Any]

_COORDINATES = ("coordinate", "pair")
"""Options that the scope says as well."""


def read_verdict(path: str | Path) -> Verdict:
    """Read ``verdict.json``; keys beyond cohort and verdict may be missing."""
    return verdict_of(json.loads(Path(path).read_text(encoding="utf-8")))


def verdict_of(data: Told) -> Verdict:
    """The verdict as plain data hold it."""
    unknown, threshold = _part(data, "unknown"), _part(data, "threshold")
    noise, draws = _part(data, "noise"), threshold.get("draws")
    return Verdict(
        cohort=str(data["cohort"]),
        answer=Answer(data["verdict"]),
        why=_text(data.get("why")),
        effects=tuple(_missing(one) for one in _list(data, "effects")),
        candidates=tuple(_missing(one) for one in _list(data, "candidates_in_set")),
        not_testable=tuple(
            NotTestable(one["name"], _text(one.get("why")), _text(one.get("test_that_would_tell")))
            for one in _list(data, "not_testable")
        ),
        smallest_detectable=tuple(
            Detectable(one["name"], float(one["gap"]))
            for one in _list(data, "smallest_detectable")
            if one.get("gap") is not None
        ),
        suspicions=tuple(
            Suspicion(*(_text(one.get(key)) for key in ("where", "what", "evidence")))
            for one in _list(data, "suspected_data_errors")
        ),
        noise=Noise(
            _text(noise.get("source")),
            _number(noise, "rotation_sd_deg"),
            _number(noise, "translation_sd_mm"),
            _number(noise, "serial_correlation"),
        ),
        rms_residual=_before(_part(data, "rms_residual")),
        gap=_before(_part(data, "gap")),
        unknown_where=_text(unknown.get("where")),
        unknown_shape=_text(unknown.get("shape")),
        threshold=_number(threshold, "log_evidence"),
        false_alarm=_number(threshold, "false_alarm"),
        draws=None if draws is None else int(draws),
        detected_from=_text(data.get("detected_from")),
    )


def _part(data: Told, key: str) -> Told:
    return data.get(key) or {}


def _list(data: Told, key: str) -> Sequence[Any]:
    return data.get(key) or []


def _number(data: Told, key: str) -> float | None:
    value = data.get(key)
    return None if value is None else float(value)


def _text(value: Any) -> str:
    """Text as it is, several as a list in words, nothing as nothing."""
    if isinstance(value, list | tuple):
        return ", ".join(map(str, value))
    return "" if value is None else str(value)


def _before(data: Told) -> Before:
    names = ("base", "with_effects", "held_out_base", "held_out_with_effects", "held_out_closed")
    return Before(*(_number(data, name) for name in names))


def _missing(data: Told | str) -> Missing:
    """An effect as the verdict has it: with all that is known of it, or its name alone."""
    if isinstance(data, str):
        return Missing(data, "", {}, (), None, ())
    scope = {
        str(key): tuple(map(str, names)) if isinstance(names, list | tuple) else (str(names),)
        for key, names in _part(data, "scope").items()
    }
    return Missing(
        name=str(data["name"]),
        kind=_text(data.get("kind")),
        scope=scope,
        parameters=tuple(_estimate(one) for one in _list(data, "parameters")),
        log_evidence=_number(data, "log_evidence"),
        rivals=tuple(
            Rival(str(one["name"]), _number(one, "log_evidence_margin"))
            for one in _list(data, "rivals")
        ),
        options=tuple(
            str(value) for key, value in _part(data, "variant").items() if key not in _COORDINATES
        ),
        spread=_text(data.get("spread")),
    )


def _estimate(data: Told) -> Estimate:
    low, high = data.get("ci95") or (None, None)
    return Estimate(
        name=str(data["name"]),
        value=_number(data, "value"),
        unit=_text(data.get("unit")),
        low=None if low is None else float(low),
        high=None if high is None else float(high),
        at_bound=bool(data.get("at_bound", False)),
    )
