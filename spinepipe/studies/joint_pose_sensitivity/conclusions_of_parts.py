"""What further parts of a joint-pose study conclude: other starts, damping, precision, sampler."""

from collections.abc import Iterator

import pandas as pd
from statsmodels.stats.proportion import proportion_confint

from spinepipe.report.conclusions import Conclusion, Value
from spinepipe.report.page.study_page import Results
from spinepipe.report.words import listed
from spinepipe.status import Status
from spinepipe.studies.joint_pose_sensitivity.retained import COLUMN, FACTOR, FEWEST, Stiffness
from spinepipe.studies.joint_pose_sensitivity.settings import DEFAULT, EXACT, JointPoseSensitivity

FEWEST_OF_A_RATE = 10
"""Trials of which a rate is told: all of 3 leave 44 to 100 %, all of 10 leave 72 to 100 %."""

ALIKE = 0.5
"""Where weights count for more than this share of the poses, the data hardly prefer any."""

IN_BAND = 0.9
"""Of the readings that lie in a 95 % band: fewer speak against the model."""

REST = "equilibrium"
READ = {
    REST: "at rest",
    "quasi_static": "a while after loading",
    "dynamic": "at the end of a load ramp",
}
"""When motion is read under each loading."""


def conclusions(study: JointPoseSensitivity, results: Results) -> Iterator[Conclusion]:
    """Of parts that tell no stiffness."""
    counts = results.table("counts")
    if len(counts):
        rows = counts[counts["part"] != "poses"]
        fits, lost = int(rows["fits"].sum()), int((rows["fits"] - rows["solved"]).sum())
        values = {"fits": Value(fits), "lost": Value(lost, source="counts: fits less solved")}
        if fits:
            yield Conclusion("boots", "check" if lost else "ok", values)
    yield from _precision(study, results.table("required_precision"))
    yield from _ways(results)
    yield from _sampled(results)


def bootstraps(
    study: JointPoseSensitivity, main: Stiffness, results: Results
) -> Iterator[Conclusion]:
    """How far start values, loading and damping move the stiffness that the answer tells."""
    summary = results.table("summary")
    if summary.empty:
        return
    same = (summary["quantity"] == "stiffness") & (summary["dataset"] == "reduced")
    for name in ("specimen", "joint", "coordinate"):
        same &= summary[name] == getattr(main, name)
    rows = summary[same & (summary["n"] >= FEWEST)]
    moved = main.moved[0]
    for rule in ("start", "damping"):
        own = rows[rows["part"] == f"{rule}_bootstrap"].set_index("loading")
        if own.empty:
            continue
        spread = (100.0 * own["iqr"] / own["median"]).astype(float)
        at = str(spread.idxmax())
        # start values are told where stiffness is fitted as in the study, damping where it counts
        at = REST if rule == "start" and REST in own.index else at
        share = round(float(spread[at]), 2)
        source = f"summary: {rule}_bootstrap of retained fits, {at}"
        value = {"value": Value(share, "%", n=int(own.loc[at, "n"]), source=source)}
        names = {"stiffness": main.name, "loading": READ[at]}
        verdict = "more" if share >= moved else "less"
        yield Conclusion({"start": "starts"}.get(rule, rule), verdict, value, names)
        if rule == "start" and REST in own.index and len(own) > 1:
            yield _loading(own["median"].astype(float), main)


def _loading(medians: pd.Series, main: Stiffness) -> Conclusion:
    """What reading under another loading changes of the median at rest."""
    change = 100.0 * (medians / medians[REST] - 1.0)
    at = str(change.abs().idxmax())
    source = f"summary: start_bootstrap of retained fits, {at} over {REST}"
    value = {"value": Value(round(float(change[at]), 2), "%", source=source)}
    names = {"stiffness": main.name, "loading": READ[at]}
    verdict = "more" if abs(change[at]) > main.moved[0] else "less"
    return Conclusion("loading", verdict, value, names)


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
    worst, n = own.loc[own["nominal_share"].idxmax()], int(own["n"].min())
    if worst["nominal_share"] >= 1.0:
        over = Value(float(worst["nominal_share"]), source=f"{source}nominal_share")
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
        row = known.loc[known["sd_mm"].idxmin()]
        ends = (
            None if pd.isna(row[end]) else float(row[end]) for end in ("sd_low_mm", "sd_high_mm")
        )
        value = Value(float(row["sd_mm"]), "mm", *ends, n, f"{source}sd_mm")
        verdict = "known"
    yield Conclusion("precision", verdict, {"value": value, "share": share}, names)


def _ways(results: Results) -> Iterator[Conclusion]:
    """Fits that reach the least cost by exact derivatives and by the published forward runs."""
    rows, fits = results.table("success_by_method"), results.table("method_fits")
    if rows.empty or fits.empty:
        return
    refused = fits[fits["status"] == Status.REFUSED.value]
    tried = fits.groupby("method").size()
    lost = refused.groupby("method").size().reindex(tried.index, fill_value=0)
    if (tried == lost)[[EXACT, DEFAULT]].any():
        why = listed(dict.fromkeys(refused["message"]), last=None)
        yield Conclusion("ways", "refused", names={"why": why})
        return
    arrived = rows.groupby("method")["arrived"].sum()
    n, source = int(tried[EXACT]), "success_by_method: arrived"
    values = {
        "fits": Value(n, source="success_by_method: fits"),
        "ours": Value(int(arrived[EXACT]), n=n, source=source),
        "theirs": Value(int(arrived[DEFAULT]), n=n, source=source),
    }
    yield Conclusion("ways", "few" if n < FEWEST_OF_A_RATE else "counted", values)


def posterior(main: Stiffness, results: Results) -> Iterator[Conclusion]:
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


def _sampled(results: Results) -> Iterator[Conclusion]:
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
        least = counted.loc[(counted["alike"] / counted["poses"]).idxmin()]
        source = "pose_weights: one over the sum of squares, least of specimens"
        values = {
            "poses": Value(int(least["poses"]), source="pose_weights: poses"),
            "alike": Value(round(float(least["alike"])), source=source),
        }
        alike = least["alike"] > ALIKE * least["poses"]
        yield Conclusion("poses", "alike" if alike else "preferred", values)
