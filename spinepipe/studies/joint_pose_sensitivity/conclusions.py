"""What a study of joint poses concludes of stiffness; the sentences stand in conclusions.csv.

All numbers of palpation are those of the retained fits, see `retained`. What motion, checks and
further parts of the study conclude stands in `conclusions_of_motion` and `conclusions_of_parts`.
"""

from collections.abc import Iterator, Sequence
from math import isfinite

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.frames import FRAME_LANDMARKS
from spinepipe.report.conclusions import Conclusion, Value
from spinepipe.report.page.study_page import ResultTables
from spinepipe.report.words import AXIS, listed
from spinepipe.status import USABLE, Status
from spinepipe.studies.joint_pose_sensitivity import conclusions_of_motion as of_motion
from spinepipe.studies.joint_pose_sensitivity import conclusions_of_parts as of_parts
from spinepipe.studies.joint_pose_sensitivity.checks import has_force
from spinepipe.studies.joint_pose_sensitivity.retained import (
    COLUMN,
    FACTOR,
    FEWEST,
    RetainedStiffness,
    effect_on,
    most_moved,
    moved_by_load,
    named,
    retained,
    stiffnesses,
)
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity

MANY = 100
"""Fits of a specimen from which on the middle half is known to about a tenth of itself."""

MOST_LEFT_OUT = 0.5
"""Of the fits: where more are left out, the others no longer stand for palpation."""


def conclusions(
    study: JointPoseSensitivity, cohort: Cohort, results: ResultTables
) -> Iterator[Conclusion]:
    """All of them."""
    found = stiffnesses(study, cohort, results.tables)
    main = most_moved(found)
    yield from _palpation(found, main, results)
    yield from _landmarks(study, cohort)
    if not study.load_point.asked and has_force(study, cohort):
        yield Conclusion("load_place", "known")
    if main:
        yield from _load_points(main, results)
        yield from _readings(main)
        yield from of_parts.bootstraps(study, main, results)
        yield from of_parts.posterior(main, results)
    enough = [one for one in found if len(one.values) >= FEWEST]
    if enough:
        yield _identified(enough)
    yield from of_motion.conclusions(study, cohort, results)
    yield from of_parts.conclusions(study, results)
    yield from _fits(study, results)
    yield from _methods(study, results)


def _palpation(
    found: Sequence[RetainedStiffness], main: RetainedStiffness | None, results: ResultTables
) -> Iterator[Conclusion]:
    """How far palpation moves stiffness, beside where the load acts: the answer and key numbers."""
    if main is None:
        kept = max((len(one.values) for one in found), default=0)
        values = {"kept": Value(kept, source="success: reduced")}
        names: dict[str, str] = {}
        verdict = "none" if not kept else "few" if kept < FEWEST else "open"
        bounded = [one for one in found if len(one.values) >= FEWEST and not one.open]
        if bounded:
            least = min(bounded, key=lambda one: one.at_bound / len(one.values))
            verdict, names = "bounded", {"stiffness": least.name}
            values["at_bound"] = _share([least], [least.at_bound], "at a bound")
        yield Conclusion("palpation", verdict, values, names)
        return
    alike = [one for one in found if one.coordinate == main.coordinate and one.told]
    share, low, high = main.moved
    n, how = len(main.values), "calibrations: middle half of retained fits over their median"
    moved = Value(share, "%", low, high, n, how)
    effect = effect_on(main, results.table("load_point_effect"))
    load = None if effect is None else moved_by_load(effect)
    values, names = {"value": Value(share, "%", n=n, source=how)}, {"stiffness": main.name}
    if load is not None and effect is not None:
        how = "load_point_effect: change per mm times SD, middle half of a normal distribution"
        values["load"] = Value(load, "%", source=how)
        sds = [
            f"{effect[f'{way}_sd_mm']:g} mm {way}"
            for way in ("anterior", "superior")
            if effect[f"{way}_sd_mm"] > 0.0
        ]
        yield Conclusion("load", "told", {"value": values["load"]}, {"sds": listed(sds)})
        yield Conclusion("load_place", "stated", names={"sds": listed(sds)})
    if len(alike) > 1:
        values["rows"] = Value(len(alike), source="calibrations: stiffnesses of this direction")
        yield Conclusion("palpation", "several", values, names)
    elif load is None:
        values["kept"] = Value(n, source="success: reduced")
        yield Conclusion("palpation", "alone", values, names)
    else:
        verdict = "more" if load > high else "less" if load < low else "alike"
        yield Conclusion("palpation", verdict, values, names)
    yield Conclusion("spread", "told", {"value": moved}, names)
    low, middle, high = map(float, main.at(25.0, 50.0, 75.0))
    how = "calibrations: median and quartiles of retained fits"
    told = {"value": Value(middle, main.unit, low, high, n, how)}
    yield Conclusion("median", "told", told, names)
    if None not in main.region:
        how = "calibrations: median ends of the 95 % regions of retained fits"
        region = Value(middle, main.unit, *main.region, n, how)
        open_ = _share([main], [main.lost], "not identifiable")
        yield Conclusion("region", "told", {"value": region, "open": open_}, names)


def _share(of: Sequence[RetainedStiffness], counts: Sequence[int], what: str) -> Value:
    """Of the retained fits of some stiffnesses, those that were counted."""
    fits = sum(len(one.values) for one in of)
    return Value(100.0 * sum(counts) / fits, "%", n=fits, source=f"calibrations: {what}")


def _load_points(main: RetainedStiffness, results: ResultTables) -> Iterator[Conclusion]:
    """Whether the readings exclude load points, and what stiffness does over the others."""
    effect = effect_on(main, results.table("load_point_effect"))
    if effect is None:
        return
    tried = results.table("stiffness_over_load_point")
    own = tried[(tried["specimen"] == main.specimen) & (tried["joint"] == main.joint)]
    usable = own[own["status"].isin(USABLE) & own[f"{main.coordinate}_identifiable"].eq(True)]
    values = usable.loc[usable["allowed"].ne(False), COLUMN[main.coordinate]].astype(float)
    if values.empty:
        return
    low, high = (FACTOR[main.coordinate] * float(end) for end in (values.min(), values.max()))
    reach = 100.0 * (high - low) / (FACTOR[main.coordinate] * float(effect["stated"]))
    told = own["allowed"].dropna().astype(bool)
    excluded = int((~told).sum())
    how = "stiffness_over_load_point: "
    found = {
        "points": Value(len(own), source=f"{how}rows"),
        "excluded": Value(excluded, source=f"{how}not allowed"),
        "low": Value(low, main.unit, source=f"{how}least of allowed and identifiable"),
        "high": Value(high, main.unit, source=f"{how}largest of allowed and identifiable"),
        "reach": Value(reach, "%", source=f"{how}largest less least, over stated"),
    }
    verdict = "excluded" if excluded else "none_excluded" if len(told) else "too_few"
    verdict = "no_effect" if reach <= main.moved[0] else verdict
    shifts = {way: own[f"{way}_shift_mm"].astype(float) for way in ("anterior", "superior")}
    ways = [f"{mm.min():g} to {mm.max():g} mm {way}" for way, mm in shifts.items()]
    names = {"stiffness": main.name, "shifts": listed(ways).replace("-", "−")}
    yield Conclusion("load_points", verdict, found, names)


def _readings(main: RetainedStiffness) -> Iterator[Conclusion]:
    """The region of one fit beside the middle 95 % over palpations."""
    low, high = main.region
    first, last = map(float, main.at(2.5, 97.5))
    if low is None or high is None or not isfinite(last - first):
        return
    how = "calibrations: median and median ends of the 95 % regions of retained fits"
    middle = float(main.at(50.0)[0])
    region = Value(middle, main.unit, low, high, len(main.values), how)
    between = Value(middle, main.unit, first, last)
    verdict = "wider" if high - low > last - first else "narrower"
    names = {"between": f"{between:interval} {main.unit}", "unit": main.unit}
    yield Conclusion("readings", verdict, {"value": region}, {"stiffness": main.name, **names})


def _identified(found: Sequence[RetainedStiffness]) -> Conclusion:
    """Which stiffnesses have no number, and how many fits do not identify them or are at a bound.

    Parameters
    ----------
    found : those with enough retained fits.
    """
    told, lost = [one for one in found if one.told], [one for one in found if one.open]
    bounded = [one for one in found if not one.told and not one.open]
    worst = max(told or found, key=lambda one: one.lost / len(one.values))
    names, what = {"worst": worst.name}, "not identifiable"
    of_worst, of_lost = (
        _share(those, [one.lost for one in those], what) for those in ([worst], lost or [worst])
    )
    values = {"lost": of_lost, "worst_lost": of_worst}
    if len(told) == len(found) or len(lost) == len(found):
        return Conclusion("identified", "all" if told else "none", values, names)
    verdict = "some" if lost and told else "bounded"
    unknown = lost if verdict == "some" else bounded
    if verdict == "bounded":
        values = {"at_bound": _share(bounded, [one.at_bound for one in bounded], "at a bound")}
    ways = list(dict.fromkeys(AXIS[one.coordinate].lower() for one in unknown))
    alone = named(unknown[0].coordinate, unknown[0].place)
    several = f"{listed(ways, most=6)} stiffness"
    whole = {one.coordinate for one in unknown} & {
        one.coordinate for one in found if one not in unknown
    }
    several += f" of {len(unknown)} specimens or joints" if whole else ""
    names["unknown"] = alone if len(unknown) == 1 else several
    return Conclusion("identified", verdict, values, names)


def _landmarks(study: JointPoseSensitivity, cohort: Cohort) -> Iterator[Conclusion]:
    """The SD that landmarks were drawn with."""
    assert cohort.landmarks is not None  # the study demands them
    own = cohort.landmarks.loc[cohort.landmarks["landmark"].isin(FRAME_LANDMARKS), "sd_mm"]
    sds = own.dropna() if study.landmark_sd_mm is None else pd.Series([study.landmark_sd_mm])
    source = "settings or cohort: sd_mm"
    least, most = (Value(float(sd), "mm", source=source) for sd in (sds.min(), sds.max()))
    verdict = "one" if least == most else "several"
    yield Conclusion("landmarks", verdict, {"least": least, "most": most})


def _fits(study: JointPoseSensitivity, results: ResultTables) -> Iterator[Conclusion]:
    """How many fits are retained and why others are not; how the retained ones ended."""
    counts = results.table("counts")
    if counts.empty:
        return
    rows = counts[counts["part"] == "poses"]
    columns = (f"near_start_{study.success.failed_when}", "fits", "outliers", "reduced")
    sums = {
        name: int(rows[column].sum())
        for name, column in zip(("unmoved", "fits", "outliers", "kept"), columns, strict=True)
    }
    sums["lost"] = sums["fits"] - int(rows["solved"].sum())
    values = {name: Value(n, source="counts: sum over specimens") for name, n in sums.items()}
    left_out = sums["fits"] - sums["kept"]
    verdict = "stop" if left_out > MOST_LEFT_OUT * sums["fits"] else "check" if left_out else "ok"
    yield Conclusion("fits", verdict, values)
    if verdict == "stop" and sums["kept"]:
        yield Conclusion("kept", "stop", values)
    every = results.table("calibrations")
    fits = retained(every, results.table("success"))
    if fits.empty:
        return
    each = fits.drop_duplicates(["specimen", "pose"])
    least = int(each.groupby("specimen").size().min())
    kept = {"kept": Value(len(each), source="success: reduced")}
    source, at_bound = "calibrations of retained fits", Status.CONVERGED_AT_BOUND.value
    bounded, inside = (
        int((one.drop_duplicates(["specimen", "pose"])["status"] == at_bound).sum())
        for one in (every, fits)
    )
    ended = {"bounded": bounded, "bounded_out": bounded - inside, "fits": sums["fits"]}
    told = {name: Value(n, source="calibrations: status") for name, n in ended.items()}
    yield Conclusion("bounds", "check" if bounded else "ok", told)
    flags = {
        "optima": ("several", fits["n_optima"] > 1),
        "freedom": ("exact", fits["degrees_of_freedom"] <= 0),
    }
    for rule, (name, flag) in flags.items():
        n = len(fits[flag].drop_duplicates(["specimen", "pose"]))
        stop = rule == "freedom" and n > MOST_LEFT_OUT * len(each)
        verdict = "stop" if stop else "check" if n else "ok"
        yield Conclusion(rule, verdict, {**kept, name: Value(n, source=source)})
    fewest = {"kept": Value(least, source="success: reduced, least of specimens")}
    yield Conclusion("sample", "ok" if least >= MANY else "check", fewest)


def _methods(study: JointPoseSensitivity, results: ResultTables) -> Iterator[Conclusion]:
    values = {
        "poses": Value(study.poses, source="settings: poses"),
        "times": Value(study.success.outlier_times_start, source="settings: success"),
    }
    ways = [AXIS[name].lower() for name in study.calibration.free if name in AXIS]
    yield Conclusion("methods", "fitted", values, {"directions": listed(ways, most=6)})
    if len(results.table("load_point_effect")):
        n = len(study.load_point.anterior_mm) * len(study.load_point.superior_mm)
        points = Value(n, source="settings: load_point")
        yield Conclusion("methods_load", "fitted", {"points": points})
    if len(results.table("posterior")):
        yield Conclusion("methods_posterior", "sampled")
