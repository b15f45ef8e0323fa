"""What a study of scoliotic spines concludes; the sentences stand in conclusions.csv."""

from collections.abc import Iterator, Mapping
from math import isclose, sqrt

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.report.conclusions import Conclusion, Value
from spinepipe.report.page.study_page import ResultTables
from spinepipe.report.words import listed
from spinepipe.studies.scoliosis.accuracy import READINGS_OF_A_ROTATION
from spinepipe.studies.scoliosis.conclusions_quality import quality
from spinepipe.studies.scoliosis.errors import REFERENCE
from spinepipe.studies.scoliosis.errors_compared import (
    FEWEST,
    FILMS,
    LAWS,
    Compared,
    LawDifference,
)
from spinepipe.studies.scoliosis.films import read_films, step_sd_deg
from spinepipe.studies.scoliosis.settings import Scoliosis

DECIDING = "rotation"
"""The measure that the answer depends on: rotations of segments since the erect film."""

MEASURED = {
    "place": "vertebral places",
    "tilt": "vertebral tilts",
    "cobb": "Cobb angles",
    "ferguson": "Ferguson angles",
}
"""The other measures, in words."""

NOT_PERSONAL = "uniform"
"""The law that takes nothing from a spine's bending films."""

PUBLISHED = "tangent"

FROM_POPULATION = "tangent_fitted"
"""The law that also takes from the films of other spines."""

NOT_COMPARED = ("none", "few", "alone")
"""Verdicts of errors of which there is nothing to compare."""


def conclusions(study: Scoliosis, cohort: Cohort, results: ResultTables) -> Iterator[Conclusion]:
    """All of them."""
    tables = results.tables
    left_out = Compared.of(tables, "held_out", DECIDING)
    fitted = Compared.of(tables, "fitted", DECIDING)
    positions = results.table("positions")
    yield from _answer(left_out, bool(len(positions)) and bool(positions["fitted"].all()))
    yield Conclusion("top", "given")
    yield from _noise(cohort, fitted if left_out.noise is None else left_out)
    if left_out.verdict not in NOT_COMPARED:
        yield from _personal(left_out)
        yield from _others(tables)
        yield from _above_noise(left_out)
    for compared in (left_out, fitted):
        yield from _published(compared)
    yield from _ratios(results.table("laws"))
    yield from _size(results.table("absolute_stiffness"))
    variants = results.table("variants")
    if len(variants):
        yield from _scale(tables)
        yield from _enlargement(study, variants)
    yield from quality(results, left_out, fitted)
    yield from _methods(study)


def _methods(study: Scoliosis) -> Iterator[Conclusion]:
    """Where laws come from, of the models that were asked for."""
    taken = [LAWS[name] for name in LAWS if name in study.models and name != NOT_PERSONAL]
    if taken:
        yield Conclusion("methods_laws", "films", {}, {"laws": listed(taken)})
    if FROM_POPULATION in study.models:
        yield Conclusion("methods_laws", "population")
    if NOT_PERSONAL in study.models:
        yield Conclusion("methods_laws", "uniform")
    scale = study.scale
    sizes = {"apical_moment": (scale.apical_moment_nm, "N m")}
    sizes["mean_stiffness"] = (scale.mean_stiffness_nm_per_rad, "N m/rad")
    yield Conclusion("methods", scale.of, {"size": Value(*sizes[scale.of], source="settings")})


def _answer(left_out: Compared, fitted_only: bool) -> Iterator[Conclusion]:
    """Which law errs least, by how much, and whether that can be detected."""
    verdict = left_out.verdict
    if verdict == "none":
        yield Conclusion("best", "fitted_only" if fitted_only else "none")
        return
    if verdict == "few":
        n = Value(len(left_out.same), source="positions: spines with all poses")
        yield Conclusion("best", "few", {"n": n})
        return
    best = left_out.laws[0]
    least = left_out.error(best)
    n = Value(len(left_out.same), source=least.source)
    yield Conclusion("error", "left_out", {"value": least, "n": n}, {"law": LAWS[best]})
    if verdict == "alone":
        yield Conclusion("best", "alone", {"error": least}, {"law": LAWS[best]})
        return
    nearest = left_out.nearest
    values, names = _told(nearest)
    if left_out.detectable is not None:
        values["detectable"] = left_out.told_detectable
    yield Conclusion("best", verdict, values, names)
    told = "alike" if verdict == "alike" else "nearest"
    yield Conclusion("margin", told, {"value": nearest.margin, "n": values["n"]}, names)
    if verdict == "small" and left_out.noise and left_out.detectable:
        tilt, share = _tilt(left_out.noise), nearest.margin.number / left_out.detectable
        exact = {
            "needed": Value(share * tilt.number, "°", source="margin over 1.96 √2 √4"),
            "times": Value(1.0 / share, source="detectable over margin"),
        }
        yield Conclusion("precision", "too_coarse", {**values, "tilt": tilt, **exact})


def _told(one: LawDifference) -> tuple[dict[str, Value], dict[str, str]]:
    """Numbers and names of a difference of two laws."""
    values = {"error": one.errors[0], "other_error": one.errors[1], "margin": one.margin}
    values["n"] = Value(one.margin.n or 0, source=one.margin.source)
    return values, {"law": LAWS[one.one], "other": LAWS[one.other]}


def _tilt(noise: float) -> Value:
    """SD of the reading of one tilt, by that of a rotation."""
    return Value(noise / sqrt(READINGS_OF_A_ROTATION), "°", source="accuracy: reading_noise")


def _noise(cohort: Cohort, compared: Compared) -> Iterator[Conclusion]:
    """How exactly films are read, and what can be detected then."""
    if compared.noise is None:
        yield Conclusion("noise", "check_unknown")
        return
    spines = (read_films(cohort, name) for name in cohort.specimen_names)
    repeated = any(max(one.readings.values()) > 1 for one in spines)
    value = Value(compared.noise, "°", source="accuracy: reading_noise")
    told = {"value": value, "tilt": _tilt(compared.noise)}
    step = step_sd_deg(cohort)
    # a study states it with one digit
    only_step = step is not None and isclose(told["tilt"].number, step, rel_tol=0.1)
    stated = "check_step" if cohort.made_up and only_step else "check_stated"
    yield Conclusion("noise", "ok" if repeated else stated, told)
    yield Conclusion("detectable", "known", {"value": compared.told_detectable})


def _personal(left_out: Compared) -> Iterator[Conclusion]:
    """Whether laws made from bending films err less than one that takes nothing from them."""
    others = [name for name in left_out.laws if name != NOT_PERSONAL]
    if NOT_PERSONAL not in left_out.laws:
        return
    found = [left_out.difference(name, NOT_PERSONAL) for name in others]
    better = [one for one in found if one.less]
    limit = left_out.detectable
    detected = [one for one in better if limit is not None and one.margin.number > limit]
    worse = [one for one in found if one.more]
    worse_detected = [one for one in worse if limit is not None and -one.margin.number > limit]
    verdict = "none"
    if better:
        verdict = "some" if detected else "some_small" if limit is not None else "some_unread"
    counts = {"laws": len(found), "better": len(better), "detected": len(detected)}
    counts |= {"worse": len(worse), "worse_detected": len(worse_detected)}
    counts["alike"] = len(found) - len(better) - len(worse)
    source = "statistics: p_holm of pairs with uniform"
    yield Conclusion("personal", verdict, {k: Value(v, source=source) for k, v in counts.items()})


def _others(tables: Mapping[str, pd.DataFrame]) -> Iterator[Conclusion]:
    """The same of other measures; those with one verdict and one law together."""
    found: dict[tuple[str, str], list[str]] = {}
    for measure, words in MEASURED.items():
        compared = Compared.of(tables, "held_out", measure)
        if compared.verdict in NOT_COMPARED:
            continue
        first = "" if compared.verdict == "alike" else LAWS[compared.laws[0]]
        found.setdefault((compared.verdict, first), []).append(words)
    for (verdict, law), measures in found.items():
        yield Conclusion("others", verdict, {}, {"measures": listed(measures), "law": law})


def _above_noise(left_out: Compared) -> Iterator[Conclusion]:
    least = left_out.error(left_out.laws[0])
    if left_out.noise is None:
        return
    above = least.low is not None and least.low > left_out.noise
    noise = Value(left_out.noise, "°", source="accuracy: reading_noise")
    verdict = "above" if above else "within"
    yield Conclusion("above_noise", verdict, {"error": least, "noise": noise})


def _published(compared: Compared) -> Iterator[Conclusion]:
    """The published tangent beside what its paper compares it with."""
    pair = (PUBLISHED, REFERENCE)
    if not set(pair) <= set(compared.each) or len(compared.each[list(pair)].dropna()) < FEWEST:
        return
    one = compared.difference(*pair)
    if one.margin.number < 0.0:
        one = compared.difference(*pair[::-1])
    limit = compared.detectable
    verdict = "alike"
    if one.less:
        small = limit is not None and one.margin.number <= limit
        verdict = "less_unread" if limit is None else "less_small" if small else "less"
    values, names = _told(one)
    yield Conclusion("published", verdict, values, {**names, "films": FILMS[compared.group]})


def _ratios(laws: pd.DataFrame) -> Iterator[Conclusion]:
    """Whose stiffness a fitted one is: the spine's, or that of all."""
    asked = laws[laws["identifiable"].notna()] if len(laws) else laws
    if asked.empty:
        return
    bounded = int(asked["identifiable"].astype(bool).sum())
    verdict = "none" if not bounded else "all" if bounded == len(asked) else "some"
    values = {
        "bounded": Value(bounded, source="laws: identifiable"),
        "ratios": Value(len(asked), source="laws: identifiable"),
    }
    yield Conclusion("ratios", verdict, values)


def _size(absolute: pd.DataFrame) -> Iterator[Conclusion]:
    """How stiff spines are in all, where known traction tells it."""
    if absolute.empty:
        return
    spines = absolute.drop_duplicates("specimen")
    told = spines.dropna(subset=["mean_nm_per_deg"])
    source = "absolute_stiffness: mean_nm_per_deg"
    values = {"n": Value(len(told), source=source), "spines": Value(len(spines), source=source)}
    if told.empty:
        yield Conclusion("size", "none", values)
        return
    for name, column, value in (
        ("least", "mean_low", told["mean_low"].min()),
        ("most", "mean_high", told["mean_high"].max()),
        ("middle", "mean_nm_per_deg", told["mean_nm_per_deg"].median()),
    ):
        values[name] = Value(float(value), "N m/°", source=f"absolute_stiffness: {column}")
    yield Conclusion("size", "told", values)


def tried(variants: pd.DataFrame, varied: str, group: str) -> pd.DataFrame:
    """Errors of the published tangent (deg): a row for each spine, a column for each value.

    Of values at which some spine has a pose on every film of the group, and of spines that have
    one at all of these.
    """
    rows = variants[(variants["varied"] == varied) & (variants["fitted"] == (group == "fitted"))]
    rows = rows.assign(square=rows["rotation_rmse_deg"].astype(float) ** 2)
    cells = rows.groupby(["specimen", "value"], sort=False)["square"]
    squares = cells.apply(lambda x: x.mean(skipna=False)).unstack("value")
    kept: pd.DataFrame = squares.dropna(axis=1, how="all").dropna().sort_index(axis=1) ** 0.5
    return kept


def most_moved(tables: Mapping[str, pd.DataFrame]) -> tuple[Compared, Value, Value] | None:
    """How far a segment turns with another size of stiffness, and the law's own error there.

    On the films where that is most beside the error; None where nothing was varied or has a pose.
    """
    rows = tables.get("variants", pd.DataFrame())
    if rows.empty:
        return None
    rows = rows[rows["varied"] == "scale"].dropna(subset=["moved_deg"])
    found = []
    for group in FILMS:
        compared = Compared.of(tables, group, DECIDING)
        moved = rows.loc[rows["fitted"] == (group == "fitted"), "moved_deg"]
        if len(moved) and PUBLISHED in compared.each:
            error = compared.mean(compared.each[PUBLISHED].dropna())
            most = Value(float(moved.max()), "°", source="variants: varied scale, moved_deg")
            found.append((compared, most, error))
    return max(found, key=lambda one: one[1].number - one[2].number, default=None)


def _scale(tables: Mapping[str, pd.DataFrame]) -> Iterator[Conclusion]:
    """Whether the size of stiffness, which films do not show, moves the spine."""
    found = most_moved(tables)
    if found is None:
        return
    compared, most, error = found
    factors = tables["variants"].query("varied == 'scale'")["value"]
    ends = {
        name: Value(float(end), source="variants: varied scale")
        for name, end in (("low", factors.min()), ("high", factors.max()))
    }
    verdict = "beyond" if most.number > error.number else "within"
    names = {"films": compared.group_words}
    yield Conclusion("scale", verdict, {"moved": most, "error": error, **ends}, names)


def _enlargement(study: Scoliosis, variants: pd.DataFrame) -> Iterator[Conclusion]:
    """Which enlargement of the ends errs least; one at the end of what was tried is none."""
    own = Value(round(100.0 * (study.enlargement - 1.0), 6), "%", source="settings: enlargement")
    found: list[Conclusion] = []
    groups: dict[str, list[str]] = {}
    for group, films in FILMS.items():
        if not (variants["fitted"] == (group == "fitted")).any():
            continue
        errors = tried(variants, "enlargement", group)
        if errors.empty:
            groups.setdefault("check_unlike", []).append(films)
            continue
        means, n, how = errors.mean(), len(errors), "variants: mean over the same spines"
        at = {"best": means.idxmin(), "low": means.index[0], "high": means.index[-1]}
        values = {name: Value(float(value), "%", source=how) for name, value in at.items()}
        values["error"] = Value(float(means.min()), "°", n=n, source=how)
        values |= {"own": own, "n": Value(n, source=how)}
        at_end = at["best"] in (at["low"], at["high"])
        groups.setdefault("check_end" if at_end else "ok", []).append(films)
        verdict = "end" if at_end else "inside"
        found.append(Conclusion("enlargement", verdict, values, {"films": films}))
    yield from found[:1]
    for verdict, films_of in groups.items():
        yield Conclusion("tried", verdict, {}, {"films": listed(films_of)})
