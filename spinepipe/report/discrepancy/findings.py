"""What else a reader should know, in a few sentences."""

from collections.abc import Iterator

import pandas as pd

from spinepipe.report.discrepancy.verdict import Answer, Verdict
from spinepipe.report.discrepancy.words import axis, estimate_of, listed, plain
from spinepipe.report.page.results import Results
from spinepipe.report.words import count, fixed, number

_MOST_PLACES = 3


def warnings(verdict: Verdict) -> tuple[str, ...]:
    """Readings that look like errors of the data, which no effect of a model explains."""
    return tuple(
        f"Look at the data first: {one.where}: {one.what}"
        + (f" ({one.evidence})." if one.evidence else ".")
        for one in verdict.suspicions
    )


def findings(verdict: Verdict, results: Results) -> list[str]:
    """The sentences, without those that there is nothing to say for."""
    told = [
        *_sizes(verdict),
        _reason(verdict),
        _where(results.table("where")),
        _not_testable(verdict),
        _noise(verdict),
    ]
    return [sentence.replace(" %", "\u00a0%") for sentence in told if sentence]


def _sizes(verdict: Verdict) -> Iterator[str]:
    """How large each named effect is."""
    for effect in verdict.effects:
        sizes = [estimate_of(parameter) for parameter in effect.parameters]
        if sizes:
            name = plain(effect.name)
            more = " (more in table 1)" if len(sizes) > 4 else ""
            yield f"{name[:1].upper()}{name[1:]}: {', '.join(sizes[:4])}{more}."


def _reason(verdict: Verdict) -> str:
    why = verdict.why.strip().rstrip(".")
    told = [f"Why: {why}."] if why else []
    if verdict.detected_from:
        told.append(f"Detected from: {plain(verdict.detected_from).rstrip('.')}.")
    return " ".join(told)


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
        f"{row['joint']}, {axis(row['coordinate'])}, {plain(row['test'])}: "
        f"{fixed(row['gap'], 1)} ({fixed(row['gap_low'], 1)} to {fixed(row['gap_high'], 1)})"
        for row in ordered.head(_MOST_PLACES).to_dict("records")
    ]
    total = f"{len(rows)} of {count(int(chosen.sum()), 'place')}"
    return (
        f"Where the base is off (gap in noise SD, 95 % interval): {'; '.join(places)}. "
        f"The gap is above the noise at {total}."
    )


def _not_testable(verdict: Verdict) -> str:
    names = [plain(one.name) for one in verdict.not_testable]
    if not names:
        return ""
    told = f"These tests cannot show {listed(names, 8, 'or')}"
    if verdict.answer is Answer.NULL:
        return f"{told}: nothing is said about them."
    return f"{told}; a table below says what would."


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
