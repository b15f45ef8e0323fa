"""Which approach is nearest the truth, what else errors say, and what subjects show of it."""

from collections.abc import Iterator, Mapping, Sequence

import pandas as pd

from spinepipe.motion.skeleton import JOINTS
from spinepipe.report.conclusions import Conclusion, Value
from spinepipe.report.words import count, level
from spinepipe.status import Status
from spinepipe.studies.tracking.ranking import (
    ANGLES,
    CALIBRATED,
    CENTRES,
    FEWEST,
    GENERIC,
    IK,
    ZERO,
    Ranking,
)
from spinepipe.studies.tracking.tables import MARKER_OFF
from spinepipe.studies.tracking.words import phrase

Tables = Mapping[str, pd.DataFrame]

ENDED = (Status.CONVERGED.value, MARKER_OFF)
"""Statuses of fits that converged."""

MANY_LOST = 0.1
"""Share of the fits of an approach that did not converge, above which it is not to be used."""

TESTED = "errors: paired t tests, all corrected together (Holm)"


def conclusions_of_errors(tables: Tables, found: Sequence[Ranking]) -> Iterator[Conclusion]:
    """All of them; without a truth how closely markers are met."""
    fits = tables["fits"]
    if not len(fits) or not (fits["frames"] > 0).any():
        yield Conclusion("nearest", "none")
        return
    if not found:
        yield Conclusion("nearest", "no_truth")
        yield Conclusion("basis", "untested")
        off = fits.groupby("approach", observed=True)["marker_rmse_mm"].mean().dropna()
        value = Value(float(off.min()), "mm", source="fits: mean of marker_rmse_mm")
        names = {"approach": phrase(str(off.idxmin()))}
        yield Conclusion("residual", "closest", {"value": value}, names)
        return
    one = next((one for one in found if one.measure == CENTRES), found[0])
    yield _nearest(one)
    yield from _keys(tables, found, one)
    yield from _needed(one)
    yield Conclusion("basis", "markers")
    yield from _use(fits, one)
    yield from _calibrated(one)
    yield from _stiffness_helps(one)
    yield from _by_level(tables["errors"], one)
    yield from _closest(fits, one)


def _words(one: Ranking, approach: str) -> dict[str, str]:
    """Names that most sentences on errors have."""
    return {"approach": phrase(approach), "where": one.where, "subjects": count(one.n, "subject")}


def _nearest(one: Ranking) -> Conclusion:
    best, *others = one.approaches
    beaten = sum(one.shown(best, other) < 0 for other in others)
    if not others:
        verdict = "alone"
    elif one.n < FEWEST:
        verdict = "few"
    else:
        verdict = "unsure" if not beaten else "best" if beaten == len(others) else "some"
    values = {"error": one.error(best), "beaten": Value(beaten, source=TESTED)}
    values["others"] = Value(len(others), source="errors: approaches with all motions")
    return Conclusion("nearest", verdict, values, _words(one, best))


def _keys(tables: Tables, found: Sequence[Ranking], one: Ranking) -> Iterator[Conclusion]:
    """Error of the nearest approach, beside it the reference and an angle."""
    best = one.approaches[0]
    names = _words(one, best)
    yield Conclusion("error", one.measure.partition("_")[0], {"value": one.error(best)}, names)
    if IK in one.approaches[1:]:
        yield Conclusion("reference", "kinematics", {"value": one.error(IK)}, names)
    for other in found:
        same = (other.measure, other.where) == (ANGLES, one.where)
        if same and other is not one and best in other.approaches:
            levels = _levels(tables["errors"], other, best)["level"].unique()
            joints = [joint for joint in JOINTS if joint in levels]
            values = {"value": other.error(best)}
            moved = _sagittal_range(tables["ranges"], other, best, joints)
            values |= {"range": moved} if moved else {}
            ends = " to ".join(dict.fromkeys((level(joints[0]), level(joints[-1]))))
            verdict = "moving" if moved else "alone"
            yield Conclusion("angle", verdict, values, {**names, "joints": ends})


def _levels(errors: pd.DataFrame, one: Ranking, approach: str) -> pd.DataFrame:
    """Errors of an approach by level, of the motions and the measure of a ranking."""
    own = errors[(errors["measure"] == one.measure) & (errors["approach"] == approach)]
    return own[own["trial"].isin(one.trials)]


def _sagittal_range(
    rows: pd.DataFrame, one: Ranking, approach: str, joints: Sequence[str]
) -> Value | None:
    """How far joints turn sagittally by an approach: the scale of errors of these angles."""
    if rows.empty:
        return None
    own = rows[(rows["coordinate"] == "extension") & rows["joint"].isin(joints)]
    own = own[(own["approach"] == approach) & own["trial"].isin(one.trials)]
    how = "ranges: median of extension of the joints of these errors"
    return Value(float(own["range"].median()), "°", n=len(own), source=how) if len(own) else None


def _needed(one: Ranking) -> Iterator[Conclusion]:
    """Whether subjects suffice, and how many would."""
    best, *others = one.approaches
    names = _words(one, best)
    ties = [other for other in others if not one.shown(best, other)]
    if not ties or one.n < FEWEST:
        verdict = "check_few" if one.n < FEWEST else "ok" if others else "ok_alone"
        yield Conclusion("sample", verdict, names=names)
        return
    names["rival"] = phrase(ties[0])
    values = {"tests": Value(one.tests, source="errors: pairs of approaches")}
    how = "errors: paired t test with the SD of these differences, power 80 %, corrected level"
    needed = {other: one.needed(best, other) for other in (ties[0], IK) if other in ties}
    told = {other: Value(n, n=one.n, source=how) for other, n in needed.items() if n is not None}
    if ties[0] not in told:
        yield Conclusion("sample", "check_many", values, names)
        return
    values["value"] = told[ties[0]]
    both = IK in told and ties[0] != IK
    yield Conclusion("sample", "check", values, names)
    values |= {"kinematics": told[IK]} if both else {}
    yield Conclusion("needed", "needed_both" if both else "needed", values, names)


def _use(fits: pd.DataFrame, one: Ranking) -> Iterator[Conclusion]:
    """Whether fits behind the answer converged."""
    own = fits[fits["trial"].isin(one.trials) & (fits["approach"] == one.approaches[0])]
    lost = int((~own["status"].isin(ENDED)).sum())
    if lost > MANY_LOST * len(own):
        values = {
            "lost": Value(lost, source="fits: status"),
            "fits": Value(len(own), source="fits"),
        }
        yield Conclusion("use", "stop_lost", values, _words(one, one.approaches[0]))


def _paired(one: Ranking, first: str, other: str) -> str:
    """What subjects show of a pair of approaches."""
    if one.n < FEWEST:
        return "few"
    return {-1: "better", 0: "not_shown", 1: "worse"}[one.shown(first, other)]


def _calibrated(one: Ranking) -> Iterator[Conclusion]:
    """Whether calibrated stiffness is nearer the truth than generic stiffness."""
    there = [name for name in one.approaches if name in CALIBRATED]  # the nearest first
    if not there or GENERIC not in one.approaches:
        return
    verdicts = [_paired(one, name, GENERIC) for name in there]
    better, worse = (verdicts.count(word) for word in ("better", "worse"))
    verdict = "better" if better else "worse" if worse else verdicts[0]
    values = {
        "calibrated": one.error(there[0]),
        "generic": one.error(GENERIC),
        "better": Value(better, source=TESTED),
        "worse": Value(worse, source=TESTED),
        "asked": Value(len(there), source="errors: approaches"),
    }
    words = _words(one, there[0])
    yield Conclusion("calibrated", "split" if better and worse else verdict, values, words)


def _stiffness_helps(one: Ranking) -> Iterator[Conclusion]:
    """Whether dynamics needs the stiffness of joints."""
    if {ZERO, GENERIC} <= set(one.approaches):
        values = {"without": one.error(ZERO), "generic": one.error(GENERIC)}
        verdict = _paired(one, GENERIC, ZERO)
        yield Conclusion("stiffness_helps", verdict, values, _words(one, GENERIC))


def _by_level(errors: pd.DataFrame, one: Ranking) -> Iterator[Conclusion]:
    """The levels with the largest and the least error."""
    best = one.approaches[0]
    means = _levels(errors, one, best).groupby("level", observed=True, sort=False)["mean"].mean()
    if len(means) > 1:
        ends = {"most": str(means.idxmax()), "least": str(means.idxmin())}
        unit, how = one.error(best).unit, "errors: mean over subjects and trials"
        values = {
            name: Value(float(means[at]), unit, n=one.n, source=how) for name, at in ends.items()
        }
        names = {f"{name}_level": level(at) for name, at in ends.items()}
        yield Conclusion("by_level", "largest", values, {**_words(one, best), **names})


def _closest(fits: pd.DataFrame, one: Ranking) -> Iterator[Conclusion]:
    """Whether the approach that is closest to the markers is nearest the truth as well."""
    own = fits[fits["trial"].isin(one.trials) & fits["approach"].isin(one.approaches)]
    off = own.groupby("approach", observed=True)["marker_rmse_mm"].mean().dropna()
    best = one.approaches[0]
    if best not in off or len(off) < 2:
        return
    closest, source = str(off.idxmin()), "fits: mean of marker_rmse_mm"
    values = {
        "markers": Value(float(off[closest]), "mm", source=source),
        "best_markers": Value(float(off[best]), "mm", source=source),
        "rank": Value(one.approaches.index(closest) + 1, source="errors: order of mean errors"),
        "approaches": Value(len(one.approaches), source="errors: approaches"),
    }
    names = {**_words(one, best), "closest": phrase(closest)}
    yield Conclusion("closest", "same" if closest == best else "other", values, names)
