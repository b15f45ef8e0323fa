"""Whether a search for missing effects can be trusted, part by part, and how it was done."""

from collections.abc import Iterator

import pandas as pd
from scipy.stats import norm

from spinepipe.cohort import Cohort
from spinepipe.report.conclusions import Conclusion, Value
from spinepipe.report.page.study_page import ResultTables
from spinepipe.report.words import count, level, listed, plain
from spinepipe.studies.discrepancy.misfits import LARGE, SMALL, WITH_EFFECTS, bare, largest
from spinepipe.studies.discrepancy.quantities import quantities
from spinepipe.studies.discrepancy.settings import Discrepancy
from spinepipe.studies.discrepancy.verdict import EVERY, REPEATS, SURE, SearchEnd, Verdict
from spinepipe.studies.discrepancy.verdict_unnamed import Reason
from spinepipe.studies.discrepancy.words import SET_UP, general, readable, words_of

FEW_SPECIMENS = 3
LITTLE = 0.1
"""Times the noise: a change of the misfit that is no matter."""

CHANCE = 0.01
"""How often the largest of all errors of the set-up may be taken for one outside its tolerance."""

_BASES = {
    "per_specimen": "one linear stiffness in each direction for all joints of a specimen",
    "per_joint": "one linear stiffness in each direction for each joint",
    None: "the laws of a model file",
}
_UNITS = {"deg": "°", "1": "%"}


def lights(
    study: Discrepancy, cohort: Cohort, verdict: Verdict, results: ResultTables, after: Value | None
) -> Iterator[Conclusion]:
    """All of them, and the methods.

    Parameters
    ----------
    after : misfit of the model with effects.
    """
    yield _errors(verdict)
    if verdict.noise.accuracy_assumed:
        yield _accuracy(verdict)
    yield _noise(verdict)
    yield from extent(verdict)
    if after is not None:
        light = "stop" if after.number > LARGE else "check"
        light = "ok" if (after.low or 0.0) <= SMALL and light == "check" else light
        yield Conclusion("remainder", light, {"after": bare(after) if light == "stop" else after})
    if verdict.reason is Reason.NO_BASE:
        names = {"model": "base model", "why": readable(verdict.why).rstrip(".")}
        yield Conclusion("values", "stop_no_base", names=names)
    else:
        yield from _tests(verdict)
        yield _predicted(results.table("held_out"), results.table("gap"))
        yield from _set_up(verdict, results.table("imperfections"))
    values = [one for effect in verdict.effects for one in quantities(effect)]
    if values:
        how = "verdict: effects, parameters"
        numbers = {
            "n": Value(len(values), source=how),
            "open": Value(sum(not one.identifiable for one in values), source=how),
        }
        yield Conclusion("values", "check" if numbers["open"].number else "ok", numbers)
    yield from _sample(study, cohort, verdict, results)


def extent(verdict: Verdict) -> Iterator[Conclusion]:
    """Whether all that mattered was fitted, and else what was not; also of a result in Python."""
    if (search := verdict.search) is None:
        return
    light = "ok" if search.ended is SearchEnd.DONE else f"check_{search.ended}"
    sets = [" with ".join(map(words_of, one)) for one in search.not_fitted]
    how = "verdict: search"
    values = {"fits": Value(search.fits, source=how), "open": Value(search.open, source=how)}
    yield Conclusion("ended", light, values, {"sets": listed(sets, len(sets), "or")})


def _errors(verdict: Verdict) -> Conclusion:
    errors = verdict.suspected_data_errors
    if not errors:
        return Conclusion("errors", "ok")
    first = {"where": readable(errors[0].where), "what": readable(errors[0].what)}
    return Conclusion("errors", "stop", names={**first, "errors": count(len(errors), "such error")})


def _sds(deg: float | None, mm: float | None, source: str) -> list[Value]:
    """Of rotations and translations, as far as they are known."""
    pairs = ((deg, "°"), (mm, "mm"))
    return [Value(size, unit, source=source) for size, unit in pairs if size is not None]


def _accuracy(verdict: Verdict) -> Conclusion:
    """Of an accuracy that nobody told."""
    noise, how = verdict.noise, "verdict: noise, accuracy"
    known = _sds(noise.accuracy_rotation_deg, noise.accuracy_translation_mm, how)
    names = {"accuracy": listed(f"{one:unit}" for one in known)}
    return Conclusion("accuracy", "check", {"value": known[0]}, names)


def _noise(verdict: Verdict) -> Conclusion:
    noise = verdict.noise
    known = _sds(noise.rotation_sd_deg, noise.translation_sd_mm, "verdict: noise")
    if not noise.source or not known:
        return Conclusion("noise", "stop_none")
    names = {"noise": listed(f"{one:unit}" for one in known)}
    told = "ok_repeats" if noise.source == REPEATS else "check_assumed"
    return Conclusion("noise", told, {"value": known[0]}, names)


def _tests(verdict: Verdict) -> Iterator[Conclusion]:
    """Whether the tests can show the effects that were tried."""
    blind = [general(one.name) for one in verdict.not_testable]
    tried = len(blind) + len(verdict.smallest_detectable)
    if not tried:
        return
    how = "verdict: not_testable, smallest_detectable"
    values = {"blind": Value(len(blind), source=how), "tried": Value(tried, source=how)}
    light = "ok" if not blind else "check" if 2 * len(blind) <= tried else "stop"
    yield Conclusion("tests", light, values, {"names": listed(blind, len(blind))})


def _predicted(held_out: pd.DataFrame, gap: pd.DataFrame) -> Conclusion:
    """Whether the rest determines what was left out."""
    folds = len(held_out)
    scored = int(held_out["gap_base"].notna().sum()) if folds else 0
    tests = held_out[held_out["kind"] == "test"] if folds else held_out
    told = int(tests["readings"].sum()) if folds else 0
    every = int(gap["readings"].sum()) if len(gap) else 0
    values = {
        "lost": Value(folds - scored, source="held_out: rows without a score"),
        "told": Value(told, source="held_out: readings of tests"),
        "readings": Value(every, source="gap: readings"),
    }
    names = {"folds": count(folds, "part")}
    light = "check_none" if not scored else "ok" if scored == folds else "check_some"
    light = "ok_halves" if light == "ok" and tests.empty else light
    light = "check_few" if light == "ok" and len(tests) and 2 * told < every else light
    return Conclusion("predicted", light, values, names)


def _set_up(verdict: Verdict, imperfections: pd.DataFrame) -> Iterator[Conclusion]:
    """Whether small errors of the set-up are as small as the study says.

    Outside its tolerance is an error whose size, in prior SDs, chance would exceed in one cohort of
    a hundred, all errors counted (Bonferroni). So are means over several, as the search has it.
    """
    taken = verdict.imperfections
    if taken is None or imperfections.empty:
        return
    rows = imperfections[imperfections["model"] == WITH_EFFECTS]
    each = rows[rows["places"] == 1]
    sizes = each["in_prior_sds"].abs()
    beyond = each[sizes > norm.isf(0.5 * CHANCE / max(len(each), 1))]
    common = rows[rows["common"]]
    if len(beyond) or len(common):
        rows = beyond if len(beyond) else common
        row = largest(rows, rows["in_prior_sds"].abs())
        values = _sizes(row) | {"beyond": Value(len(beyond), source="imperfections: in_prior_sds")}
        yield Conclusion("set_up", "stop" if len(beyond) else "check", values, _place(row))
    elif taken.gap_without is None:
        yield Conclusion("set_up", "ok_alone")
    else:
        change = Value(taken.gap_without - taken.gap_with, source="verdict: imperfections")
        yield Conclusion(
            "set_up", "ok" if change.number < LITTLE else "ok_more", {"change": change}
        )


def _sizes(row: pd.Series) -> dict[str, Value]:
    unit, factor = _UNITS.get(row["unit"], row["unit"]), 100.0 if row["unit"] == "1" else 1.0
    how = "imperfections: value and prior_sd, with effects"
    return {
        "size": Value(factor * float(row["value"]), unit, source=how),
        "allowed": Value(factor * float(row["prior_sd"]), unit, source=how),
    }


def _place(row: pd.Series) -> dict[str, str]:
    """``joint centre (right, all joints, s01)``."""
    load = row["kind"] in ("load_axis", "load_gain")
    local, every = (row["test"], "all tests") if load else (row["joint"], "all joints")
    parts = [
        row["component"] if row["component"] in ("anterior", "superior", "right") else "",
        every if local == EVERY[0] else plain(local) if load else level(local),
        "all specimens" if row["specimen"] == EVERY[0] else row["specimen"],
    ]
    return {
        "kind": SET_UP.get(row["kind"], plain(row["kind"])),
        "where": ", ".join(filter(None, parts)),
    }


def _sample(
    study: Discrepancy, cohort: Cohort, verdict: Verdict, results: ResultTables
) -> Iterator[Conclusion]:
    """How much there is, how a name was decided upon, and the methods."""
    gap = results.table("gap")
    specimens = len(cohort.specimen_names)
    values = {"readings": Value(len(gap), source="gap: rows")}
    names = {"specimens": count(specimens, "specimen"), "base": _BASES[study.base.stiffness]}
    light = "ok" if specimens >= FEW_SPECIMENS else "check"
    yield Conclusion("sample", light, values, names)
    if verdict.noise.outliers_left_out:
        n = Value(verdict.noise.outliers_left_out, source="verdict: noise")
        yield Conclusion("outliers", "check", {"n": n})
    if verdict.threshold.log_evidence is None:
        return
    tests = len(study.tests or cohort.tests)
    values = {
        "tests": Value(tests, source="settings and cohort: tests"),
        "tried": Value(
            len(verdict.smallest_detectable) + len(verdict.not_testable),
            source="verdict: smallest_detectable, not_testable",
        ),
        "needed": Value(SURE, source="a name is said from here on"),
    }
    yield Conclusion("methods", "searched", values, names)
    left_out = {(True, True): "both", (True, False): "tests", (False, True): "specimens"}
    yield Conclusion("method_left_out", left_out.get((tests > 1, specimens > 1), "steps"))
