"""Tables of a whole identification study, made up: they keep their schemas, nothing is computed."""

from collections.abc import Iterator, Mapping
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from study_cases import START, TABLES, Size

from spinepipe.studies.joint_pose_sensitivity.tables import LOADINGS
from spinepipe.tables import to_arrow, write
from spinepipe.units import COORDINATES, STIFFNESS_COLUMNS, TRANSLATIONS

Row = dict[str, Any]
MEASURED = ("superior", "extension")
METHODS = ("exact", "forward_run_default_step", "forward_run_sane_step")
SDS = (0.5, 1.0, 2.0, 3.0, 5.0)
METADATA = {
    "study": "probe",
    "kind": "joint_pose_sensitivity",
    "seed": "7",
    "cohort_digest": "c" * 64,
    "version_python": "3.11.0",
    "version_numpy": "2.0.0",
}


def identification(folder: Path, size: Size) -> list[Path]:
    """Write all tables of the study beyond its poses; returns their files."""
    rng = np.random.default_rng(11)
    makers = {
        "success": _success,
        "counts": _counts,
        "summary": _summary,
        "bootstrap": _bootstrap,
        "method_fits": _method_fits,
        "success_by_method": _success_by_method,
        "landmark_precision": _landmark_precision,
        "required_precision": _required_precision,
        "statistics": _statistics,
        "agreement": _agreement,
        "variance_shares": _variance_shares,
        "importance": _importance,
        "posterior": _posterior,
        "posterior_motion": _posterior_motion,
        "pose_weights": _pose_weights,
        "stiffness_over_load_point": _stiffness_over_load_point,
        "load_point_effect": _load_point_effect,
    }
    return [write_table(folder, name, list(make(size, rng))) for name, make in makers.items()]


def write_table(folder: Path, name: str, rows: list[Row]) -> Path:
    """Write one table; columns that a row does not name are empty."""
    table = TABLES[name]
    path = folder / f"{name}.parquet"
    columns = {c.name: [row.get(c.name) for row in rows] for c in table.columns}
    digest = {"code_digest": name.ljust(64, "0"), "config_digest": name.ljust(64, "1")}
    write(to_arrow(table, columns), path, {**METADATA, **digest})
    return path


def _ended(size: Size) -> Row:
    done = "done" if size.solved else "constant"
    return {"status": done, "message": "" if size.solved else "all values are the same"}


def _fit_ended(size: Size) -> Row:
    status = "converged" if size.solved else "refused"
    return {"status": status, "message": "" if size.solved else "no <joint> frame & no fit"}


def _success(size: Size, rng: np.random.Generator) -> Iterator[Row]:
    for specimen, pose in product(size.specimens, range(size.poses)):
        flags = dict.fromkeys(("near_start_any", "near_start_all", "failed", "outlier"), False)
        ends = {"solved": size.solved, "reduced": size.solved}
        yield {"specimen": specimen, "pose": pose, **flags, **ends}


def _counts(size: Size, rng: np.random.Generator) -> Iterator[Row]:
    for specimen in size.specimens:
        solved = size.poses if size.solved else 0
        yield {
            "specimen": specimen,
            "part": "poses",
            "loading": "equilibrium",
            "fits": size.poses,
            "solved": solved,
            "near_start_any": 0,
            "near_start_all": 0,
            "outliers": 0,
            "reduced": solved,
        }


def _summary(size: Size, rng: np.random.Generator) -> Iterator[Row]:
    for specimen, name in product(size.specimens, size.free):
        start = START[COORDINATES.index(name)]
        numbers = {
            "median": start,
            "low_quartile": 0.5 * start,
            "high_quartile": 2.0 * start,
            "iqr": 1.5 * start,
        }
        yield {
            "specimen": specimen,
            "part": "poses",
            "loading": "equilibrium",
            "dataset": "reduced",
            "quantity": "stiffness",
            "joint": "*",
            "coordinate": name,
            "unit": "N/m" if name in TRANSLATIONS else "N m/rad",
            "n": size.poses if size.solved else 0,
            **(numbers if size.solved else {}),
            "open_share": 0.0,
        }


def _stiffness(rng: np.random.Generator, spread: float, prefix: str = "") -> Row:
    values = np.array(START) * np.exp(rng.normal(0.0, spread, 6))
    return {f"{prefix}{name}": value for name, value in zip(STIFFNESS_COLUMNS, values, strict=True)}


def _bootstrap(size: Size, rng: np.random.Generator) -> Iterator[Row]:
    sets = {"start": 20, "damping": 5}
    for specimen, (kind, n), loading in product(size.specimens, sets.items(), LOADINGS):
        for number in range(n):
            shared = _stiffness(rng, 0.0 if loading == "equilibrium" else 0.02)
            for joint in size.joints:
                row = {"specimen": specimen, "bootstrap": kind, "loading": loading, "set": number}
                row |= {"joint": joint, **_stiffness(rng, 0.5, "start_"), **_fit_ended(size)}
                row |= {"damping_translation_n_s_per_m": 1e3, "damping_rotation_nm_s_per_rad": 1.4}
                row |= {"evaluations": 20}
                if size.solved:
                    own = shared if size.grouping == "per_specimen" else _stiffness(rng, 0.02)
                    errors = {"superior_error_mm": 0.1, "extension_error_deg": 0.3}
                    row |= {**own, "cost": 1.0}
                    row |= {key: at * np.exp(rng.normal(0, 0.1)) for key, at in errors.items()}
                yield row


def _method_fits(size: Size, rng: np.random.Generator) -> Iterator[Row]:
    errors = dict(zip(METHODS, (0.0, 30.0, 1e-4), strict=True))
    for specimen, pose, method in product(size.specimens, range(6), METHODS):
        row = {"specimen": specimen, "pose": pose, "method": method, **_fit_ended(size)}
        row |= {"evaluations": int(rng.integers(10, 90)), "claims_success": True}
        if size.solved:
            error = errors[method] * np.exp(rng.normal())
            row |= {**_stiffness(rng, 0.1), "cost": 1.0, "derivative_error": error}
        yield row


def _success_by_method(size: Size, rng: np.random.Generator) -> Iterator[Row]:
    good = dict(zip(METHODS, (6, 1, 5) if size.solved else (0, 0, 0), strict=True))
    for specimen, method in product(size.specimens, METHODS):
        names = ("solved", "successful", "arrived", "claimed")
        yield {
            "specimen": specimen,
            "method": method,
            "fits": 6,
            **dict.fromkeys(names, good[method]),
            "near_start_any": 0,
            "near_start_all": 0,
            "success": good[method] / 6,
            "success_low": 0.0,
            "success_high": 1.0,
            "evaluations_median": 40.0,
            "evaluations_largest": 90,
        }


def _landmark_precision(size: Size, rng: np.random.Generator) -> Iterator[Row]:
    whose, motions = ("calibrated", "nominal"), {"translation": "mm", "rotation": "deg"}
    for specimen, stiffness, (motion, unit), sd in product(
        size.specimens, whose, motions.items(), SDS
    ):
        row = {"specimen": specimen, "stiffness": stiffness, "motion": motion, "sd_mm": sd}
        row |= {"unit": unit, "n": 60, "without_result": 0 if size.solved else 60, "limit": 1.0}
        below = float(np.exp(-0.2 * sd)) if size.solved else 0.0
        row |= {"below": below, "below_low": 0.9 * below, "below_high": min(1.0, 1.1 * below)}
        if size.solved:
            names = ("median", "p90", "p95", "largest")
            row |= dict(zip(names, sd * np.array([0.2, 0.4, 0.5, 0.8]), strict=True))
        yield row


def _required_precision(size: Size, rng: np.random.Generator) -> Iterator[Row]:
    motions = ("translation", "rotation", "both")
    for specimen, stiffness, motion in product(size.specimens, ("calibrated", "nominal"), motions):
        row = {"specimen": specimen, "stiffness": stiffness, "motion": motion, "share": 0.95}
        row["n"] = 60
        if size.solved and stiffness == "calibrated":
            row |= {"sd_mm": 1.25, "sd_low_mm": 1.0, "sd_high_mm": 1.5, "message": ""}
        else:
            row["message"] = "too many poses are above the limit even at 0.5 mm"
        yield row


def _statistics(size: Size, rng: np.random.Generator) -> Iterator[Row]:
    for specimen, pose in product(size.specimens, range(150)):
        row = _test(specimen, "error against stiffness", str(pose))
        numbers = {"statistic": 0.5, "effect": pose / 150, "p": 0.001}
        corrected = {"p_bonferroni": 0.15, "p_holm": 0.01 if pose >= 100 else 0.2}
        yield row | _ended(size) | (numbers | corrected if size.solved else {})
    for specimen in size.specimens:
        yield _test(specimen, "normality", "") | {"status": "constant", "message": "<constant>"}


def _test(specimen: str, family: str, stratum: str) -> Row:
    return {
        "specimen": specimen,
        "family": family,
        "test": "Spearman",
        "joint": "*",
        "response": "extension_error",
        "factor": "extension_stiffness",
        "stratum": stratum,
        "n": 12,
        "statistic_name": "rho",
        "effect_name": "rho",
        "family_size": 150,
    }


def _cells(size: Size) -> Iterator[Row]:
    for specimen, joint, name in product(size.specimens, size.joints, MEASURED):
        yield {"specimen": specimen, "joint": joint, "coordinate": name}


def _agreement(size: Size, rng: np.random.Generator) -> Iterator[Row]:
    numbers = {
        "bias": 0.01,
        "bias_low": -0.02,
        "bias_high": 0.04,
        "sd": 0.1,
        "lower_limit": -0.186,
        "upper_limit": 0.206,
        "lower_limit_low": -0.24,
        "upper_limit_high": 0.26,
        "proportional_rho": 0.1,
        "proportional_p": 0.5,
        "measured_sd": 0.2,
        "predicted_sd": 0.15,
        "proportional": "told",
    }
    for cell in _cells(size):
        unit = "mm" if cell["coordinate"] in TRANSLATIONS else "deg"
        row = {**cell, "dataset": "reduced", "unit": unit, "n": 12, **_ended(size)}
        row["proportional"] = "no_result"
        yield row | (numbers if size.solved else {})


def _variance_shares(size: Size, rng: np.random.Generator) -> Iterator[Row]:
    shares: Mapping[str, float] = {"pose": 0.7, "stiffness": 0.2, "interaction": 0.1}
    for cell, (factor, share) in product(_cells(size), shares.items()):
        row = {**cell, "factor": factor, "n_poses": 12, "n_stiffness": 2, **_ended(size)}
        ends = {"share": share, "share_low": share - 0.05, "share_high": share + 0.05}
        signed = {f"signed_{name}": value for name, value in ends.items()}
        yield row | ({**ends, **signed, "total": share} if size.solved else {})


def _importance(size: Size, rng: np.random.Generator) -> Iterator[Row]:
    predictors = {"V2V1_extension_orientation": "pose", "extension_stiffness": "stiffness"}
    for cell, (predictor, factor) in product(_cells(size), predictors.items()):
        row = {**cell, "predictor": predictor, "factor": factor, "n": 24, **_ended(size)}
        share = 0.8 if factor == "pose" else 0.2
        yield row | ({"importance": share, "leaves": 5, "r2": 0.6} if size.solved else {})


def _posterior(size: Size, rng: np.random.Generator) -> Iterator[Row]:
    place = {"quantity": "stiffness", "joint": "*"}
    for specimen in size.specimens:
        if not size.solved:
            yield {"specimen": specimen, **place, "unknown": "*", "unit": "", **_fit_ended(size)}
            continue
        for name in size.free:
            number = COORDINATES.index(name)
            middle = START[number] * float(np.exp(rng.normal(0.0, 0.2)))
            ends = {"low": 0.7 * middle, "high": 1.4 * middle}
            yield {
                "specimen": specimen,
                **place,
                "unknown": STIFFNESS_COLUMNS[number],
                "unit": "N/m" if name in TRANSLATIONS else "N m/rad",
                **{"mean": middle, "sd": 0.2 * middle, "median": middle, **ends},
                **{"laplace_mean": middle, "laplace_sd": 0.2 * middle},
                **{f"laplace_{end}": value for end, value in ends.items()},
                **{"sd_over_prior": 0.1, "prior_dominated": False},
                **{"open_below": False, "open_above": name == "superior"},
                **{"r_hat": 1.0, "ess_bulk": 900.0, "ess_tail": 800.0},
                **_fit_ended(size),
            }


def _posterior_motion(size: Size, rng: np.random.Generator) -> Iterator[Row]:
    if not size.solved:
        return
    for specimen, joint, name in product(size.specimens, size.joints, MEASURED):
        value = float(rng.normal(-1.0, 0.2))
        yield {
            "specimen": specimen,
            **{"test": "flexion", "cycle": 1, "step": 1, "joint": joint, "coordinate": name},
            **{"unit": "mm" if name in TRANSLATIONS else "deg", "measured": value},
            **{"median": value + 0.05, "low": value - 0.2, "high": value + 0.3},
            **{"reading_low": value - 0.4, "reading_high": value + 0.5, "inside": True},
            **{"draws": 400, **_fit_ended(size)},
        }


def _pose_weights(size: Size, rng: np.random.Generator) -> Iterator[Row]:
    for specimen in size.specimens:
        evidence = rng.normal(0.0, 0.5, size.poses)
        weights = np.exp(evidence) / np.exp(evidence).sum()
        for pose, name in product(range(size.poses), size.free):
            number = COORDINATES.index(name)
            value = START[number]
            found = {"value": value, "low": 0.7 * value, "high": 1.4 * value}
            found |= {"log_evidence": float(evidence[pose])}
            yield {
                **{"specimen": specimen, "pose": pose, "joint": "*"},
                "unknown": STIFFNESS_COLUMNS[number],
                **(found if size.solved else {}),
                "weight": float(weights[pose]) if size.solved else 0.0,
                **_fit_ended(size),
            }


def _stiffness_over_load_point(size: Size, rng: np.random.Generator) -> Iterator[Row]:
    """Stiffness grows with height, as under a moment that does."""
    for specimen, anterior, superior in product(size.specimens, (0.0, 2.0), (-10.0, 0.0, 10.0)):
        row = {"specimen": specimen, "anterior_shift_mm": anterior, "superior_shift_mm": superior}
        row |= {"joint": "*", "degrees_of_freedom": 6, **_fit_ended(size)}
        if size.solved:
            row |= {"cost": 1.0 + 0.01 * abs(superior), "allowed": True}
            for number, name in enumerate(COORDINATES):
                value = START[number] * (1.0 + 0.01 * superior)
                row[STIFFNESS_COLUMNS[number]] = float(value)
                row[f"{name}_identifiable"] = name in size.free
        yield row


def _load_point_effect(size: Size, rng: np.random.Generator) -> Iterator[Row]:
    points = {"points": 6, "fitted": 6 if size.solved else 0, "allowed": 6 if size.solved else 0}
    for specimen, name in product(size.specimens, size.free):
        value = float(START[COORDINATES.index(name)])
        found = {"stated": value, "lowest": 0.9 * value, "highest": 1.1 * value}
        found |= {"per_mm_anterior": 0.0, "per_mm_superior": 0.01 * value}
        found |= {"cost_lowest": 1.0, "cost_highest": 1.1}
        row = {"specimen": specimen, "joint": "*", "coordinate": name, **points}
        row |= {"unit": "N/m" if name in TRANSLATIONS else "N m/rad", "message": ""}
        row |= {"anterior_sd_mm": 0.0, "superior_sd_mm": 0.0}
        yield row | (found if size.solved else {"message": "no stiffness was found"})
