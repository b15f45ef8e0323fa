"""Read the verdict of a search from its JSON file."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from spinepipe.report.discrepancy.verdict import (
    Answer,
    Before,
    Detectable,
    Estimate,
    Missing,
    Noise,
    NotTestable,
    Rival,
    Suspicion,
    Verdict,
)

Data = Mapping[str, Any]

_COORDINATES = ("coordinate", "pair")
"""Options that the scope says as well."""


def read_verdict(path: str | Path) -> Verdict:
    """Read ``verdict.json``; keys beyond cohort and verdict may be missing."""
    return verdict_of(json.loads(Path(path).read_text(encoding="utf-8")))


def verdict_of(data: Data) -> Verdict:
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


def _part(data: Data, key: str) -> Data:
    return data.get(key) or {}


def _list(data: Data, key: str) -> Sequence[Any]:
    return data.get(key) or []


def _number(data: Data, key: str) -> float | None:
    value = data.get(key)
    return None if value is None else float(value)


def _text(value: Any) -> str:
    """Text as it is, several as a list in words, nothing as nothing."""
    if isinstance(value, list | tuple):
        return ", ".join(map(str, value))
    return "" if value is None else str(value)


def _before(data: Data) -> Before:
    names = ("base", "with_effects", "held_out_base", "held_out_with_effects", "held_out_closed")
    return Before(*(_number(data, name) for name in names))


def _missing(data: Data | str) -> Missing:
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


def _estimate(data: Data) -> Estimate:
    low, high = data.get("ci95") or (None, None)
    return Estimate(
        name=str(data["name"]),
        value=_number(data, "value"),
        unit=_text(data.get("unit")),
        low=None if low is None else float(low),
        high=None if high is None else float(high),
        at_bound=bool(data.get("at_bound", False)),
    )
