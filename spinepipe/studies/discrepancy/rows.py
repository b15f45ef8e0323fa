"""Rows of the tables where and gap: gaps pooled in every way, and every reading."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from spinepipe.discrepancy.found import Found
from spinepipe.discrepancy.readings import SpecimenReadings
from spinepipe.discrepancy.where import KEYS, Place, places, residual_frame
from spinepipe.effects.contract import Array
from spinepipe.units import BORDER_PER_SI, COORDINATE_UNITS, COORDINATES

Row = dict[str, Any]


def where_rows(found: Found, joints: Sequence[str]) -> list[Row]:
    """Gaps of both models in every way of pooling."""
    return [
        _place_row(place, model)
        for model, fit in (("base", found.base.fit), ("with_effects", found.final.fit))
        for place in places(residual_frame(found.base, fit, joints))
    ]


def _place_row(place: Place, model: str) -> Row:
    low, high = place.gap.interval
    at = {key: str(place.at.get(key, "*")) for key in KEYS}
    return {
        "by": place.by,
        **at,
        "readings": place.gap.readings,
        "model": model,
        "gap": place.gap.gap,
        "gap_low": low,
        "gap_high": high,
        "rms_residual": place.gap.rms,
    }


def gap_rows(
    found: Found,
    joints: Sequence[str],
    held_out: Mapping[str, Sequence[tuple[Array, Array, Array]]],
) -> list[Row]:
    """Every reading with both models; tests of one name with several load histories averaged.

    Parameters
    ----------
    held_out : by specimen, per load history (T, J, 6): fold, base and with effects held out.
    """
    collected: dict[tuple[Any, ...], list[Row]] = {}
    for name, readings in found.base.readings.items():
        for key, row in _rows_of(found, name, readings, joints, held_out.get(name)):
            collected.setdefault(key, []).append(row)
    return [_averaged(key, rows) for key, rows in collected.items()]


def _rows_of(
    found: Found,
    name: str,
    readings: SpecimenReadings,
    joints: Sequence[str],
    held_out: Sequence[tuple[Array, Array, Array]] | None,
) -> Iterator[tuple[tuple[Any, ...], Row]]:
    noise = found.base.noise
    base, final = found.base.fit.predicted[name], found.final.fit.predicted[name]
    for number, test in enumerate(readings.tests):
        size = np.sqrt(np.diagonal(noise.correlations(len(test.count))))  # zeroing adds to the SD
        sd = size[:, None] * noise.sd * BORDER_PER_SI
        for t, j, c in zip(*np.nonzero(test.count), strict=True):
            factor, count = BORDER_PER_SI[c], int(test.count[t, j, c])
            fold, out_base, out_final = ("", None, None)
            if held_out is not None:
                folds, of_base, of_final = held_out[number]
                if folds[t, j, c]:
                    fold = str(folds[t, j, c])
                    out_base = float(of_base[t, j, c] * factor)
                    out_final = float(of_final[t, j, c] * factor)
            key = (name, test.case.test, test.case.steps[t].step, joints[j], COORDINATES[c])
            yield (
                key,
                {
                    "measured": float(test.mean[t, j, c] * factor),
                    "readings": count,
                    "base": float(base[number][t, j, c] * factor),
                    "with_effects": float(final[number][t, j, c] * factor),
                    "noise_sd": float(sd[t, c] / np.sqrt(count)),
                    "held_out_fold": fold,
                    "held_out_base": out_base,
                    "held_out_with_effects": out_final,
                },
            )


def _averaged(key: tuple[Any, ...], rows: Sequence[Row]) -> Row:
    """One row of those that several load histories of a test have at a place."""
    at = dict(zip(KEYS, key, strict=True)) | {"unit": COORDINATE_UNITS[key[-1]]}
    if len(rows) == 1:
        return at | rows[0]
    readings = sum(row["readings"] for row in rows)
    found: Row = {"readings": readings}
    for name in ("measured", "base", "with_effects"):
        found[name] = sum(row[name] * row["readings"] for row in rows) / readings
    found["noise_sd"] = rows[0]["noise_sd"] * float(np.sqrt(rows[0]["readings"] / readings))
    same = len({row["held_out_fold"] for row in rows}) == 1 and rows[0]["held_out_fold"]
    found["held_out_fold"] = rows[0]["held_out_fold"] if same else ""
    for name in ("held_out_base", "held_out_with_effects"):
        values = [row[name] * row["readings"] for row in rows] if same else []
        found[name] = sum(values) / readings if values else None
    return at | found
