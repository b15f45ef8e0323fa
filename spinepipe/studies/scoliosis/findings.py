"""Key findings of a study of scoliotic spines as sentences, what casts doubt on others first."""

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import pandas as pd

from spinepipe.report.page.document import ResultTables
from spinepipe.report.page.tables import judged
from spinepipe.report.words import capital, count, fixed, listed, number, percent, plain
from spinepipe.status import PrescribedStatus, Status
from spinepipe.studies.scoliosis.headline import DECIDING, SIGNIFICANT, ModelRanking, p_of
from spinepipe.studies.scoliosis.settings import Scoliosis
from spinepipe.studies.scoliosis.tables import GROUPS, MEASURES
from spinepipe.studies.scoliosis.words import IN_WORDS, OF_FILMS, TOLD, in_order

_MOST_PLACES = 6
_SCALED = 1e-9

Finding = Callable[[Scoliosis, ResultTables, pd.DataFrame], Iterator[str]]
"""Sentences of a study and its results, first of all of the rows of one table."""


def findings(study: Scoliosis, results: ResultTables) -> list[str]:
    """The sentences, without those that the study has no table for."""
    found = []
    for make, table in FINDINGS.items():
        rows = results.table(table)
        if not rows.empty:
            found += [sentence.replace(" %", "\u00a0%") for sentence in make(study, results, rows)]
    return found


def ended(study: Scoliosis, results: ResultTables, rows: pd.DataFrame) -> Iterator[str]:
    """Poses that are not as they should be, by how their solve ended."""
    others = rows[rows["status"] != PrescribedStatus.CONVERGED.value]
    if others.empty:
        yield f"All {count(len(rows), 'pose')} converged."
        return
    for status, part in others.groupby("status", sort=False):
        places = [_pose(row) for row in part.to_dict("records")]
        some = f"{len(part)} of {count(len(rows), 'pose')}"
        yield f"{some} ended {plain(str(status))}: {_some(places)}."


def _pose(row: dict[Any, Any]) -> str:
    """Patient, film and model, and by how much the top misses its place."""
    place = f"{row['specimen']}, {plain(row['position'])}, {IN_WORDS[row['model']]}"
    if row["status"] != PrescribedStatus.UNREACHABLE.value:
        return f"{place} ({row['message']})" if row["message"] else place
    missed = f"{number(row['missed_mm'], 2)} mm, {number(row['missed_deg'], 2)}°"
    return f"{place} (misses its place by {missed})"


def _some(places: list[str]) -> str:
    more = len(places) - _MOST_PLACES
    return "; ".join(places[:_MOST_PLACES]) + (f"; and {more} more" if more > 0 else "")


def errors(study: Scoliosis, results: ResultTables, rows: pd.DataFrame) -> Iterator[str]:
    """Models in the order of their errors of rotations; by the other measures the first one."""
    statistics = results.table("statistics")
    for films in reversed(GROUPS):
        standing = ModelRanking.of(rows, films, DECIDING)
        if standing.models:
            told = _order(standing, statistics, films, DECIDING)
            yield f"{OF_FILMS[films]}, {MEASURES[DECIDING][1]}, least error first: {told}."
        others = {
            measure: ModelRanking.of(rows, films, measure)
            for measure in MEASURES
            if measure != DECIDING
        }
        firsts = [
            f"{_first(one, statistics, films, measure)} in {MEASURES[measure][1]}"
            for measure, one in others.items()
            if one.models
        ]
        if firsts:
            yield f"{OF_FILMS[films]}, the least error otherwise: {'; '.join(firsts)}."


def _order(standing: ModelRanking, statistics: pd.DataFrame, films: str, measure: str) -> str:
    best, *_ = standing.models
    told = []
    for model in standing.models:
        p = None if model == best else p_of(statistics, films, measure, best, model)
        same = "" if p is None or p < SIGNIFICANT else ", not told apart from the first"
        told.append(f"{IN_WORDS[model]} ({standing.sized(model)}{same})")
    return "; ".join(told)


def _first(standing: ModelRanking, statistics: pd.DataFrame, films: str, measure: str) -> str:
    """The first model, and those that are not told apart from it."""
    best, *others = standing.models
    ps = {name: p_of(statistics, films, measure, best, name) for name in others}
    same = [IN_WORDS[name] for name, p in ps.items() if p is not None and p >= SIGNIFICANT]
    alike = f", not told apart from {listed(same)}" if same else ""
    return f"{IN_WORDS[best]} ({standing.sized(best)}{alike})"


def both_ways(study: Scoliosis, results: ResultTables, rows: pd.DataFrame) -> Iterator[str]:
    """The published tangent beside the linear regions that its paper compares it with."""
    told = []
    for films in GROUPS:
        standing = ModelRanking.of(rows, films, "rotation")
        if {"tangent", "linear_regions"} <= set(standing.models):
            share = 100.0 * standing.less("tangent", "linear_regions")
            more = f"{number(abs(share), 2)} % {'less' if share > 0.0 else 'more'}"
            told.append(f"{more if share else 'as much'} on {OF_FILMS[films].lower()}")
    if told:
        yield (
            "Beside the model that is linear by region the published tangent model has this error "
            f"of rotations: {', '.join(told)}."
        )


def opposite(study: Scoliosis, results: ResultTables, rows: pd.DataFrame) -> Iterator[str]:
    """Segments that the films turn the wrong way."""
    segments = rows.drop_duplicates(["specimen", "joint"])
    wrong = segments[segments["opposite"]]
    if wrong.empty:
        yield f"All {count(len(segments), 'segment')} turn with both bends."
        return
    some = f"{len(wrong)} of {count(len(segments), 'segment')}"
    yield (
        f"On the films {some} ({percent(len(wrong), len(segments))}) turn against a bend, or not "
        f"at all: {_joints(wrong)}."
    )


def _joints(rows: pd.DataFrame) -> str:
    """Joints by how many patients they are of, most first."""
    own = rows.assign(joint=rows["joint"].astype(str))
    counts = own.groupby("joint", sort=False)["specimen"].nunique()
    counts = counts.sort_values(ascending=False, kind="stable")
    words = [f"{joint} in {count(int(n), 'patient')}" for joint, n in counts.items()]
    return _some(words)


def constrained(study: Scoliosis, results: ResultTables, rows: pd.DataFrame) -> Iterator[str]:
    """Stiffness that the films asked to be less than is allowed."""
    parts = [(name, rows[rows["model"] == name]) for name in in_order(rows["model"])]
    held = [(name, part, part[part["constrained"]]) for name, part in parts]
    told = [
        f"{TOLD[name]} in {len(least)} of {count(len(part), 'segment')} ({_joints(least)})"
        for name, part, least in held
        if len(least)
    ]
    if not told:
        yield "No stiffness had to be held at a bound."
        return
    yield (
        "The films asked for less stiffness than is allowed, a negative one, or for more; it was "
        f"held at a bound and is no finding: {'; '.join(told)}."
    )


def optima(study: Scoliosis, results: ResultTables, rows: pd.DataFrame) -> Iterator[str]:
    """Fits that depend on where they start, or did not settle."""
    fits = rows.dropna(subset=["fit_status"]).drop_duplicates(["specimen", "model"])
    lost = fits[fits["fit_status"] == Status.NOT_CONVERGED.value]
    several = fits[fits["n_optima"] > 1]
    for some, told in (
        (lost, "did not settle"),
        (several, "found several optima; the one of least error is taken, and there may be others"),
    ):
        if len(some):
            places = [
                f"{one['specimen']}, {IN_WORDS[one['model']]}" for one in some.to_dict("records")
            ]
            yield f"{len(some)} of {count(len(fits), 'fit')} to films {told}: {_some(places)}."


def ratios(study: Scoliosis, results: ResultTables, rows: pd.DataFrame) -> Iterator[str]:
    """What films do not tell, where it comes from, and how much hangs on it."""
    moment, mean = study.scale.apical_moment_nm, study.scale.mean_stiffness_nm_per_rad
    sources = {
        "apical_moment": f"the apical moment of {number(moment)} N m that the study states",
        "mean_stiffness": f"the mean stiffness of {number(mean)} N m/rad that the study states",
    }
    named = [sources[name] for name in rows["scale_from"].unique()]
    yield (
        "Films tell ratios of stiffness between segments only; the size of all of them comes from "
        f"{listed(named)}."
    )
    varied = results.table("variation")
    if varied.empty:
        return
    scale = varied[varied["varied"] == "scale"].dropna(subset=["moved_deg"])
    if len(scale):
        low, high = scale["value"].min(), scale["value"].max()
        yield (
            f"Lateral stiffness {number(low)} to {number(high)} times that of the study moves no "
            f"rotation by more than {number(float(scale['moved_deg'].max()), 2)}°."
        )


def by_films(study: Scoliosis, results: ResultTables, rows: pd.DataFrame) -> Iterator[str]:
    """Whose stiffness a fitted one is: the patient's, or that of all."""
    asked = rows[rows["identifiable"].notna()]
    if asked.empty:
        return
    known = asked["identifiable"].astype(bool)
    neither = asked["open_below"].astype(bool) & asked["open_above"].astype(bool)
    told, none = int(known.sum()), int(neither.sum())
    yield (
        f"In {TOLD['tangent_fitted']} a patient's own films tell both ends of {told} of "
        f"{count(len(asked), 'ratio')} ({percent(told, len(asked))}), one end of "
        f"{len(asked) - told - none} and neither of {none}. Where an end is open the ratio is "
        "drawn to that of all patients and is no finding about this one."
    )
    shares = known.groupby(asked["joint"], sort=False).mean()
    few = [str(joint) for joint, share in shares.items() if share < 0.5]
    if few:
        yield f"At {listed(few)} films tell both ends in fewer than half of the patients."


def enlargement(study: Scoliosis, results: ResultTables, rows: pd.DataFrame) -> Iterator[str]:
    """Which enlargement of the published ends has the least error."""
    tried = rows[rows["varied"] == "enlargement"].dropna(subset=["rotation_rmse_deg"])
    told = []
    for films in GROUPS:
        own = tried[tried["films"] == films]
        if len(own):
            best = own.sort_values("rotation_rmse_deg", kind="stable").iloc[0]
            error = number(float(best["rotation_rmse_deg"]))
            value = number(float(best["value"]))
            told.append(f"{value} % on {OF_FILMS[films].lower()} ({error}°)")
    if told:
        yield (
            f"Of the enlargements tried, the error of rotations is least with {listed(told)}; the "
            f"study has {number(100.0 * (study.enlargement - 1.0))} %."
        )


def parameters(study: Scoliosis, results: ResultTables, rows: pd.DataFrame) -> Iterator[str]:
    """How many numbers each model takes from a patient's films."""
    told = []
    for name in in_order(rows["model"]):
        own = rows[rows["model"] == name]
        low, high = int(own["free_parameters"].min()), int(own["free_parameters"].max())
        free = str(high) if low == high else f"{low} to {high}"
        decided = float(own.drop_duplicates("specimen")["decided_parameters"].mean())
        few = decided < 0.95 * high and low == high
        of_which = f", of which the films decide {fixed(decided, 1)} on average" if few else ""
        told.append(f"{IN_WORDS[name]} {free}{of_which}")
    yield (
        f"Parameters taken from each patient's two bending films: {'; '.join(told)}. Only "
        "held-out films say whether they are worth it."
    )


def beyond(study: Scoliosis, results: ResultTables, rows: pd.DataFrame) -> Iterator[str]:
    """Held-out rotations that the published law has no load for."""
    own = rows[~rows["fitted"].astype(bool)].drop_duplicates(["specimen", "position", "joint"])
    over = own[own["share_of_range"] > 1.0]
    if len(own):
        told = f": {_joints(over)}" if len(over) else ""
        yield (
            f"{len(over)} of {count(len(own), 'held-out rotation')} "
            f"({percent(len(over), len(own))}) lie beyond an end of the published law{told}."
        )


def sizes(study: Scoliosis, results: ResultTables, rows: pd.DataFrame) -> Iterator[str]:
    """Whether films were brought to one size."""
    films = rows.drop_duplicates(["specimen", "position"])
    scaled = films[(films["film_scale"] - 1.0).abs() > _SCALED]
    chord = films["chord_ratio"]
    told = f"the spine is {fixed(chord.min())} to {fixed(chord.max())} times as long as erect"
    if scaled.empty:
        yield (
            "No film was brought to the size of the erect one, as without corners of vertebrae "
            f"their size is not known; from lowest to uppermost vertebra {told}."
        )
        return
    factors = scaled["film_scale"]
    yield (
        f"{len(scaled)} of {count(len(films), 'film')} were brought to the size of the erect one, "
        f"times {fixed(factors.min())} to {fixed(factors.max())}; then {told}."
    )


def beside_the_paper(study: Scoliosis, results: ResultTables, rows: pd.DataFrame) -> Iterator[str]:
    """How published quantities were judged."""
    told = judged(rows)
    if told:
        yield capital(told)


FINDINGS: Mapping[Finding, str] = {
    ended: "positions",
    errors: "accuracy",
    both_ways: "accuracy",
    opposite: "laws",
    constrained: "laws",
    optima: "laws",
    ratios: "positions",
    by_films: "laws",
    enlargement: "variation",
    parameters: "positions",
    beyond: "displacements",
    sizes: "positions",
    beside_the_paper: "against_jalalian_2017",
}
"""In the order of the page, with the table that each is about."""
