"""Selectors for Gould et al. 2024b, doi 10.3389/fbioe.2024.1372088, beside the phantom after it.

Its two models are `per_specimen` and `level_ratio`, fitted to one load case each; stages are
`literature`, `fitted` and `left_out_specimen`. Errors are those at the largest load, in the loaded
coordinate where no other is named.
"""

from itertools import product
from typing import Any

import numpy as np
import pandas as pd

from papers.run import Computed, NotComputed, StudyRun
from papers.selectors import named, tested

MODELS = ("per_specimen", "level_ratio")
LITERATURE = {"per_specimen": "literature", "level_ratio": "literature_levels"}
"""What a model is before it is fitted."""

LOADED = {
    "left_lateral_bending": "right_bending",
    "left_axial_rotation": "left_rotation",
    "flexion": "extension",
}
"""The coordinate that a load case drives, and whose error is reported."""

WORDS = dict(zip(LOADED, ("lateral bending", "axial rotation", "flexion"), strict=True))
COORDINATES = tuple(LOADED.values())
LOWER_FIVE = ("L1L2", "L2L3", "L3L4", "L4L5", "L5S1")
"""The five levels that the paper's numbers point to (B5)."""

P_BELOW = 0.05
SAME_AS_START = 0.005
"""Share of the start within which a fit ended where it started; Table 3 is rounded to less."""


def _of_stage(model: str, stage: str, test: str) -> dict[str, str]:
    """Keys of the stiffness that a model has at a stage."""
    if stage == "literature":
        return {"representation": LITERATURE[model], "fitted_to": "nothing", "source": "literature"}
    source = {"fitted": "own", "left_out_specimen": "others_median"}[stage]
    return {"representation": model, "fitted_to": test, "source": source}


# --- Table 4: mean absolute errors ----------------------------------------------------------------


def _mae(run: StudyRun, column: str, model: str, stage: str, test: str) -> float:
    return run.number("mae", column, **_of_stage(model, stage, test), test=test, steps="peak")


def _points(run: StudyRun, model: str, test: str) -> float:
    """Fall of the percentage from literature to fitted."""
    before, after = (_mae(run, "mae_percent", model, s, test) for s in ("literature", "fitted"))
    return before - after


def mae(run: StudyRun, model: str, stage: str, test: str, of: str) -> Computed:
    """Median over specimens with its quartiles, `iqr`, or `percent` of the largest motion."""
    if of == "percent":
        return Computed(_mae(run, "mae_percent", model, stage, test))
    low, high = (_mae(run, f"{end}_quartile", model, stage, test) for end in ("low", "high"))
    if of == "iqr":
        return Computed(high - low)
    return Computed(_mae(run, "mae", model, stage, test), low, high)


def mae_drop(run: StudyRun, model: str, test: str) -> Computed:
    """Fall of the percentage from literature to fitted."""
    return Computed(_points(run, model, test))


def mae_ratio(run: StudyRun, test: str, models: Any, stages: Any) -> Computed:
    """The first error in the second."""
    first, second = (_mae(run, "mae", *of, test) for of in zip(models, stages, strict=True))
    if second == 0.0:
        raise NotComputed("the larger error is 0")
    return Computed(first / second)


def level_ratio_gains_more(run: StudyRun, test: str) -> Computed:
    """Whether fitting lowers the percentage of level_ratio more than that of per_specimen."""
    uniform, levels = (_points(run, model, test) for model in MODELS)
    return Computed(float(levels > uniform), note=f"ours: {levels:.0f} and {uniform:.0f} points")


# --- errors at the largest load -------------------------------------------------------------------


def _errors(run: StudyRun, model: str, stage: str, test: str, coordinate: str = "") -> pd.DataFrame:
    """One row per specimen and joint."""
    where = {"test": test, "coordinate": coordinate or LOADED[test]}
    seen = run.rows("errors", **_of_stage(model, stage, test), **where)
    seen = seen.dropna(subset=["peak_error", "measured_peak"])
    if seen.empty:
        raise NotComputed("no motion was predicted")
    return seen


def _predicted(seen: pd.DataFrame) -> "pd.Series[float]":
    """Size of the predicted motion, deg."""
    return (seen["peak_error"] + seen["measured_peak"]).abs()


def _rms(seen: pd.DataFrame, by: str) -> "pd.Series[float]":
    return seen["peak_error"].pow(2).groupby(seen[by]).mean().pow(0.5)


def _whole_rms(run: StudyRun, model: str, stage: str, test: str, coordinate: str) -> float:
    seen = _errors(run, model, stage, test, coordinate)
    return float(np.sqrt(np.mean(seen["peak_error"].to_numpy(dtype=float) ** 2)))


def _largest_motion(seen: pd.DataFrame) -> float:
    """Largest over specimens of the mean size of motion over joints, deg."""
    return float(seen["measured_peak"].abs().groupby(seen["specimen"]).mean().max())


def fitted_below(run: StudyRun, model: str, other: str) -> Computed:
    """Share of loads and rotations whose fitted error is below that of another stage, percent."""
    cells = list(product(LOADED, COORDINATES))
    higher = [
        f"{name} under {WORDS[test]}"
        for test, name in cells
        if _whole_rms(run, model, "fitted", test, name) >= _whole_rms(run, model, other, test, name)
    ]
    share = 100.0 * (1.0 - len(higher) / len(cells))
    return Computed(share, note=f"ours: not {', '.join(higher)}" if higher else "")


def gains_most_when_loaded(run: StudyRun, model: str, test: str) -> Computed:
    """Whether fitting lowers the error of the loaded coordinate most."""
    gains = {
        name: _whole_rms(run, model, "literature", test, name)
        - _whole_rms(run, model, "fitted", test, name)
        for name in COORDINATES
    }
    return _largest_is_loaded(gains, test, "deg", 2)


def highest_when_loaded(run: StudyRun, model: str, test: str) -> Computed:
    """Whether the fitted error of the loaded coordinate is the highest."""
    sizes = {name: _whole_rms(run, model, "fitted", test, name) for name in COORDINATES}
    return _largest_is_loaded(sizes, test, "deg", 2)


def _largest_is_loaded(sizes: dict[str, float], test: str, unit: str, digits: int) -> Computed:
    told = ", ".join(f"{name} {size:.{digits}g}" for name, size in sizes.items())
    largest = max(sizes, key=lambda name: sizes[name])
    return Computed(float(largest == LOADED[test]), note=f"ours: {told} {unit}")


def larger_at_each_level(run: StudyRun, test: str) -> Computed:
    """Share of levels where the fitted error of level_ratio is the larger, percent."""
    uniform, levels = (_rms(_errors(run, model, "fitted", test), "joint") for model in MODELS)
    larger = (levels > uniform).reindex(levels.index)
    lower = ", ".join(str(name) for name in larger.index[~larger])
    return Computed(100.0 * float(larger.mean()), note=f"ours: not at {lower}" if lower else "")


def largest_error_of_levels(run: StudyRun, test: str) -> Computed:
    """Whether the largest fitted error of level_ratio is the larger."""
    uniform, levels = (
        float(_errors(run, model, "fitted", test)["peak_error"].abs().max()) for model in MODELS
    )
    return Computed(float(levels > uniform), note=f"ours: {levels:.2g} and {uniform:.2g} deg")


def rms_difference(run: StudyRun, by: str) -> Computed:
    """Largest difference of fitted errors between specimens or joints, percent of motion."""
    found = {}
    for test in LOADED:
        seen = _errors(run, MODELS[0], "fitted", test)
        sizes = _rms(seen, by)
        found[test] = 100.0 * float(sizes.max() - sizes.min()) / _largest_motion(seen)
    worst = max(found, key=lambda test: found[test])
    return Computed(found[worst], note=f"ours: under {WORDS[worst]}")


def extreme_error(run: StudyRun, model: str, which: str) -> Computed:
    """Largest or smallest fitted error of a level under any load, deg."""
    sizes = pd.concat([_errors(run, model, "fitted", test)["peak_error"].abs() for test in LOADED])
    return Computed(float(sizes.max() if which == "largest" else sizes.min()))


def over_predicted(run: StudyRun, test: str, stage: str, by: str = "") -> Computed:
    """Share of joints, or of levels on average, whose motion is predicted too large, percent."""
    seen = _errors(run, MODELS[0], stage, test)
    excess = _predicted(seen) - seen["measured_peak"].abs()
    excess = excess.groupby(seen[by]).mean() if by else excess
    count = int((excess > 0.0).sum())
    return Computed(100.0 * count / len(excess), note=f"ours: {count} of {len(excess)}")


def published_rotation(run: StudyRun, model: str, test: str, joints: Any) -> Computed:
    """Mean predicted motion of joints with published stiffness, deg."""
    seen = _errors(run, model, "literature", test)
    sizes = _predicted(seen[seen["joint"].isin(joints if isinstance(joints, tuple) else (joints,))])
    return Computed(float(sizes.mean()), float(sizes.min()), float(sizes.max()))


def levels_over_uniform(run: StudyRun, test: str) -> Computed:
    """That of level_ratio in that of per_specimen, L1L2 to L5S1."""
    uniform, levels = (published_rotation(run, m, test, LOWER_FIVE).value for m in MODELS)
    return Computed(levels / uniform)


def measured_motion(run: StudyRun, test: str) -> Computed:
    """Median over specimens of the mean measured motion of L1L2 to L5S1, deg."""
    seen = _errors(run, MODELS[0], "literature", test)
    own = seen[seen["joint"].isin(LOWER_FIVE)].groupby("specimen")["measured_peak"].mean().abs()
    return Computed(float(own.median()), float(own.min()), float(own.max()))


def largest_motion(run: StudyRun, test: str) -> Computed:
    """Largest over specimens of the mean measured motion, deg."""
    return Computed(_largest_motion(_errors(run, MODELS[0], "literature", test)))


# --- fitted stiffness -----------------------------------------------------------------------------


def _stiffness(run: StudyRun, model: str, test: str, coordinate: str = "") -> pd.DataFrame:
    """One row per specimen and joint; at least one."""
    where = {**_of_stage(model, "fitted", test), "coordinate": coordinate or LOADED[test]}
    rows = run.rows("stiffness", **where).dropna(subset=["stiffness"])
    if rows.empty:
        raise NotComputed("no fit ended with a stiffness")
    return rows


def _of_specimens(run: StudyRun, test: str, coordinate: str) -> "pd.Series[float]":
    rows = _stiffness(run, MODELS[0], test, coordinate)
    return rows.groupby("specimen")["stiffness"].first()


def over_specimens(run: StudyRun, test: str, coordinate: str, of: str) -> Computed:
    """Smallest, median, largest or range over specimens of per_specimen's stiffness."""
    values = _of_specimens(run, test, coordinate)
    low, high = float(values.min()), float(values.max())
    rows = _stiffness(run, MODELS[0], test, coordinate)
    lost = rows.loc[~rows["identifiable"].astype(bool), "specimen"].nunique()
    told = f"ours: {len(values)} specimens" + (f", of which {lost} not identifiable" * bool(lost))
    if of == "median":
        return Computed(float(values.median()), low, high, told)
    return Computed({"smallest": low, "largest": high, "range": high - low}[of], note=told)


def largest_range_when_loaded(run: StudyRun, test: str) -> Computed:
    """Whether the stiffness of the loaded coordinate has the largest range."""
    ranges = {name: over_specimens(run, test, name, "range").value for name in COORDINATES}
    return _largest_is_loaded(ranges, test, "N m/rad", 3)


def not_converged(run: StudyRun, test: str) -> Computed:
    """Specimens whose fit of per_specimen did not converge."""
    rows = run.rows("fits", representation=MODELS[0], fitted_to=test)
    ended = rows["status"].str.startswith("converged")
    return Computed(float((~ended).sum()), note=f"ours: of {len(rows)}")


def converged_in_both(run: StudyRun, test: str) -> Computed:
    """Specimens whose fits of both models converged."""
    ended = []
    for model in MODELS:
        rows = run.rows("fits", representation=model, fitted_to=test)
        ended.append(set(rows.loc[rows["status"].str.startswith("converged"), "specimen"]))
    return Computed(float(len(set.intersection(*ended))))


def unchanged(run: StudyRun, test: str, start: Any) -> Computed:
    """Specimens whose fit of per_specimen ended at the start values, N m/rad."""
    frame = pd.DataFrame({name: _of_specimens(run, test, name) for name in COORDINATES})
    near = ((frame / pd.Series(start, COORDINATES) - 1.0).abs() < SAME_AS_START).all(axis=1)
    if frame.isna().to_numpy().any():
        raise NotComputed("not every specimen has all three stiffnesses")
    return Computed(float(near.sum()), note=f"ours: of {len(frame)}")


def spread_larger(run: StudyRun, test: str, larger: str, of: str, joint: str = "") -> Computed:
    """Whether a model's stiffness has the larger range or IQR, at a level or over all."""
    low, high = {"range": (0.0, 1.0), "IQR": (0.25, 0.75)}[of]
    spreads = []
    for model in (larger, *(one for one in MODELS if one != larger)):
        rows = _stiffness(run, model, test)
        values = rows.loc[rows["joint"] == joint, "stiffness"] if joint else rows["stiffness"]
        if values.empty:
            raise NotComputed(f"no stiffness of {joint} was fitted")
        spreads.append(float(values.quantile(high)) - float(values.quantile(low)))
    told = f"ours: {spreads[0]:.3g} and {spreads[1]:.3g} N m/rad"
    return Computed(float(spreads[0] > spreads[1]), note=told)


def levels_stiffer(run: StudyRun) -> Computed:
    """Share of loads and levels whose median stiffness is larger of level_ratio, percent."""
    higher: list[bool] = []
    for test in LOADED:
        uniform, levels = (
            _stiffness(run, model, test).groupby("joint")["stiffness"].median() for model in MODELS
        )
        higher += (levels > uniform).tolist()
    return Computed(100.0 * sum(higher) / len(higher), note=f"ours: of {len(higher)}")


# --- tests of significance ------------------------------------------------------------------------


def groups_differ(run: StudyRun, test: str, model: str, group: str, stage: str) -> Computed:
    """Table 5: whether errors differ between specimens or levels (Kruskal-Wallis)."""
    representation = LITERATURE[model] if stage == "literature" else model
    where = {"family": f"between_{group}s/{representation}/{stage}", "stratum": test}
    p = float(tested(run, "kruskal", **where, response="loaded_error")["p"].iloc[0])
    told = f"ours: p = {p:.2g} of the loaded error"
    for name, response, what in (
        ("kruskal", "rotation_error", "all three rotations"),
        ("friedman", "loaded_error", "Friedman's test"),
    ):
        told += _beside(run, name, what, **where, response=response)
    return Computed(float(p < P_BELOW), note=told)


def _beside(run: StudyRun, test: str, what: str, **where: str) -> str:
    """The p of another test, where there is one."""
    try:
        return f"; {float(tested(run, test, **where)['p'].iloc[0]):.2g} of {what}"
    except NotComputed:
        return ""


def specimens_differ(run: StudyRun, comparison: str, model: str, test: str) -> Computed:
    """Table 6: specimens whose errors differ between two stages (signed rank), percent."""
    where = {"stratum": test, "response": "rotation_error"}
    rows = tested(run, "wilcoxon", family=f"signed_rank/{comparison}/{model}/{test}", **where)
    significant, n = rows["p_bonferroni"] < P_BELOW, rows["n"]
    told = f"ours: {int(significant.sum())} of {len(rows)}, {int(n.min())} to {int(n.max())} pairs"
    return Computed(100.0 * float(significant.mean()), note=told)


def models_differ(run: StudyRun, test: str, motion: str, of: str = "decision") -> Computed:
    """Table 7: whether errors of the two models differ (Kruskal-Wallis), or the `h` of it."""
    family = f"per_specimen_against_level_ratio/{test}"
    where = {"family": family, "response": f"{motion}_rmse", "stratum": "fitted"}
    row = tested(run, "kruskal", **where).iloc[0]
    if of == "h":
        return Computed(float(row["statistic"]))
    paired = "Wilcoxon's signed rank test, which fits pairs"
    told = f"ours: p = {row['p']:.2g}{_beside(run, 'wilcoxon', paired, **where)}"
    return Computed(float(row["p"] < P_BELOW), note=told)


SELECTORS = named(
    *(mae, mae_drop, mae_ratio, level_ratio_gains_more, fitted_below, gains_most_when_loaded),
    *(highest_when_loaded, larger_at_each_level, largest_error_of_levels, rms_difference),
    *(extreme_error, over_predicted, published_rotation, levels_over_uniform, measured_motion),
    *(largest_motion, over_specimens, largest_range_when_loaded, not_converged, converged_in_both),
    *(unchanged, spread_larger, levels_stiffer, groups_differ, specimens_differ, models_differ),
)
