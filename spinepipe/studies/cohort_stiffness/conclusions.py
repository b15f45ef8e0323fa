"""What a study of stiffness concludes; the sentences stand in conclusions.csv."""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.experiment.double_sigmoid import Zone
from spinepipe.report.conclusions import Conclusion, Value, numbers_from
from spinepipe.report.page.study_page import ResultTables
from spinepipe.report.words import SIGNS, count, level, listed, plain, short
from spinepipe.status import USABLE
from spinepipe.studies.cohort_stiffness.claims import FEWEST
from spinepipe.studies.cohort_stiffness.conclusions_of_claims import (
    UNSEEN,
    claim_conclusions,
    covariate_conclusions,
)
from spinepipe.studies.cohort_stiffness.conclusions_of_stiffness import (
    directions,
    joint_values,
    stiffness_conclusions,
)
from spinepipe.studies.cohort_stiffness.loop_rows import paired_curves
from spinepipe.studies.cohort_stiffness.representations import (
    NUISANCE,
    POOLED,
    PUBLISHED,
    STIFFENING,
    named,
)
from spinepipe.studies.cohort_stiffness.settings import (
    CohortStiffness,
    label_of_others,
    load_cases,
    representations_of,
    zone_formula,
)
from spinepipe.studies.cohort_stiffness.stages import joint_label_of
from spinepipe.studies.cohort_stiffness.tables import MEASURED, WHOLE

LARGE, SMALL = 1.5, 0.7
"""Residuals as multiples of the reading noise beyond which law or noise is not as assumed."""

MANY = 0.1
"""Share of fits lost, or of curves or loops beyond noise, above which a verdict changes."""

MOST_PLACES = 4

MOTION = {"fitted": "fitted motion", **UNSEEN}
"""Whose error a criterion of the table ``ranking`` is."""

SAME = 0.01
"""Errors of one joint that differ by a smaller share are the same; pooling alone makes any."""

FAR = 3.0
"""SDs of a prior beyond which hardly anything of it lies: one in 370."""


def conclusions(
    study: CohortStiffness, cohort: Cohort, results: ResultTables
) -> Iterator[Conclusion]:
    """All of them."""
    table, specimens = results.table, len(cohort.specimen_names)
    stiffness, fits, signs = (table(name) for name in ("stiffness", "fits", "sign_checks"))
    values = joint_values(stiffness)
    scatter = _scatter(fits, values)
    yield from stiffness_conclusions(values, study.free)
    yield from _trust(study, signs, values, scatter)
    needed = numbers_from("cohort: specimens", n=specimens, needed=FEWEST)
    words = {"specimens": count(specimens, "specimen")}
    yield Conclusion("sample", "few" if specimens < FEWEST else "ok", needed, words)
    same = one_joint_errors(table("ranking"), len(cohort.joint_names))
    if len(same):
        row = same.sort_values("criterion").to_dict("records")[-1]
        error = Value(row["value"], SIGNS[row["unit"]], n=row["specimens"], source="ranking: value")
        yield Conclusion(
            "descriptions", "same", {"error": error}, {"what": MOTION[row["criterion"]]}
        )
    if specimens >= FEWEST:
        told = claim_conclusions(study, values, table("findings"))
        yield from (one for one in told if one.rule != "descriptions" or same.empty)
    if study.base is not None:
        yield Conclusion("left_out", "base")
    yield from covariate_conclusions(table("covariates"))
    yield from _quality(study, fits, values, scatter)
    yield from _checks(study, specimens, stiffness, signs, values)
    if set(study.representations) - set(representations_of(study, cohort.joint_names)):
        yield Conclusion("ratios", "check")
    yield from _priors(table("nuisances"))
    yield from _experiments(study, table("load_displacement"), table("helical_axes"))
    yield from _methods(study, stiffness, specimens)


def _scatter(fits: pd.DataFrame, values: pd.DataFrame) -> Value | None:
    """Residuals of the fits whose stiffness is told, in SDs of a reading: median of specimens."""
    if fits.empty or values.empty:
        return None
    found = fits[_behind(fits, values)]["scatter"].dropna().astype(float)
    source = "fits: scatter, median"
    return Value(float(found.median()), n=len(found), source=source) if len(found) else None


def _behind(fits: pd.DataFrame, values: pd.DataFrame) -> pd.Series:
    """Which fits have the stiffness that is told: of its description, to all load cases."""
    told = fits["representation"].isin(values["representation"].unique()[:1])
    return told & (fits["fitted_to"] == joint_label_of(fits))


def _trust(
    study: CohortStiffness, signs: pd.DataFrame, values: pd.DataFrame, scatter: Value | None
) -> Iterator[Conclusion]:
    """What the answer depends on, what forbids it first."""
    names = {"flipped": "flipped", "wrong": "implausible", "moved": "as_expected"}
    rows = {name: signs[signs["verdict"] == word] for name, word in names.items() if len(signs)}
    if rows:
        counts = {name: len(part) for name, part in rows.items()} | {"n": len(signs)}
        counts["moved"] += counts["wrong"]
        numbers = numbers_from("sign_checks: verdict", **counts)
        places = [
            f"{short(row['specimen'])} {level(row['joint'])} in {plain(row['test'])}"
            for row in rows["flipped"].to_dict("records")
        ]
        light = "check_untold" if counts["moved"] < len(signs) else "ok"
        if counts["wrong"]:
            yield Conclusion("trust", "sizes", numbers)
            light = "check_sizes"
        if places:
            verdict = "stop_flipped_many" if len(places) > MOST_PLACES else "stop_flipped"
            yield Conclusion("trust", verdict, numbers, {"places": listed(places)})
            light = "stop"
        yield Conclusion("signs", light, numbers)
    if study.base is not None:
        yield Conclusion("trust", "base")
    if scatter is not None:
        name = str(values["representation"].iloc[0])
        words = {"described": named(name).sentence}
        words["centres"] = "fitted, too" if name in NUISANCE else "as stated"
        verdict = "misfit" if scatter.number >= LARGE else "law"
        verdict = "no_noise" if study.cost == "published" else verdict
        if verdict != "law" or study.base is None:
            yield Conclusion("trust", verdict, {"scatter": scatter}, words)


def one_joint_errors(ranking: pd.DataFrame, joints: int) -> pd.DataFrame:
    """Errors of linear descriptions that are the same, as there is one joint; else no rows.

    They differ where a load case is predicted with a stiffness that the others do not bound.
    """
    if joints > 1 or ranking.empty:
        return ranking[:0]
    special = ranking["representation"].isin({*PUBLISHED, *STIFFENING, *NUISANCE})
    rows = ranking[~special & ranking["criterion"].isin(MOTION)].dropna(subset="value")
    groups = rows.groupby("criterion")["value"]
    far = groups.transform("max") > (1.0 + SAME) * groups.transform("min")
    same = rows[~far & groups.transform("count").gt(1)]
    return same if (same["criterion"] == "fitted").any() else same[:0]


def _quality(
    study: CohortStiffness, fits: pd.DataFrame, values: pd.DataFrame, scatter: Value | None
) -> Iterator[Conclusion]:
    """Fits that ended without a stiffness or hang on their start, values not bounded, residuals."""
    if len(fits):
        lost = fits.loc[~fits["status"].isin(USABLE), "status"]
        several = fits["n_optima"] > 1
        told = int((several & _behind(fits, values)).sum())
        counts = {"n": len(fits), "lost": len(lost), "several": int(several.sum()), "told": told}
        numbers = numbers_from("fits: status, n_optima", **counts)
        verdict = "ok" if lost.empty else "check" if len(lost) <= MANY * len(fits) else "stop"
        why = [f"{n} {plain(str(name))}" for name, n in lost.value_counts().items()]
        yield Conclusion("fits", verdict, numbers, {"why": listed(why)})
        verdict = "check" if told else "ok_others" if several.any() else "ok"
        yield Conclusion("starts", verdict, numbers)
    if len(values):
        lost_values = int(values["value"].isna().sum())
        counts = {"n": len(values), "lost": lost_values}
        numbers = numbers_from("stiffness: identifiable, at_bound", **counts)
        yield Conclusion("bounded", "check" if lost_values else "ok", numbers)
    if study.cost == "published":
        yield Conclusion("noise", "check_none")
    elif scatter is not None:
        verdict = "check_large" if scatter.number >= LARGE else "ok"
        verdict = "check_small" if scatter.number < SMALL else verdict
        yield Conclusion("noise", verdict, {"scatter": scatter})


def _checks(
    study: CohortStiffness,
    specimens: int,
    stiffness: pd.DataFrame,
    signs: pd.DataFrame,
    values: pd.DataFrame,
) -> Iterator[Conclusion]:
    """What was left out and predicted, and with what that nothing bounds."""
    if study.base is not None:
        yield Conclusion("checks", "check_base")
        return
    held = study.cross_validation
    words = {"why": "the study asks for none" if specimens > 1 else "there is one specimen"}
    verdict = {
        (True, True): "ok",
        (False, True): "check_cases_alone",
        (True, False): "check_specimens_alone",
        (False, False): "check_neither",
    }[held.specimens and specimens > 1, held.load_cases]
    yield Conclusion("checks", verdict, names=words)
    if not held.load_cases or values.empty or signs.empty:
        return
    own = stiffness[stiffness["representation"] == values["representation"].iloc[0]]
    own = own[own["source"] == "own"]
    parts = [
        own[(own["fitted_to"] == label) & (own["coordinate"] == driven)]
        for test, driven in signs[["test", "coordinate"]].drop_duplicates().to_numpy(str)
        if (label := label_of_others(own["fitted_to"].unique(), test)) is not None
    ]
    known = pd.concat([own[:0], *parts])["identifiable"].eq(True)
    if len(known) and not known.all():
        numbers = numbers_from("stiffness: identifiable", n=len(known), lost=int((~known).sum()))
        yield Conclusion("left_out_stiffness", "check", numbers)


def _priors(rows: pd.DataFrame) -> Iterator[Conclusion]:
    """Errors of joint centres and axes that were fitted beside."""
    whole = rows[rows["fitted_to"] == joint_label_of(rows)] if len(rows) else rows
    if len(whole):
        far = int((whole["pull"].abs() > FAR).sum())
        bounded = whole["standard_error"].astype(float) < 0.5 * whole["prior_sd"].astype(float)
        numbers = {"n": len(whole), "far": far, "bounded": int(bounded.sum())}
        values = numbers_from("nuisances: pull, standard_error", **numbers)
        yield Conclusion("priors", "check" if far else "ok", values)


def _experiments(
    study: CohortStiffness, curves: pd.DataFrame, axes: pd.DataFrame
) -> Iterator[Conclusion]:
    """What laboratories report of the tests: measured, and by the fitted model."""
    if len(curves):
        yield from ranges(paired_curves(curves, "range_of_motion", "deg"))
        yield from _zones(curves, study.neutral_zone)
        loops = paired_curves(curves, "hysteresis_area", "j").dropna(subset=["measured"])
        sure = int((loops["measured"] - loops["measured_way"] > 0.0).sum())
        values = numbers_from("load_displacement: hysteresis area", n=len(loops), sure=sure)
        if len(loops):
            work = float(loops["measured"].median())
            values["work"] = Value(work, "J", n=len(loops), source="load_displacement: median")
        many = sure > MANY * len(loops)  # chance alone lets some of many lose work
        verdict = ("lost" if many else "none") if len(loops) else "check"
        yield Conclusion("hysteresis", verdict, values)
    measured = axes[axes["source"] == MEASURED] if len(axes) else axes
    if len(measured):
        placed = measured[measured["status"] == WHOLE]
        values = numbers_from("helical_axes: status", n=len(measured), placed=len(placed))
        names = [f"centre_{axis}_sd_mm" for axis in ("anterior", "superior", "right")]
        sds = placed[names].astype(float).dropna()
        if len(sds):
            sd = float(np.median(np.linalg.norm(sds.to_numpy(), axis=1)))
            values["sd"] = Value(sd, "mm", n=len(sds), source="helical_axes: SD, median")
        verdict = "placed" if len(sds) else "no_noise" if len(placed) else "check"
        yield Conclusion("axes", verdict, values)


def ranges(pairs: pd.DataFrame) -> Iterator[Conclusion]:
    """How far joints move, and how far the fitted model does.

    The model was fitted to these readings, so what it is unsure of is part of their noise:
    residuals of a least squares fit have the variance of the readings less that of the model, not
    the sum (Cook and Weisberg, Residuals and influence in regression, 1982, section 2.1).
    """
    found = pairs.dropna(subset=["measured", "simulated"])
    if found.empty:
        return
    off = (found["simulated"] - found["measured"]).abs()
    square = found["measured_way"] ** 2 - found["simulated_way"] ** 2
    known = square > 0.0  # where the model is as unsure as the readings, there is no limit
    n, outside = int(known.sum()), int((off[known] ** 2 > square[known]).sum())
    source = "load_displacement: range of motion, simulated less measured"
    counts = {"n": len(off), "known": n, "outside": outside, "inside": n - outside}
    values = {"middle": Value(float(off.median()), "°", n=len(off), source=source)}
    verdict = "no_noise" if not n else "differ" if outside > MANY * n else "agree"
    yield Conclusion("ranges", verdict, values | numbers_from(source, **counts))


def _zones(rows: pd.DataFrame, definition: str) -> Iterator[Conclusion]:
    """How many curves are softer in the middle: a sigmoid fits better than a line, beyond noise."""
    bent = (Zone.FOUND.value, Zone.NOT_DESCRIBED.value)
    measured, model = (rows[(rows["source"] == MEASURED) == own] for own in (True, False))
    asked = measured[measured["neutral_zone"].isin([*bent, Zone.NOT_MEANINGFUL.value])]
    soft, of_model = (part[part["neutral_zone"].isin(bent)] for part in (asked, model))
    counts = {"n": len(asked), "soft": len(soft), "model": len(of_model)}
    values = numbers_from("load_displacement: neutral_zone", **counts)
    zone = soft["neutral_zone_deg"].dropna().astype(float)
    if len(zone):
        middle = float(zone.median())
        values["zone"] = Value(middle, "°", n=len(zone), source="load_displacement: median")
    verdict = "straight" if soft.empty else "soft" if len(zone) else "soft_shapeless"
    if definition != "double_sigmoid":
        values |= numbers_from("load_displacement: neutral_zone", soft=len(zone))
        verdict = "named" if len(zone) else "named_none"
    yield Conclusion("zones", verdict if len(asked) else "check", values)


def _methods(study: CohortStiffness, stiffness: pd.DataFrame, n: int) -> Iterator[Conclusion]:
    tests = load_cases(stiffness["fitted_to"]) if len(stiffness) else ()
    words = {"directions": directions(study.free), "tests": count(len(tests), "load case")}
    verdict = "published" if study.cost == "published" else "noise"
    yield Conclusion("methods", verdict, numbers_from("cohort: specimens", n=n), words)
    yield Conclusion("methods_more", "neutral_zone", names={"formula": zone_formula(study)})
    if set(study.representations) & set(POOLED):
        yield Conclusion("methods_more", "pooled")
    if n >= FEWEST:
        yield Conclusion(
            "methods_more", "claims", names={"significance": f"{study.significance:g}"}
        )
    if study.base is not None:
        yield Conclusion("methods_more", "base")
