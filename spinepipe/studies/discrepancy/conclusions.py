"""What a search for missing effects concludes; the sentences stand in conclusions.csv.

Misfit is the root of chi2 / dof - 1 (the column ``gap`` of results), in SDs of the noise. It
*falls* in a test where it ends below the 95 % interval of that before, and *rises* above it.
"""

from collections.abc import Iterator
from math import inf

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.report.conclusions import Conclusion, Value
from spinepipe.report.page.study_page import ResultTables
from spinepipe.report.words import count, level, listed, plain
from spinepipe.studies.discrepancy import verdict as found
from spinepipe.studies.discrepancy.alternatives import alternatives, next_test, unnamed
from spinepipe.studies.discrepancy.curve_rows import stiffness_at_rest_and_loaded
from spinepipe.studies.discrepancy.lights import FEW_SPECIMENS, lights
from spinepipe.studies.discrepancy.misfits import (
    BASE,
    LARGE,
    MOST_WORDS,
    NOISE,
    SMALL,
    WITH_EFFECTS,
    bare,
    largest,
    misfit,
    model_name,
    place_of_most,
    sized,
    stands_for,
)
from spinepipe.studies.discrepancy.quantities import DOUBLING, UNITS, quantities
from spinepipe.studies.discrepancy.settings import Discrepancy
from spinepipe.studies.discrepancy.tables import MODELS
from spinepipe.studies.discrepancy.verdict import (
    EVEN,
    EVERY,
    NOTHING,
    SOMETHING_ELSE,
    SURE,
    Missing,
    Verdict,
    likeliest_beside,
    read_verdict,
)
from spinepipe.studies.discrepancy.verdict_unnamed import Reason
from spinepipe.studies.discrepancy.words import (
    effects_in_words,
    general,
    in_words,
    name_at,
    words_of,
)
from spinepipe.units import LOAD_UNITS

_MOST_WORDS_OF_SET = 12

_WITHOUT_A_NAME = {
    Reason.NO_BASE: "no_base",
    Reason.DATA_ERRORS: "data",
    Reason.NO_KNOWN_EFFECT: "shape",
    Reason.A_PART_STAYS: "shape",
    Reason.MOST_STAYS: "much",
    Reason.NOT_PROVEN: "left_out",
}
"""The answer to each reason; to those that only versions before gave, that of a shape."""


def conclusions(study: Discrepancy, cohort: Cohort, results: ResultTables) -> Iterator[Conclusion]:
    """All of them."""
    verdict = read_verdict(results.tables.files["verdict"])
    model = model_name(study)
    where, gap = results.table("where"), results.table("gap")
    numbers, held_out = results.table("field_numbers"), results.table("held_out")
    yield answer(verdict, model, where, gap)
    yield from _misfits(verdict, model, where, gap)
    if verdict.verdict is found.VerdictKind.NULL:
        yield from _power(verdict)
    yield from _by_test(verdict, model, where)
    yield from _stiffness(numbers, model)
    yield from _carries_over(verdict, where, held_out)
    yield from alternatives(verdict)
    yield from unnamed(verdict, where, gap)
    yield from next_test(verdict, results.table("next_tests"))
    yield from lights(study, cohort, verdict, results, misfit(where, WITH_EFFECTS))


def answer(verdict: Verdict, model: str, where: pd.DataFrame, gap: pd.DataFrame) -> Conclusion:
    """The answer of a search, on its page and in a notebook.

    Parameters
    ----------
    model : what the base is called. where, gap : rows of the tables of that name.
    """
    sizes = {"before": misfit(where, BASE), "after": misfit(where, WITH_EFFECTS)}
    values = {name: bare(value) for name, value in sizes.items() if value is not None}
    named, probable = effects_in_words(verdict.effects, MOST_WORDS), verdict.probabilities
    how = "verdict: probabilities"
    names = {"model": model, "effects": named, "place": place_of_most(where, gap, BASE)[0]}
    match verdict.verdict:
        case found.VerdictKind.NAMED | found.VerdictKind.PART:
            after = sizes["after"]
            left = after is not None and (after.low or 0.0) > SMALL
            told = "named" if verdict.verdict is found.VerdictKind.NAMED and not left else "part"
            names["rest"] = place_of_most(where, gap, WITH_EFFECTS)[0]
            if after is not None and after.number > LARGE:
                told = "large"
            elif told == "part" and not left:
                told = "part_open"
        case found.VerdictKind.SET:
            every = list(dict.fromkeys(name_at(c.name, c.coordinates) for c in verdict.in_set))
            values["many"] = Value(len(every), source="verdict: candidates")
            told = "set_beside" if verdict.effects else "set"
            if len(every) == 1 and probable:  # what holds the rest is no name of a set
                told = f"{told}_one"
                own = verdict.in_set[0].name
                rest, share = likeliest_beside(probable, {own, *verdict.named})
                names |= {"name": every[0], "rest": words_of(rest)}
                values["own"] = Value(probable.get(own, 0.0), source=how)
                values["other"] = Value(share, source=how)
            elif probable.get(SOMETHING_ELSE, 0.0) > 1.0 - SURE:
                every = [*every, words_of(SOMETHING_ELSE)]
            names["names"] = in_words([every], _MOST_WORDS_OF_SET, "or")
            told = told if names["names"] else "set_many"
        case found.VerdictKind.NULL:
            nothing = probable.get(NOTHING, 1.0)
            sizes_found = [one.gap for one in verdict.smallest_detectable]
            told = "null" if sizes_found else "null_blind"
            if sizes["before"] is not None and (sizes["before"].low or 0.0) > SMALL:
                told = "null_misfit"
            if nothing < EVEN:
                told = "null_open"
                likeliest, share = likeliest_beside(probable, {NOTHING})
                names["effect"] = words_of(likeliest)
                values["nothing"] = Value(nothing, source=how)
                values["own"] = Value(share, source=how)
            if sizes_found:
                of_largest = "verdict: smallest_detectable, largest"
                values["hardest"] = Value(max(sizes_found), source=of_largest)
            n = len(sizes_found)
            names["shown"] = f"any of {n} effects" if n > 1 else "the one testable effect"
        case found.VerdictKind.UNKNOWN:
            told = (
                f"unknown_{_WITHOUT_A_NAME.get(verdict.reason or Reason.NO_KNOWN_EFFECT, 'shape')}"
            )
            known = [
                n for n, p in probable.items() if p >= EVEN and n not in (NOTHING, SOMETHING_ELSE)
            ]
            if told == "unknown_shape" and known:  # likely, and not all
                told = "unknown_part"
                names["names"] = in_words([[general(name) for name in known]], MOST_WORDS)
                names["names"] = names["names"] or f"{len(known)} effects"
            if verdict.unknown is not None and verdict.unknown.stays is not None:
                values["stays"] = Value(verdict.unknown.stays, NOISE, source="verdict: unknown")
            elif told == "unknown_much":
                told = "unknown_shape"  # in files of versions before
            names["errors"] = count(len(verdict.suspected_data_errors), "respect")
    return Conclusion("verdict", told, values, names)


def _misfits(
    verdict: Verdict, model: str, where: pd.DataFrame, gap: pd.DataFrame
) -> Iterator[Conclusion]:
    """Key numbers: misfit before and after, and the first value of an effect that is known."""
    before, after = misfit(where, BASE), misfit(where, WITH_EFFECTS)
    names = {"model": model, "effects": stands_for(verdict)}
    if before is not None:
        yield Conclusion("misfit_base", "told", {"value": before}, names)
    if after is not None and names["effects"]:
        told = "named" if verdict.effects else "likeliest"
        yield Conclusion("misfit_after", told, {"value": after}, names)
    if verdict.effects and after is not None and after.number > LARGE:
        yield Conclusion("certain", "stop", {"after": bare(after)})
    for effect in verdict.effects[:1]:
        for one in quantities(effect):
            if one.value is not None and one.identifiable and not one.place:
                told_of = {"parameter": one.name, "effect": name_at(effect.name, EVERY)}
                beyond = one.name == DOUBLING and one.value.number > _farthest(
                    effect, gap, one.value.unit
                )
                told = "beyond" if beyond else "shared"
                yield Conclusion("size", told, {"value": one.value}, told_of)
                break


def _farthest(effect: Missing, gap: pd.DataFrame, unit: str) -> float:
    """The largest motion in ° or mm that was measured where an effect acts; 0 where none was."""
    if gap.empty:
        return inf
    rows = gap[gap["unit"] == ("deg" if unit == "°" else unit)]
    for name, places in (("coordinate", effect.scope.coordinates), ("joint", effect.scope.joints)):
        rows = rows[rows[name].isin(places)] if tuple(places) != EVERY else rows
    return float(rows["measured"].abs().max()) if len(rows) else 0.0


def _power(verdict: Verdict) -> Iterator[Conclusion]:
    """What the tests of a search that found nothing could have shown."""
    ordered = sorted(verdict.smallest_detectable, key=lambda one: one.gap)
    if not ordered:
        yield Conclusion("power", "stop_blind")
        return
    how = "verdict: smallest_detectable"
    first, last = (Value(one.gap, NOISE, source=how) for one in (ordered[0], ordered[-1]))
    shown, tried = len(ordered), len(ordered) + len(verdict.not_testable)
    easy, hard = general(ordered[0].name), general(ordered[-1].name)
    names = {"shown": count(shown, "effect"), "easy": easy, "hard": hard}
    values = {"least": first, "most": last, "tried": Value(tried, source=f"{how}, not_testable")}
    yield Conclusion("power", "all" if shown == tried else "some", values, names)
    yield Conclusion("power", "hardest", {"value": last}, {**names, "effect": hard})
    yield Conclusion("power", "easiest", {"value": first}, {**names, "effect": easy})


def _compared_tests(where: pd.DataFrame) -> pd.DataFrame:
    """By test the base's misfit, and in the column ``then`` that with effects."""
    rows = where[(where["by"] == "test") & where["gap"].notna()]
    before, after = (rows[rows["model"] == name].set_index("test") for name in MODELS)
    return before.join(after["gap"].rename("then"), how="inner").dropna(subset="then")


def _by_test(verdict: Verdict, model: str, where: pd.DataFrame) -> Iterator[Conclusion]:
    if where.empty:
        return
    both = _compared_tests(where)
    if both.empty:
        return
    names = {"model": model, "effects": stands_for(verdict)}
    if not names["effects"]:
        most = largest(both, both["gap"])
        names["test"] = plain(str(most.name))
        told = "base" if (both["gap_low"] > SMALL).any() else "within"
        yield Conclusion("by_test", told, {"before": bare(sized(most))}, names)
        return
    falls, rises = both["then"] < both["gap_low"], both["then"] > both["gap_high"]
    tests, fallen, risen = len(both), int(falls.sum()), int(rises.sum())
    told = "none" if not fallen else "single" if fallen == 1 else "some"
    told = "worse" if risen else ("one" if tests == 1 else "all") if fallen == tests else told
    most = largest(both, both["then"] - both["gap"] if risen else both["gap"] - both["then"])
    how = "where: gap by test"
    values = {
        "before": Value(float(most["gap"]), NOISE, source=how),
        "after": Value(float(most["then"]), NOISE, source=how),
        "fall": Value(float(most["gap"] - most["then"]), NOISE, source=how),
        "fallen": Value(fallen, source=how),
        "risen": Value(risen, source=how),
        "tests": Value(tests, source=how),
    }
    yield Conclusion("by_test", told, values, {**names, "test": plain(str(most.name))})


def _stiffness(numbers: pd.DataFrame, model: str) -> Iterator[Conclusion]:
    """Stiffness at rest and under load, mean of the specimens."""
    rows = stiffness_at_rest_and_loaded(numbers)
    means = rows[rows["specimen"] == EVERY[0]] if len(rows) else rows
    models = {str(row["model"]): row for _, row in means.iterrows()}
    if not {BASE, WITH_EFFECTS} <= models.keys():
        return
    row = models[WITH_EFFECTS]
    values = {
        "rest": _slope(row, "rest"),
        "loaded": _slope(row, "loaded"),
        "base": _slope(models[BASE], "loaded"),
        "load": Value(float(row["load"]), LOAD_UNITS[row["coordinate"]], source="field_numbers"),
    }
    rest, loaded = values["rest"], values["loaded"]
    above = rest.high is not None and loaded.low is not None and loaded.low > rest.high
    below = rest.low is not None and loaded.high is not None and loaded.high < rest.low
    names = {
        "side": row["side"],
        "joint": "every joint" if row["every"] else level(row["joint"]),
        "specimens": count(int(row["specimens"]), "specimen"),
        "model": model,
    }
    told = "rises" if above else "falls" if below else "alike"
    yield Conclusion("stiffness", told, values, names)


def _slope(row: pd.Series, at: str) -> Value:
    """Stiffness ``rest`` or ``loaded`` of a row."""
    unit, factor = UNITS.get(row["unit"], (row["unit"], 1.0))
    size, *ends = (row[f"{at}{end}"] for end in ("", "_low", "_high"))
    low, high = (None if pd.isna(end) else factor * float(end) for end in ends)
    how = f"field_numbers: {row['number']}, {at}, mean of specimens"
    return Value(factor * float(size), unit, low, high, int(row["specimens"]), how)


def _carries_over(
    verdict: Verdict, where: pd.DataFrame, held_out: pd.DataFrame
) -> Iterator[Conclusion]:
    """Whether what the fit gains shows in left-out tests and specimens, or halves of their steps.

    It does in a kind of fold where the misfit of all together falls, that of one fold at least
    below its interval before, and none is worse by more than noise makes; of tests the one that
    gains most in the fit must be among those that fall, and specimens must be `FEW_SPECIMENS`.
    """
    if not stands_for(verdict):
        return
    scored = held_out[held_out["gap_base"].notna()] if len(held_out) else held_out
    if scored.empty:
        yield Conclusion("carries", "untold")
        return
    tests, every = held_out[held_out["kind"] == "test"], where[where["by"] == "all"]
    values = {
        "folds": Value(len(scored), source="held_out: rows with a score"),
        "worse": Value(int(scored["worse"].sum()), source="held_out: worse"),
        "scored": Value(int(tests["readings"].sum()), source="held_out: readings of tests"),
        "readings": Value(int(every["readings"].max()), source="where: readings"),
    }
    better = scored[scored["gap_with_effects"] < scored["gap_base_low"]]
    values["better"] = Value(len(better), source="held_out: gap_with_effects below gap_base_low")
    gains, good = _compared_tests(where), []
    most = str(largest(gains, gains["gap"] - gains["then"]).name) if len(gains) else ""
    for one in verdict.left_out:
        falls = better[better["kind"] == one.kind]
        own = scored[scored["kind"] == one.kind]
        shown = one.kind != "test" or most in set(falls["fold"])
        shown = shown and (one.kind != "specimen" or len(own) >= FEW_SPECIMENS)
        if one.gap_closed is None or falls.empty or own["worse"].any() or not shown:
            continue
        how = f"verdict: left_out, {one.kind}"
        values[one.kind] = change = Value(-100.0 * one.gap_closed, "%", n=one.folds, source=how)
        if change.number < 0.0:
            good.append(one.kind)
            yield Conclusion("left_out", one.kind, {"value": change})
    nowhere = "unsure" if len(better) else "nowhere"
    told = "both" if {"test", "specimen"} <= set(good) else good[0] if good else nowhere
    told = "worse" if scored["worse"].any() else told
    parts = listed([_PARTS[kind] for kind in dict.fromkeys(scored["kind"])])
    yield Conclusion("carries", told, values, {"effects": stands_for(verdict), "parts": parts})


_PARTS = {"test": "tests", "specimen": "specimens", "steps": "load steps"}
