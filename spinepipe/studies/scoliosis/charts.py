"""Figures of scoliotic spines: errors of laws, and what bending films tell of stiffness."""

from collections.abc import Mapping

import numpy as np
import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.report.conclusions import Value
from spinepipe.report.forms.chart import Chart, Key, Panel, saying
from spinepipe.report.forms.curves import Curves, Scatter
from spinepipe.report.forms.heat_map import Shares
from spinepipe.report.forms.look import BASE, FOURTH, MODEL, SOFT, THIRD
from spinepipe.report.forms.rows import Rows
from spinepipe.report.words import capital, count, level
from spinepipe.statistics import mean_of
from spinepipe.studies.scoliosis.conclusions import (
    DECIDING,
    MEASURED,
    NOT_COMPARED,
    NOT_PERSONAL,
    most_moved,
    tried,
)
from spinepipe.studies.scoliosis.errors_compared import FILMS, Compared, LawDifference
from spinepipe.studies.scoliosis.settings import Scoliosis

SHORT = {
    "tangent": "tangent, published",
    "tangent_fitted": "tangent, fitted",
    "linear_regions": "linear, by region",
    "linear_per_segment": "linear, by segment",
    "uniform": "uniform",
}
"""Laws beside an axis."""

LOOKS = {
    "tangent": MODEL,
    "tangent_fitted": THIRD,
    "linear_regions": BASE,
    "linear_per_segment": FOURTH,
    "uniform": SOFT,
}

OF_FILMS = {FILMS["held_out"]: MODEL, FILMS["fitted"]: BASE}

Tables = Mapping[str, pd.DataFrame]


def fitted_and_held_out(study: Scoliosis, cohort: Cohort, tables: Tables) -> Chart:
    """Rotation errors of each law on fitted and on left-out films, over the same spines."""
    title = "Rotation errors of each law"
    groups = [one for one in (Compared.of(tables, g, DECIDING) for g in FILMS) if len(one.same)]
    if not groups:
        return saying(title, "No spine has the poses of all laws: there are no errors to compare.")
    found = [_errors(one).assign(series=one.group_words) for one in groups]
    n = " and ".join(f"{len(one.same)} ({one.group_words})" for one in groups)
    panels: list[Panel] = [
        Rows(
            title="Error",
            x_label="rotation error (°)",
            frame=pd.concat(found),
            looks=OF_FILMS,
            marks=_reading(groups[0]),
        )
    ]
    first = groups[0]
    beside = ""
    if first.verdict not in NOT_COMPARED:
        panels.append(_differences(first, first.laws[0], first.beside_best))
        beside = f" Right: {first.group_words}, hollow: cannot be distinguished."
    caption = f"Mean of the same spines for all laws, n = {n}, with 95 % interval.{beside}"
    keys = [Key(OF_FILMS[one.group_words], one.group_words) for one in groups]
    return Chart(title, panels, caption, keys)


def _errors(compared: Compared) -> pd.DataFrame:
    """A row for each law, the least error first."""
    return pd.DataFrame([_row(SHORT[law], compared.error(law)) for law in compared.laws])


def _row(name: str, value: Value) -> dict[str, object]:
    return {"row": name, "value": value.number, "low": value.low, "high": value.high}


def _reading(compared: Compared) -> dict[float, str]:
    """A mark where reading alone lies."""
    return {} if compared.noise is None else {compared.noise: "reading alone"}


def differences(study: Scoliosis, cohort: Cohort, tables: Tables) -> Chart:
    """How much laws differ on left-out films from one that takes nothing from bending films."""
    title = "Laws against uniform stiffness"
    compared = Compared.of(tables, "held_out", DECIDING)
    if compared.verdict in NOT_COMPARED or NOT_PERSONAL not in compared.laws:
        return saying(title, "There is nothing to compare with uniform stiffness.")
    others = [name for name in compared.laws if name != NOT_PERSONAL]
    found = [compared.difference(NOT_PERSONAL, other) for other in others]
    caption = (
        "Error in rotations on left-out films, less that of uniform stiffness, with 95 % interval "
        "over spines. Hollow: cannot be distinguished."
    )
    return Chart(title, [_differences(compared, NOT_PERSONAL, found)], caption)


def _differences(compared: Compared, law: str, found: list[LawDifference]) -> Rows:
    limit = compared.detectable
    frame = pd.DataFrame(
        [_row(SHORT[one.other], one.margin) | {"hollow": not one.significant} for one in found]
    )
    ends = [*frame["value"], *frame["low"].dropna(), *frame["high"].dropna(), 0.0]
    ends += [] if limit is None else [limit, -limit]
    room = 0.06 * (max(ends) - min(ends)) or 1.0
    return Rows(
        title=f"against {SHORT[law]}",
        x_label="difference of errors (°)",
        frame=frame,
        marks={} if limit is None else {limit: "detectable", -limit: ""},
        looks={"": MODEL},
        x_limits=(min(ends) - room, max(ends) + room),
    )


def other_errors(study: Scoliosis, cohort: Cohort, tables: Tables) -> Chart:
    """Errors of places, tilts and clinical angles on left-out films, a panel for each."""
    title = "Other errors on left-out films"
    every = [(words, Compared.of(tables, "held_out", name)) for name, words in MEASURED.items()]
    found = [(words, one) for words, one in every if len(one.same)]
    panels = []
    for words, one in found:
        frame = _errors(one)
        most = float(np.nanmax(frame[["value", "high"]].to_numpy(float)))
        panel = Rows(
            title=capital(words),
            x_label=f"error ({one.sign})",
            frame=frame,
            looks={"": MODEL},
            marks=_reading(one),
            x_limits=(0.0, 1.12 * most or 1.0),
        )
        panels.append(panel)
    if not panels:
        return saying(title, "No spine has the poses of all laws on left-out films.")
    n = max(len(one.same) for _, one in found)
    caption = f"Symbol: mean of the same spines (up to {n}); line: 95 % interval."
    return Chart(title, panels, caption)


def identifiable_ratios(study: Scoliosis, cohort: Cohort, tables: Tables) -> Chart:
    """Of how many spines bending films bound a segment's stiffness ratio."""
    title = "Stiffness ratios that bending films bound"
    laws = tables["laws"]
    asked = laws[laws["identifiable"].notna()]
    if asked.empty:
        return saying(title, "The study does not ask which ratios bending films bound.")
    both = asked["identifiable"].astype(bool)
    neither = asked["open_below"].astype(bool) & asked["open_above"].astype(bool)
    names = {"both ends": both, "one end": ~both & ~neither, "neither": neither}
    shares = pd.DataFrame({name: flags.astype(float) for name, flags in names.items()})
    shares = shares.groupby(asked["joint"].astype(str), sort=False).mean()[::-1]
    frame = shares.rename(index=level).rename_axis("row").reset_index()
    frame = frame.melt("row", var_name="series", value_name="share")
    looks = dict(zip(names, (MODEL, THIRD, SOFT), strict=True))
    keys = [Key(look, name) for name, look in looks.items()]
    caption = (
        f"Share of {count(asked['specimen'].nunique(), 'spine')} whose films bound the ratio of a "
        "segment on both sides, on one or on neither, the fitted tangent's 95 % region."
    )
    panel = Shares(x_label="share of spines (%)", frame=frame, looks=looks, width=400.0)
    return Chart(title, [panel], caption, keys)


def enlargement(study: Scoliosis, cohort: Cohort, tables: Tables) -> Chart:
    """Errors of the published tangent over the enlargement of its ends."""
    title = "Enlargement of the ends"
    parts = []
    for group, films in FILMS.items():
        errors = tried(tables["variants"], "enlargement", group)
        means = [mean_of(errors[value].to_numpy(float)) for value in errors]
        ends = [one.interval or (one.value, one.value) for one in means]
        part = {"x": errors.columns.to_numpy(float), "y": [one.value for one in means]}
        part |= {"y_low": [low for low, _ in ends], "y_high": [high for _, high in ends]}
        parts.append(pd.DataFrame(part).assign(series=films))
    frame = pd.concat([part for part in parts if len(part)] or parts)
    if frame.empty:
        return saying(title, "Nothing was varied, or no spine has poses at all values.")
    panel = Curves(
        x_label="ends beyond the bending films (%)",
        y_label="rotation error (°)",
        frame=frame,
        looks=OF_FILMS,
        points=tuple(OF_FILMS),
        zeros=False,
        y_limits=(0.0, 1.1 * float(frame["y_high"].max()) or 1.0),
    )
    caption = "Published tangent, mean over the same spines at all values, with 95 % interval."
    return Chart(title, [panel], caption, [Key(look, films) for films, look in OF_FILMS.items()])


def scale(study: Scoliosis, cohort: Cohort, tables: Tables) -> Chart:
    """How far segments turn where all lateral stiffness is multiplied, and the law's own error."""
    title = "Size of stiffness"
    rows = tables["variants"]
    rows = rows[rows["varied"] == "scale"].dropna(subset=["moved_deg"])
    found = most_moved(tables)
    if found is None:
        return saying(title, "The size of stiffness was not varied, or no spine has poses.")
    names = {flag: FILMS["fitted" if flag else "held_out"] for flag in (False, True)}
    most = rows.groupby(["fitted", "value"])["moved_deg"].max().reset_index()
    frame = most.rename(columns={"value": "x", "moved_deg": "y"})
    frame["series"] = frame["fitted"].map(names)
    compared, _, error = found
    panel = Scatter(
        x_label="lateral stiffness, times",
        y_label="largest change of a rotation (°)",
        frame=frame,
        looks=OF_FILMS,
        limits={error.number: f"own error, {compared.group_words}"},
        x_log=True,
    )
    caption = "Published tangent, all other rotations unchanged: largest change of any segment."
    return Chart(title, [panel], caption, [Key(look, films) for films, look in OF_FILMS.items()])
