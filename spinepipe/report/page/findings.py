"""Key findings of a study as sentences, their numbers computed from its tables."""

from collections.abc import Callable, Iterator

import pandas as pd

from spinepipe.report.bootstrap_rows import LOADING_NAMES
from spinepipe.report.landmark_precision import WHOSE, required_words
from spinepipe.report.page.results import Results
from spinepipe.report.words import AXIS, count, fixed, number, percent, tick
from spinepipe.studies import JointPoseSensitivity

_PERCENT = "\u00a0%"
"""No line ends between a number and its percent sign."""

Finding = Callable[[JointPoseSensitivity, Results], str]


_COUNTS = ("fits", "solved", "near_start_any", "near_start_all", "outliers", "reduced")


def findings(study: JointPoseSensitivity, results: Results) -> list[str]:
    """The sentences, without those that the study has no table for."""
    makers: tuple[Finding, ...] = (
        _fits, _stiffness, _dominant, _precision, _methods, _bootstraps, _paper,
    )  # fmt: skip
    told = [make(study, results) for make in makers]
    return [sentence.replace(" %", _PERCENT) for sentence in told if sentence]


def _fits(study: JointPoseSensitivity, results: Results) -> str:
    rows = results.table("counts")
    if rows.empty or not (rows["part"] == "poses").any():
        return ""
    poses = rows[rows["part"] == "poses"]
    sums = {name: int(poses[name].sum()) for name in _COUNTS}
    near = "near_start_all" if study.success.failed_when == "all" else "near_start_any"
    which = "all free stiffnesses" if near.endswith("all") else "a free stiffness"
    percents = tick(study.success.near_start_percent)
    lost = (
        f"{sums[near]} had not moved ({which} within {percents} % of the start) and "
        f"{sums['outliers']} {'was an outlier' if sums['outliers'] == 1 else 'were outliers'}"
    )
    share = percent(sums["reduced"], sums["fits"])
    kept = f"{count(sums['reduced'], 'fit')} of {sums['fits']} ({share})"
    return f"{kept} are in the reduced dataset: {sums['solved']} ended with a stiffness, {lost}."


def _stiffness(study: JointPoseSensitivity, results: Results) -> str:
    rows = results.table("summary")
    if rows.empty:
        return ""
    chosen = rows[
        (rows["part"] == "poses")
        & (rows["dataset"] == "reduced")
        & (rows["quantity"] == "stiffness")
        & rows["coordinate"].isin(study.calibration.free)
    ].dropna(subset=["median"])
    parts = [_medians(name, part) for name, part in chosen.groupby("coordinate", sort=False)]
    return f"Median stiffness over the reduced poses: {'; '.join(parts)}." if parts else ""


def _medians(name: object, part: pd.DataFrame) -> str:
    """Median and IQR, or the span of the medians of several specimens or joints."""
    first = part.iloc[0]
    title = AXIS[str(name)].lower()
    if len(part) == 1:
        iqr = f"{number(first['low_quartile'])} to {number(first['high_quartile'])}"
        return f"{title} {number(first['median'])} {first['unit']} (IQR {iqr})"
    span = _span(number(part["median"].min()), number(part["median"].max()))
    return f"{title} {span} {first['unit']} ({len(part)} specimens or joints)"


def _span(low: str, high: str) -> str:
    return low if low == high else f"{low} to {high}"


def _dominant(study: JointPoseSensitivity, results: Results) -> str:
    rows = results.table("variance_shares")
    if rows.empty:
        return ""
    keys = ["specimen", "joint", "coordinate"]
    done = rows[rows["status"] == "done"].sort_values("share", ascending=False)
    largest = done.drop_duplicates(keys)
    if largest.empty:
        return ""
    parts = [_share(name, largest[largest["factor"] == name]) for name in _FACTORS]
    told = "; ".join(part for part in parts if part)
    alone = done[done["factor"] != "interaction"].drop_duplicates(keys)
    pose = int((alone["factor"] == "pose").sum())
    lead = f"What takes the largest share of the variance, over {count(len(largest), 'error')}"
    return f"{lead}: {told}. Pose alone takes more than stiffness alone in {pose}."


_FACTORS = {"pose": "joint pose", "stiffness": "stiffness", "interaction": "their interaction"}


def _share(factor: str, part: pd.DataFrame) -> str:
    """In how many errors the factor leads, and the largest of its shares."""
    if part.empty:
        return ""
    row = part.iloc[0]
    ends = f"{fixed(100 * row['share_low'], 0)} to {fixed(100 * row['share_high'], 0)} %"
    share = f"{fixed(100 * row['share'], 0)} % (95 % interval {ends})"
    where = f"{AXIS[row['coordinate']].lower()} error of {row['joint']}"
    return f"{_FACTORS[factor]} in {len(part)}, at most {share} in the {where}"


def _precision(study: JointPoseSensitivity, results: Results) -> str:
    rows = results.table("required_precision")
    if rows.empty:
        return ""
    asked = study.landmark_precision
    limits = {
        "translation": f"{tick(asked.translation_limit_mm)} mm",
        "rotation": f"{tick(asked.rotation_limit_deg)}°",
    }
    limits = {"both": " and ".join(limits.values()), **limits}
    # where there is no row of both, one kind of motion alone was measured
    motion = next(name for name in limits if (rows["motion"] == name).any())
    goal = f"For {tick(100 * asked.share)} % of poses to stay below {limits[motion]}"
    chosen = rows[rows["motion"] == motion]
    parts = [f"with {WHOSE[whose]} {_required(part)}" for whose, part in _by_stiffness(chosen)]
    return f"{goal}, the SD of a landmark per axis may be at most: {'; '.join(parts)}."


def _by_stiffness(rows: pd.DataFrame) -> Iterator[tuple[str, pd.DataFrame]]:
    for whose, part in rows.groupby("stiffness"):
        yield str(whose), part


def _required(part: pd.DataFrame) -> str:
    if len(part) == 1:
        row = part.iloc[0]
        return required_words(row)
    found = part["sd_mm"].dropna()
    if found.empty:
        return f"outside the sampled SDs in all {len(part)} specimens"
    span = _span(fixed(found.min()), fixed(found.max()))
    return f"{span} mm ({len(found)} of {len(part)} specimens)"


def _methods(study: JointPoseSensitivity, results: Results) -> str:
    rows = results.table("success_by_method")
    if rows.empty:
        return ""
    sums = rows.groupby("method", sort=False)[["successful", "fits", "arrived"]].sum()
    parts = [
        f"{str(method).replace('_', ' ')} {row['successful']} of {row['fits']} "
        f"(least cost reached: {row['arrived']})"
        for method, row in sums.iterrows()
    ]
    return f"Successful fits of the same poses by method: {'; '.join(parts)}."


def _bootstraps(study: JointPoseSensitivity, results: Results) -> str:
    rows = results.table("summary")
    if rows.empty:
        return ""
    chosen = rows[
        (rows["part"] != "poses") & (rows["dataset"] == "all") & (rows["quantity"] == "stiffness")
        & rows["coordinate"].isin(study.calibration.free)
    ].dropna(subset=["median"])  # fmt: skip
    parts = list(_widest(chosen))
    lead = "Middle half (IQR) of the fitted stiffness as a share of its median, widest direction"
    return f"{lead}: {'; '.join(parts)}." if parts else ""


def _widest(chosen: pd.DataFrame) -> Iterator[str]:
    for part, rows in chosen.groupby("part", sort=False):
        what = "over start values" if part == "start_bootstrap" else "over damping"
        shares = (rows["iqr"] / rows["median"]).groupby(rows["loading"], sort=False).max()
        told = [
            f"{_below(100.0 * float(share))} % {LOADING_NAMES[str(loading)]}"
            for loading, share in shares.items()
        ]
        yield f"{what} {', '.join(told)}"


def _below(share: float) -> str:
    return "below 0.01" if share < 0.01 else number(share, 2)


def _paper(study: JointPoseSensitivity, results: Results) -> str:
    rows = results.table("against_gould_2024a")
    if rows.empty:
        return ""
    found = {name: int((rows["verdict"] == name).sum()) for name in rows["verdict"].unique()}
    inside, outside = found.get("inside", 0), found.get("outside", 0)
    others = (
        ("circular", "are what the cohort was built to have"),
        ("recomputed", "only follow from the paper's own numbers"),
        ("contradicted", "are contradicted by other numbers of the paper and not chased"),
        ("not_computed", "are not computed"),
    )
    told = [f"{found[name]} {words}" for name, words in others if name in found]
    return (
        f"Of {len(rows)} published quantities ours are inside the paper's range for {inside} and "
        f"outside for {outside}; {', '.join(told)}."
    )
