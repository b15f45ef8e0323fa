"""What a study of recorded lifts concludes: the largest moment, and how it was measured to be."""

from collections.abc import Iterator

import pandas as pd

from spinepipe.motion.skeleton import JOINTS
from spinepipe.report.conclusions import Conclusion, Value
from spinepipe.report.words import count, level, plain
from spinepipe.studies.tracking.conclusions_of_errors import Tables
from spinepipe.studies.tracking.settings import Tracking

AGREES_PERCENT = 5.0
AGREES_NM = 10.0
"""A peak and a course nearer than this agree: what a simple model of the same lifts reaches is a
third of it."""


def told_method(agreement: pd.DataFrame) -> tuple[str, str]:
    """Joint, and the first method that it was measured with; L5S1 and nothing without one."""
    if agreement.empty:
        return JOINTS[0], ""
    first = agreement.iloc[0]
    return str(first["joint"]), str(first["method"])


def conclusions_of_moments(study: Tracking, tables: Tables) -> Iterator[Conclusion]:
    """All of them."""
    rows, agreement = tables["joint_moments"], tables["moment_agreement"]
    joint, method = told_method(agreement)
    own = rows[rows["joint"] == joint].astype({"extension_nm": float})
    if own.empty:
        yield Conclusion("moment", "none")
        return
    top = own.iloc[int(own["extension_nm"].argmax())]
    source = "joint_moments: extension_nm"
    values = {
        "most": Value(float(top["extension_nm"]), "N m", source=source),
        "when": Value(float(top["time_s"]), "s", source="joint_moments: time_s"),
        "still": Value(float(own["still_extension_nm"].max()), "N m", source=source),
    }
    names = {"joint": level(joint), "trial": plain(str(top["trial"]))}
    if not method:
        yield Conclusion("moment", "alone", values, names)
        yield Conclusion("compared", "check_alone")
    else:
        beside = agreement[(agreement["joint"] == joint) & (agreement["method"] == method)]
        names |= {"method": plain(method)}
        if beside["peak_percent"].isna().any():  # a measured moment that never extends
            yield Conclusion("moment", "opposite", values, names)
            yield Conclusion("compared", "check_opposite", names=names)
        else:
            yield from _compared(beside, values, names)
            yield from _others(agreement, joint, method)
    used = {"cutoff": Value(study.cutoff_hz, "Hz", source="settings: cutoff_hz")}
    yield Conclusion("lifted", "told", used, {"ratios": plain(study.ratios)})


def _compared(
    beside: pd.DataFrame, values: dict[str, Value], names: dict[str, str]
) -> Iterator[Conclusion]:
    """The answer, and how far computed moments are off."""
    moving, still = (beside[beside["way"] == way] for way in ("moving", "still"))
    source = "moment_agreement: largest over trials"
    worst = {
        "rmse": Value(float(moving["rmse_nm"].max()), "N m", source=source),
        "peak": Value(float(moving["peak_percent"].abs().max()), "%", source=source),
        "still_rmse": Value(float(still["rmse_nm"].max()), "N m", source=source),
    }
    less = still["peak_percent"].astype(float)
    for name, number in (("low", -less.max()), ("high", -less.min())):
        worst[f"still_{name}"] = Value(float(number), "%", source="moment_agreement: still")
    most = float(less.abs().max())
    worst["still_most"] = Value(most, "%", source="moment_agreement: still")
    names = names | {"trials": count(len(moving), "trial")}
    agrees = worst["rmse"].number <= AGREES_NM and worst["peak"].number <= AGREES_PERCENT
    yield Conclusion("moment", "agrees" if agrees else "differs", values | worst, names)
    yield Conclusion("course", "told", {"value": worst["rmse"]}, names)
    yield Conclusion("peak", "told", {"value": worst["peak"]}, names)
    before = moving["before_nm"].dropna()
    if len(before):
        held = {"value": Value(float(before.max()), "N m", source=source)}
        yield Conclusion("before", "told", held, names)
    lower = "less" if (less < 0.0).all() else "off"
    yield Conclusion("quasi_static", lower, values | worst, names)
    ok = "ok" if agrees else "check"
    yield Conclusion("compared", ok, worst, names)


def _others(agreement: pd.DataFrame, joint: str, method: str) -> Iterator[Conclusion]:
    """Further methods that the same moment was measured with."""
    rest = agreement[(agreement["way"] == "moving") & (agreement["joint"] == joint)]
    for other, rows in rest.groupby("method", sort=False):
        if str(other) != method and rows["after_nm"].notna().any():
            most = Value(float(rows["after_nm"].max()), "N m", source="moment_agreement: after_nm")
            yield Conclusion("other", "told", {"after": most}, {"method": plain(str(other))})
