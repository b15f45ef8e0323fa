"""What further parts of a joint-pose study conclude: other starts, damping, precision, sampler."""

from collections.abc import Iterator, Mapping

import numpy as np
import pandas as pd
from statsmodels.stats.proportion import proportion_confint

from spinepipe.report.conclusions import Conclusion, Value
from spinepipe.report.page.study_page import ResultTables
from spinepipe.report.words import listed
from spinepipe.status import Status
from spinepipe.studies.joint_pose_sensitivity.retained import (
    COLUMN,
    FACTOR,
    READ,
    REST,
    RetainedStiffness,
    other_fits,
    percentiles,
)
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity

FIT = ["specimen", "bootstrap", "loading", "set"]
FEWEST_FITS = 10
"""Fits from other starts or with other damping of which quartiles are told."""

ALIKE = 0.5
"""Where weights count for more than this share of the poses, the data hardly prefer any."""

IN_BAND = 0.9
"""Of the readings that lie in a 95 % band: fewer speak against the model."""


def conclusions(study: JointPoseSensitivity, results: ResultTables) -> Iterator[Conclusion]:
    """Of parts that tell no stiffness."""
    counts = results.table("counts")
    if len(counts):
        rows = counts[counts["part"] != "poses"]
        fits, lost = int(rows["fits"].sum()), int((rows["fits"] - rows["solved"]).sum())
        boots = results.table("bootstrap")
        each = boots if boots.empty else boots.drop_duplicates(FIT)["status"]
        bounded = int((each == Status.CONVERGED_AT_BOUND.value).to_numpy().sum())
        values = {"fits": Value(fits), "lost": Value(lost, source="counts: fits less solved")}
        values["bounded"] = Value(bounded, source="bootstrap: status")
        if fits:
            yield Conclusion("boots", "check" if lost or bounded else "ok", values)
    yield from _precision(study, results.table("required_precision"))
    yield from _sampled(results)


def bootstraps(
    study: JointPoseSensitivity, main: RetainedStiffness, results: ResultTables
) -> Iterator[Conclusion]:
    """How far start values, loading and damping move the stiffness that the answer tells.

    A fit under which a moving spine never comes to rest has no stiffness, not an infinite one.
    """
    fits = results.table("bootstrap")
    if fits.empty:
        return
    fits = fits[fits["specimen"] == main.specimen]
    each = fits.drop_duplicates(FIT)
    found = other_fits(study, fits[~fits["message"].str.contains("no rest", regex=False)], main)
    # quartiles of few say nothing, those at a bound have no number
    enough = {key: values for key, values in found.items() if len(values) >= FEWEST_FITS}
    ends = {key: percentiles(values, 25.0, 50.0, 75.0) for key, values in enough.items()}
    ends = {key: three for key, three in ends.items() if np.isfinite(three).all()}
    spread = {key: 100.0 * float((three[2] - three[0]) / three[1]) for key, three in ends.items()}
    moved, names = main.moved[0], {"stiffness": main.name}
    if ("start", REST) in ends:
        at_rest = each[(each["bootstrap"] == "start") & (each["loading"] == REST)]
        n = {"fits": len(at_rest), "left": len(at_rest) - len(found["start", REST])}
        n["bounded"] = int((at_rest["status"] == Status.CONVERGED_AT_BOUND.value).sum())
        counted = {name: Value(count, source="bootstrap: at rest") for name, count in n.items()}
        yield _moved("starts", spread["start", REST], moved, names, **counted)
        medians = {
            loading: float(three[1]) for (what, loading), three in ends.items() if what == "start"
        }
        at = max(medians, key=lambda loading: abs(medians[loading] - medians[REST]))
        if len(medians) > 1:
            change = 100.0 * (medians[at] / medians[REST] - 1.0)
            yield _moved("loading", change, moved, {**names, "loading": READ[at]})
    drawn = each[each["bootstrap"] == "damping"]
    damped = {loading: share for (what, loading), share in spread.items() if what == "damping"}
    if damped:
        at = max(damped, key=lambda loading: damped[loading])
        more = {"factor": Value(study.damping_bootstrap.factor, source="settings: factor")}
        one = _moved("damping", damped[at], moved, {**names, "loading": READ[at]}, **more)
        # "at most" is of all loadings, also of those whose quartiles are not told
        if one.verdict == "more" or len(damped) == drawn["loading"].nunique():
            yield one


def _moved(
    rule: str, share: float, moved: float, names: Mapping[str, str], **more: Value
) -> Conclusion:
    """By how much, %, beside what palpation does."""
    source = "bootstrap: retained fits, quartiles and medians"
    value = Value(round(share, 2), "%", source=source)
    verdict = "more" if abs(share) > moved else "less"
    return Conclusion(rule, verdict, {"value": value, **more}, names)


def _precision(study: JointPoseSensitivity, rows: pd.DataFrame) -> Iterator[Conclusion]:
    """The largest landmark SD that will do, with stiffness fitted to each pose.

    Of several specimens the one that needs the most precise landmarks.
    """
    if rows.empty:
        return
    asked = study.landmark_precision
    limits = {
        "translation": f"{asked.translation_limit_mm:g}\u00a0mm",
        "rotation": f"{asked.rotation_limit_deg:g}°",
    }
    limits = {"both": " and ".join(limits.values()), **limits}
    # where there is no row of both, one kind of motion alone was measured
    motion = next(name for name in limits if (rows["motion"] == name).any())
    own = rows[(rows["motion"] == motion) & (rows["stiffness"] == "calibrated")]
    own = own[own["nominal_share"].notna()]
    if own.empty:
        return
    names, source = {"limits": limits[motion]}, "required_precision: "
    share = Value(100.0 * asked.share, "%", source="settings: landmark_precision")
    worst, n = float(own["nominal_share"].max()), int(own["n"].min())
    if worst >= 1.0:
        over = Value(worst, source=f"{source}nominal_share")
        yield Conclusion("precision", "model", {"value": over, "share": share}, names)
        return
    if float(proportion_confint(n, n, method="wilson")[0]) < asked.share:
        poses = Value(n, "poses", source=f"{source}n")
        yield Conclusion("precision", "few", {"value": poses, "share": share}, names)
        return
    known, open_ = own[own["sd_mm"].notna()], own[own["sd_mm"].isna()]
    short = open_[open_["message"].str.contains("will not do")]
    if len(short) or known.empty:
        sd = min(asked.sd_mm) if len(short) else max(asked.sd_mm)
        value = Value(float(sd), "mm", source=f"{source}message")
        verdict = "not_enough" if len(short) else "enough"
    else:
        row = min(known.to_dict("records"), key=lambda row: row["sd_mm"])
        low, high = (
            None if pd.isna(row[f"sd_{end}_mm"]) else row[f"sd_{end}_mm"] for end in ("low", "high")
        )
        value = Value(float(row["sd_mm"]), "mm", low, high, n, f"{source}sd_mm")
        verdict = "known"
    yield Conclusion("precision", verdict, {"value": value, "share": share}, names)


def posterior(main: RetainedStiffness, results: ResultTables) -> Iterator[Conclusion]:
    """The interval of the stiffness that the answer tells, with landmarks as unknowns too."""
    rows = results.table("posterior")
    if rows.empty:
        return
    same = (rows["status"] == Status.CONVERGED.value) & (rows["quantity"] == "stiffness")
    same &= (rows["specimen"] == main.specimen) & (rows["joint"] == main.joint)
    for row in rows[same & (rows["unknown"] == COLUMN[main.coordinate])].to_dict("records"):
        middle, low, high = (
            FACTOR[main.coordinate] * row[name] for name in ("median", "low", "high")
        )
        source = "posterior: 95 % of the draws"
        is_open = bool(row["open_below"]), bool(row["open_above"])
        verdict, value = {
            (False, False): ("closed", Value(middle, main.unit, low, high, source=source)),
            (False, True): ("above", Value(low, main.unit, source=source)),
            (True, False): ("below", Value(high, main.unit, source=source)),
            (True, True): ("open", None),
        }[is_open]
        values = {} if value is None else {"value": value}
        yield Conclusion("posterior", verdict, values, {"stiffness": main.name})


def _sampled(results: ResultTables) -> Iterator[Conclusion]:
    """Whether the sampler converged, its band, and whether the readings prefer palpations."""
    rows, motion = results.table("posterior"), results.table("posterior_motion")
    if rows.empty:
        return
    lost = sorted(set(rows.loc[rows["status"] != Status.CONVERGED.value, "specimen"]))
    several = f"{len(lost)} specimens" if len(lost) > 1 else listed(lost)
    yield Conclusion("sampler", "check" if lost else "ok", names={"specimens": several})
    if len(motion):
        converged = motion["status"] == Status.CONVERGED.value
        read = motion.loc[converged & motion["inside"].notna(), "inside"].astype(bool)
        source = "posterior_motion: inside"
        values = {"inside": Value(int(read.sum()), n=len(read), source=source)}
        values["readings"] = Value(len(read), source=source)
        if len(read):
            yield Conclusion("band", "ok" if read.mean() >= IN_BAND else "check", values)
    weights = results.table("pose_weights")
    if weights.empty:
        return
    each = weights.drop_duplicates(["specimen", "pose"]).groupby("specimen")["weight"]
    # weights of n poses that are alike count for n: one over the sum of their squares
    counted = pd.DataFrame({"poses": each.size(), "alike": 1.0 / each.agg(lambda w: (w**2).sum())})
    counted = counted[each.sum() > 0.0]
    if len(counted):
        least = (
            counted.assign(share=counted["alike"] / counted["poses"]).nsmallest(1, "share").iloc[0]
        )
        source = "pose_weights: one over the sum of squares, least of specimens"
        values = {
            "poses": Value(int(least["poses"]), source="pose_weights: poses"),
            "alike": Value(round(float(least["alike"])), source=source),
        }
        alike = least["alike"] > ALIKE * least["poses"]
        yield Conclusion("poses", "alike" if alike else "preferred", values)
