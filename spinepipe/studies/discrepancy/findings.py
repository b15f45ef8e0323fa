"""What else a reader should know, in a few sentences."""

from collections.abc import Iterator

import pandas as pd

from spinepipe.report.discrepancy.limits import (
    confused,
    imitating,
    not_testable,
    would_have_been_seen,
)
from spinepipe.report.discrepancy.verdict import Verdict
from spinepipe.report.discrepancy.words import (
    axis,
    called,
    capital,
    differing,
    estimate_of,
    plain,
    readable,
)
from spinepipe.report.page.results import Results
from spinepipe.report.words import count, fixed, number

_MOST_PLACES, _MOST_SIZES = 3, 4
_BY_CHANCE = 0.025
"""Of places with noise alone, the share whose 95 % interval lies above it."""

NUISANCES = (
    "Gaps allow for small errors of posture, frames, joint centres and loads (the study's "
    "nuisances). Model files, and the figure of the gap along the load, do not have them."
)


def warnings(verdict: Verdict) -> tuple[str, ...]:
    """Readings that look like errors of the data, which no effect of a model explains."""
    return tuple(
        f"Look at the data first: {readable(one.where)}: {readable(one.what)}"
        + (f" ({readable(one.evidence)})." if one.evidence else ".")
        for one in verdict.suspicions
    )


def findings(verdict: Verdict, results: Results) -> list[str]:
    """The sentences, without those that there is nothing to say for."""
    told = [
        *_sizes(verdict),
        would_have_been_seen(verdict),
        _before_and_after(results.table("where")),
        _where(results.table("where")),
        confused(verdict, results.table("confusions")),
        imitating(verdict, results.table("candidates")),
        _detected_from(verdict),
        not_testable(verdict),
        _noise(verdict),
    ]
    said = [sentence.replace(" %", "\u00a0%") for sentence in told if sentence]
    return [*said, NUISANCES] if said else []


def _sizes(verdict: Verdict) -> Iterator[str]:
    """How large each named effect is."""
    for effect in verdict.effects:
        sizes = [estimate_of(parameter) for parameter in effect.parameters]
        if sizes:
            more = " (more in table 1)" if len(sizes) > _MOST_SIZES else ""
            spread = f"; {differing(effect)}" if differing(effect) else ""
            told = ", ".join(sizes[:_MOST_SIZES])
            yield f"{capital(called(effect))}: {told}{more}{spread}."


def _detected_from(verdict: Verdict) -> str:
    told = readable(verdict.detected_from).rstrip(".")
    return f"Detected from: {told}." if told else ""


def _before_and_after(where: pd.DataFrame) -> str:
    """The gap over all readings, without and with the effects."""
    rows = where[(where["by"] == "all") & where["gap"].notna()] if len(where) else where
    sizes = {
        row["model"]: f"{fixed(row['gap'])} ({fixed(row['gap_low'])} to {fixed(row['gap_high'])})"
        for row in rows.to_dict("records")
    }
    if "base" not in sizes:
        return ""
    told = f"Gap over all readings, in noise SD (95 % interval): {sizes['base']} with the base"
    after = sizes.get("with_effects", sizes["base"])
    return f"{told}." if after == sizes["base"] else f"{told}, {after} with the effects."


def _where(where: pd.DataFrame) -> str:
    """The places of the largest gap of the base that is above the noise."""
    if where.empty:
        return ""
    chosen = (where["by"] == "joint x coordinate x test") & (where["model"] == "base")
    rows = where[chosen & (where["gap_low"] > 0.0)]
    if rows.empty:
        return "Base model and measurement agree within the noise at every joint in every test."
    ordered = rows.sort_values("gap", ascending=False, kind="stable")
    places = [
        f"{row['joint']} in {axis(row['coordinate'])}, test {plain(row['test'])}: "
        f"{fixed(row['gap'], 1)} ({fixed(row['gap_low'], 1)} to {fixed(row['gap_high'], 1)})"
        for row in ordered.head(_MOST_PLACES).to_dict("records")
    ]
    total = f"{len(rows)} of {count(int(chosen.sum()), 'place')}"
    chance = fixed(_BY_CHANCE * float(chosen.sum()), 0)
    return (
        f"Where the base is off most (gap in noise SD, 95 % interval): {'; '.join(places)}. "
        f"The gap is above the noise at {total}; noise alone would do that at about {chance}."
    )


def _noise(verdict: Verdict) -> str:
    noise = verdict.noise
    if not noise.source:
        return ""
    sds = ((noise.rotation_sd_deg, "°"), (noise.translation_sd_mm, " mm"))
    told = [f"{number(value, 2)}{unit}" for value, unit in sds if value is not None]
    size = f" SD of one reading {' and '.join(told)}" if told else ""
    if noise.source == "declared":
        return f"Noise:{size}, as declared: no cycle was repeated, so all hangs on that number."
    serial = noise.serial_correlation
    along = f", correlation from step to step {fixed(serial)}" if serial is not None else ""
    return f"Noise:{size}, from repeated cycles{along}."
