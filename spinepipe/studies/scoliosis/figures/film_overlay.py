"""Figure: vertebrae on films of three patients, and the models held in these films."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from spinepipe.cohort import Cohort
from spinepipe.effects.contract import Array
from spinepipe.report.panels import explain_marks
from spinepipe.report.style import BLACK, GREY, WHITE, blank, note, saying
from spinepipe.report.words import capital, fixed, number, plain, short
from spinepipe.studies.scoliosis.errors import held_out_error
from spinepipe.studies.scoliosis.figures.line_styles import STYLES, axis_lines, key_of_lines
from spinepipe.studies.scoliosis.films import ERECT, HELD_OUT, LEFT, RIGHT, Film, read_films
from spinepipe.studies.scoliosis.settings import Scoliosis
from spinepipe.studies.scoliosis.words import in_order
from spinepipe.units import MM_PER_M

MOST_POSITIONS = 4
RANKS = (0.0, 0.5, 1.0)
"""Patients that are shown, by the rank of their error from the smallest to the largest."""

_ROW_MM, _ABOVE_MM, _KEY_MM = 62.0, 8.0, 16.0
LEAST_MM = 1.0
"""What is off is drawn to this scale at least."""

_SHARES = [1.6, 1.0]
"""Widths of a spine and of what is beside it."""

_TICKS_MM = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)
_OFF = ["off_right_mm", "off_up_mm"]


def film_overlay_figure(
    study: Scoliosis, cohort: Cohort, tables: Mapping[str, pd.DataFrame]
) -> Figure:
    """A row for each patient, two columns for each position: the spine, and how far it is off."""
    positions, rows = tables["positions"], tables["displacements"]
    errors = held_out_error(positions)
    if errors.empty:
        return saying("No pose can be shown: no model has one on any film.")
    patients = chosen(errors)
    rows = rows[rows["specimen"].isin(patients)]
    # the usual films first, any further ones after them; at the erect one all begin
    there = list(dict.fromkeys(positions["position"]))
    usual = [name for name in (RIGHT, LEFT, *HELD_OUT) if name in there]
    further = [name for name in there if name not in (*usual, ERECT)]
    shown = [*usual, *further][:MOST_POSITIONS]
    figure = blank(_ROW_MM * len(patients) + _ABOVE_MM + _KEY_MM)
    axes = figure.subplots(
        len(patients),
        2 * len(shown),
        squeeze=False,
        sharey="row",
        width_ratios=_SHARES * len(shown),
    )
    models = in_order(positions["model"])
    for line, patient in zip(axes, patients, strict=True):
        films = read_films(cohort, patient).films
        own = rows[rows["specimen"] == patient]
        _row(line, films, own, shown, models)
        line[0].set_ylabel(f"{short(patient)}, error {number(float(errors[patient]), 2)}°\nup (mm)")
    _scales(axes, rows)
    for axis, position in zip(axes[0, ::2], shown, strict=True):
        fitted = positions.loc[positions["position"] == position, "fitted"].any()
        axis.set_title(f"{capital(plain(position))} ({'fitted' if fitted else 'held out'})")
    _explain(figure, models, positions)
    return figure


def chosen(errors: pd.Series, ranks: Sequence[float] = RANKS) -> list[str]:
    """Patients by rank of their error, which rise; each once."""
    last = len(errors) - 1
    return list(dict.fromkeys(str(errors.index[round(share * last)]) for share in ranks))


def places(film: Film) -> Array:
    """(V, 2) mm to the right and up."""
    return MM_PER_M * np.stack([film.right, film.up], axis=1)


def posed(film: Film, rows: pd.DataFrame) -> Array:
    """(V, 2) mm, where a model has the vertebrae; rows of joints from the lowest."""
    off = np.vstack([np.zeros(2), rows[_OFF].to_numpy(float)])
    found: Array = places(film) + off
    return found


def _row(
    line: Sequence[Axes],
    films: Mapping[str, Film],
    rows: pd.DataFrame,
    shown: Sequence[str],
    models: Sequence[str],
) -> None:
    """The panels of a patient."""
    for axis, beside, position in zip(line[::2], line[1::2], shown, strict=True):
        axis_lines(axis)
        axis.plot(*places(films[ERECT]).T, color=GREY, lw=0.5, zorder=1)
        beside.axvline(0.0, color=BLACK, lw=0.5, zorder=1)
        beside.spines["left"].set_visible(False)
        beside.margins(y=0.03)
        if position not in films:
            middle = 0.5 * MM_PER_M * float(films[ERECT].up[-1])
            note(beside, 0.5, middle, "no film", GREY, ha="center")
            continue
        measured = places(films[position])
        axis.plot(*measured.T, "o", mfc=WHITE, mec=BLACK, ms=2.6, mew=0.6, zorder=5)
        for name in models:
            own = rows[(rows["position"] == position) & (rows["model"] == name)]
            if len(own) and own[_OFF].notna().all(axis=None):
                axis.plot(*posed(films[position], own).T, **STYLES[name].line(zorder=3, lw=0.8))
                off = np.append(0.0, own[_OFF[0]].to_numpy(float))
                beside.plot(off, measured[:, 1], **STYLES[name].line(zorder=3))


def _scales(axes: "np.ndarray[tuple[int, int], np.dtype[np.object_]]", rows: pd.DataFrame) -> None:
    """Sideways: one scale for the films of a patient, one for all that is off."""
    largest = float(np.nanmax([LEAST_MM, *rows[_OFF[0]].abs().to_numpy(float)]))
    tick = max(value for value in _TICKS_MM if value <= largest)
    for line in axes:
        ends = [axis.dataLim.intervalx for axis in line[::2]]
        low, high = min(end[0] for end in ends), max(end[1] for end in ends)
        for axis, beside in zip(line[::2], line[1::2], strict=True):
            axis.set_xlim(low - 0.08 * (high - low), high + 0.08 * (high - low))
            axis.xaxis.set_major_locator(MaxNLocator(3))
            beside.set_xlim(-1.08 * largest, 1.08 * largest)
            beside.set_xticks([-tick, 0.0, tick], [fixed(-tick, 0), "0", fixed(tick, 0)])
    for axis, beside in zip(axes[-1, ::2], axes[-1, 1::2], strict=True):
        axis.set_xlabel("right (mm)")
        beside.set_xlabel("off (mm)")


def _explain(figure: Figure, models: Sequence[str], positions: pd.DataFrame) -> None:
    film = Line2D([], [], color=BLACK, marker="o", mfc=WHITE, ms=3.2, mew=0.7, ls="", label="film")
    erect = Line2D([], [], color=GREY, lw=0.5, label="erect film")
    handles = [film, erect, *key_of_lines(list(models))]
    words = (
        "Seen from behind; up and sideways have scales of their own. Beside each spine: how far "
        "its vertebrae are off their places on the film, to the right."
    )
    if positions["fitted"].all():
        words += " Nothing is held out; errors are those of the fitted films."
    explain_marks(figure, handles, words, min(len(handles), 5))
