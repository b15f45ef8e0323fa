"""Projects with results of a search for missing effects: made up, not computed."""

import json
from collections.abc import Mapping
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
from chain_cases import JOINTS, ROTATIONS, STUDY, Chains

from spinepipe.schema import Table
from spinepipe.studies.discrepancy.kind import KIND, OTHERS
from spinepipe.studies.discrepancy.tables import (
    CANDIDATES,
    CONFUSIONS,
    FIELD_NUMBERS,
    GAP,
    HELD_OUT,
    IMPERFECTIONS,
    NEXT_TESTS,
    TABULATED,
    WHERE,
)
from spinepipe.tables import StudyTables, from_rows, write

Rows = list[dict[str, Any]]

TESTS = ("flexion", "left_lateral_bending", "left_axial_rotation")
SPECIMENS = ("a", "b", "c")
STEPS = 8
SD_DEG = 0.07
EFFECTS = {
    "neutral_zone": ("joint law", 0.21, 88.0),
    "nonlinear_stiffening": ("joint law", 0.32, 71.0),
    "facet_contact": ("joint law", 0.18, 33.0),
    "flexion_extension_asymmetry": ("joint law", 0.12, 30.5),
    "hysteresis": ("path", 0.40, 4.1),
    "load_misalignment": ("load", 0.66, -1.4),
    "marker_bias": ("measurement", 0.55, -2.2),
}
"""Kind, share absorbed by base and nuisance, and log evidence when a neutral zone is missing."""

_SCOPE = {"joints": ["L4L5"], "coordinates": ["extension"], "specimens": ["*"]}
_NAMED = {
    "name": "neutral_zone",
    "kind": "joint law",
    "scope": _SCOPE,
    "variant": {"coordinate": "extension"},
    "spread": "one joint",
    "parameters": [
        {"name": "half_width", "value": 1.55, "unit": "deg", "ci95": [1.42, 1.69]},
        {"name": "stiffness_ratio", "value": 0.21, "unit": "", "ci95": [0.17, 0.26]},
    ],
    "log_evidence": 88.0,
    "rivals": [
        {"name": "nonlinear_stiffening", "log_evidence_margin": 17.0},
        {"name": "facet_contact", "log_evidence_margin": 55.0},
    ],
}
_COMMON = {
    "cohort": "chains",
    "effects": [],
    "candidates_in_set": [],
    "not_testable": [
        {
            "name": "joint_centre_offset",
            "why": "pure moments and measured rotations leave no trace of it",
            "test_that_would_tell": "measured translations, or a transverse force",
        },
        {
            "name": "preload_stiffening",
            "why": "all tests have the same compression",
            "test_that_would_tell": "the same test under a second preload",
        },
    ],
    "noise": {"source": "repeats", "rotation_sd_deg": 0.1, "serial_correlation": 0.3},
    "rms_residual": {
        "unit": "noise sd",
        "base": 1.01,
        "with_effects": 1.01,
        "held_out_base": 1.04,
        "held_out_with_effects": 1.04,
    },
    "gap": {
        "unit": "noise sd",
        "base": 0.14,
        "with_effects": 0.14,
        "held_out_base": 0.28,
        "held_out_with_effects": 0.28,
        "held_out_closed": None,
    },
    "smallest_detectable": [
        {"name": name, "gap": round(0.15 + 0.3 * absorbed, 2)}
        for name, (_, absorbed, _) in EFFECTS.items()
    ],
    "unknown": None,
    "imperfections": {
        "gap_without": 0.9,
        "gap_with": 0.14,
    },
    "suspected_data_errors": [],
    "why": "",
    "threshold": {"log_evidence": 6.2},
}
_OPEN = {
    "rms_residual": {
        "unit": "noise sd",
        "base": 4.1,
        "with_effects": 1.02,
        "held_out_base": 4.3,
        "held_out_with_effects": 1.06,
    },
    "gap": {
        "unit": "noise sd",
        "base": 3.98,
        "with_effects": 0.2,
        "held_out_base": 4.18,
        "held_out_with_effects": 0.35,
        "held_out_closed": 0.97,
    },
}
VERDICTS: dict[str, dict[str, Any]] = {
    "NAMED": _COMMON
    | _OPEN
    | {
        "verdict": "NAMED",
        "effects": [_NAMED],
        "why": "neutral_zone (0.97)",
        "probabilities": {
            "neutral_zone": 0.97,
            "nonlinear_stiffening": 0.02,
            "something_else": 0.01,
        },
    },
    "NULL": _COMMON | {"verdict": "NULL", "probabilities": {"nothing": 0.82, "neutral_zone": 0.04}},
    "SET": _COMMON
    | _OPEN
    | {
        "verdict": "SET",
        "candidates_in_set": ["neutral_zone", "nonlinear_stiffening"],
        "probabilities": {"neutral_zone": 0.6, "nonlinear_stiffening": 0.38},
        "suspected_data_errors": [
            {
                "where": "specimen b, flexion, cycle 2, L3L4",
                "what": "sign flipped",
                "evidence": "slope on the other cycles is -0.98",
            },
        ],
        "gap": {
            **_OPEN["gap"],
            "with_effects": 3.98,
            "held_out_with_effects": None,
            "held_out_closed": None,
        },
        "rms_residual": {**_OPEN["rms_residual"], "with_effects": 4.1},
    },
    "UNKNOWN": _COMMON
    | _OPEN
    | {
        "verdict": "UNKNOWN",
        "probabilities": {"something_else": 0.99, "facet_contact": 0.11, "neutral_zone": 0.02},
        "unknown": {
            "where": "L4L5, extension, test flexion (gap 9.3)",
            "shape": "one side only, grows with the cube of the angle",
            "reason": "no_known_effect",
        },
        "gap": {
            **_OPEN["gap"],
            "with_effects": 3.98,
            "held_out_with_effects": None,
            "held_out_closed": None,
        },
        "rms_residual": {**_OPEN["rms_residual"], "with_effects": 4.1},
    },
}
"""What a search may come to, as ``verdict.json`` holds it."""

VERDICTS["PART"] = VERDICTS["NAMED"] | {
    "verdict": "PART",
    "why": "the neutral zone beats every rival, but more stays",
    "gap": {**_OPEN["gap"], "with_effects": 1.2, "held_out_closed": 0.6},
    "part": {
        "left_gap": 1.2,
        "left_where": "L3L4, left rotation, test left_axial_rotation (gap 2.4)",
        "left_shape": "load over the joint's own left rotation, shared",
        "reasons": ["a gap of 2.4 noise SD in left rotation (load over the joint's own motion)"],
        "coordinate": "left_rotation",
    },
}


def project(root: Path, study: str = "base: {stiffness: per_specimen}\n") -> Path:
    """A project with a cohort of straight chains and one study of it."""
    stiffness = np.array([[50.0, 60.0, 200.0]] * len(JOINTS))
    chains = Chains(dict.fromkeys(SPECIMENS, stiffness), TESTS, steps=STEPS, noise_deg=0.05)
    chains.write(root)
    head = f"study: {STUDY}\nkind: discrepancy\ncohort: chains\n"
    (root / "config" / "studies" / f"{STUDY}.yaml").write_text(head + study)
    return root


def results(root: Path, answer: str) -> Path:
    """Verdict and tables of a finished search in ``results/probe/discrepancy``; that folder."""
    folder = root / "results" / STUDY / "discrepancy"
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "verdict.json").write_text(json.dumps(VERDICTS[answer]))
    for name, (table, rows) in _tables(answer).items():
        write(table_of(table, rows), folder / f"{name}.parquet", {"seed": "1"})
    return folder


def files_of_a_search(folder: Path) -> dict[str, str]:
    """Where its job writes what, by the names of the job's arguments."""
    names = [*(f"{table.name}.parquet" for table in KIND.tables), *OTHERS]
    return {name.partition(".")[0]: str(folder / name) for name in names}


def tables(
    verdict: Mapping[str, Any], made: Mapping[str, pd.DataFrame], folder: Path
) -> StudyTables:
    """What a figure or page gets; the verdict is written to ``folder``."""
    path = folder / "verdict.json"
    path.write_text(json.dumps(verdict))
    return StudyTables(made, {"verdict": str(path)})


def table_of(table: Table, rows: Rows) -> pa.Table:
    """Rows as a table; cells that are not given are empty."""
    names = [column.name for column in table.columns]
    return from_rows(table, [{name: row.get(name) for name in names} for row in rows])


def frames(answer: str) -> dict[str, pd.DataFrame]:
    """The tables as rows read back."""
    return {
        name: table_of(table, rows).to_pandas() for name, (table, rows) in _tables(answer).items()
    }


def _tables(answer: str) -> Mapping[str, tuple[Table, Rows]]:
    wide, named = answer != "NULL", answer in ("NAMED", "PART")
    return {
        "gap": (GAP, _gap(wide, named)),
        "candidates": (CANDIDATES, _candidates(wide)),
        "where": (WHERE, _where(wide, named, answer == "PART")),
        "confusions": (CONFUSIONS, _confusions()),
        "held_out": (HELD_OUT, _held_out(wide, named)),
        "imperfections": (IMPERFECTIONS, _imperfections()),
        "next_tests": (NEXT_TESTS, _next_tests(answer)),
        "field_numbers": (FIELD_NUMBERS, _field_numbers() if named else []),
        "tabulated": (TABULATED, _tabulated() if answer in ("PART", "UNKNOWN") else []),
    }


def _gap(wide: bool, named: bool) -> Rows:
    """A neutral zone at L4L5 in flexion makes it turn by 1.5 deg more, at once."""
    rng = np.random.default_rng(3)
    rows = []
    for specimen, (test, driven), joint, (axis, coordinate), step in product(
        SPECIMENS, zip(TESTS, ROTATIONS, strict=True), JOINTS, enumerate(ROTATIONS), range(STEPS)
    ):
        base = -step / (50.0, 60.0, 200.0)[axis] * 57.3 if coordinate == driven else 0.0
        loose = wide and joint == "L4L5" and coordinate == test.replace("flexion", "extension")
        truth = base - (1.5 * np.tanh(step) - 0.2 * step if loose else 0.0)
        measured = truth + SD_DEG * rng.normal()
        modelled = truth if named else base
        key = {"specimen": specimen, "test": test, "step": step, "joint": joint}
        values = {"measured": measured, "base": base, "with_effects": modelled}
        values["load"] = -float(step) if coordinate == driven else 0.0
        values |= {"held_out_base": None, "held_out_with_effects": None}
        rows.append(
            {
                **key,
                "coordinate": coordinate,
                "unit": "deg",
                "held_at": None,
                "readings": 2,
                **values,
                "noise_sd": SD_DEG,
                "held_out_fold": "",
            }
        )
    return rows


def _where(wide: bool, named: bool, part: bool) -> Rows:
    places = [("all", {})]
    places += [("joint", {"joint": joint}) for joint in JOINTS]
    places += [("step", {"step": str(step)}) for step in range(STEPS)]
    places += [("test", {"test": test}) for test in TESTS]
    places += [("coordinate", {"coordinate": name}) for name in ROTATIONS]
    places += [
        ("joint x coordinate x test", {"joint": joint, "coordinate": coordinate, "test": test})
        for joint, coordinate, test in product(JOINTS, ROTATIONS, TESTS)
    ]
    everywhere = dict.fromkeys(("specimen", "test", "step", "joint", "coordinate"), "*")
    rows = []
    for (by, place), model in product(places, ("base", "with_effects")):
        worst = place.get("joint") == "L4L5" and place.get("test", "flexion") == "flexion"
        worst &= place.get("coordinate", "extension") == "extension"
        left = wide and not (named and model == "with_effects")
        gap = 9.3 if worst and left else 1.1 if by in ("all", "step") and left else 0.0
        if place in ({"test": "flexion"}, {"coordinate": "extension"}) and left:
            gap = 1.9
        stays = place == {"joint": "L3L4", "coordinate": "left_rotation", "test": TESTS[2]}
        gap = 2.4 if part and stays else gap
        rows.append(
            {
                "by": by,
                **everywhere,
                **place,
                "readings": 24,
                "model": model,
                "gap": gap,
                "gap_low": 0.8 * gap,
                "gap_high": 1.2 * gap + 0.1,
                "rms_residual": (1.0 + gap**2) ** 0.5,
            }
        )
    return rows


def _candidates(wide: bool) -> Rows:
    rows = []
    for name, (kind, absorbed, evidence) in EFFECTS.items():
        told = {
            "beside": "",
            "effect": name,
            "kind": kind,
            "variant": '{"coordinate": "extension"}',
            "spread": "one joint",
            "shape": "{}",
            "parameters": 1,
            "unit": "",
            "status": "converged",
            "message": "",
            "decision": "",
        }
        for joint, share in (("L4L5", 1.0), ("L3L4", 0.2)):
            found = share * evidence if wide else -2.0 + absorbed
            fit = {
                "scope": joint,
                "log_evidence": 0.9 * found,
                "delta_chi2": 2.0 * found,
                "gap_share": 0.5,
                "threshold": 6.2,
                "estimate": 0.2,
            }
            rows.append({**told, "stage": "screen 1", **fit})
            if joint == "L4L5" and wide and found > 20.0:
                rows.append({**told, "stage": "refit 1", **fit, "log_evidence": found})
    return rows


def _confusions() -> Rows:
    names = list(EFFECTS)
    rng = np.random.default_rng(4)
    return [
        {
            "effect": one,
            "other": other,
            "share": 1.0 if one == other else 0.9 * rng.random(),
            "gap_told_apart": None if one == other else 0.4,
        }
        for one, other in product(names, names)
    ]


def _held_out(wide: bool, named: bool) -> Rows:
    rows: Rows = []
    folds = [("test", name) for name in TESTS] + [("specimen", name) for name in SPECIMENS]
    for number, (kind, name) in enumerate(folds):
        base = 3.9 + 0.2 * number if wide else 1.0 + 0.01 * number
        done = {"status": "converged", "message": "", "worse": False}
        rms = {
            "base": base,
            "with_effects": 1.03 + 0.01 * number if named else base,
            "surrogate": None,
        }
        rows.append(
            {
                "fold": name,
                "kind": kind,
                "readings": 216,
                **{f"rms_{model}": value for model, value in rms.items()},
                **_gaps_of(rms),
                "closed": 0.97 if named else None,
                "gap_closed": 0.83 if named else None,
                **done,
            }
        )
    return rows


def _gaps_of(rms: Mapping[str, float | None]) -> dict[str, float]:
    """The gap of each model with an interval, of its root mean square residual."""
    found = {}
    for model, value in rms.items():
        if value is not None:
            gap = max(0.0, value**2 - 1.0) ** 0.5
            ends = {"": gap, "_low": 0.9 * gap, "_high": 1.1 * gap + 0.1}
            found |= {f"gap_{model}{end}": size for end, size in ends.items()}
    return found


def _imperfections() -> Rows:
    """Joint centres 2 mm too far forward in all joints; loads as they should be."""
    rows = []
    for model, specimen, joint in product(("base", "with_effects"), SPECIMENS, (*JOINTS, "*")):
        load = joint == "*"
        size = 0.1 if load else 1.0 + 0.05 * (SPECIMENS.index(specimen) - 1)
        rows.append(
            {
                "model": model,
                "specimen": specimen,
                "kind": "load_gain" if load else "joint_centre",
                "component": "gain" if load else "anterior",
                "joint": joint,
                "test": TESTS[0] if load else "*",
                "value": 0.02 * size if load else 2.0 * size,
                "unit": "1" if load else "mm",
                "prior_sd": 0.02 if load else 2.0,
                "in_prior_sds": size,
                "posterior_sd": 0.9 if load else 0.1,
                "taken_chi2": 0.2 if load else 40.0,
                "places": 1,
                "chance": None,
                "common": False,
            }
        )
    mean = {"specimen": "*", "joint": "*", "in_prior_sds": 1.0, "value": 2.0, "places": 9}
    mean |= {"posterior_sd": 0.02, "taken_chi2": None, "chance": 1e-9, "common": True}
    return [*rows, *(row | mean for row in rows[:1]), *(row | mean for row in rows[-4:-3])]


def _next_tests(answer: str) -> Rows:
    """Larger loads tell the two of a set apart."""
    if answer in ("NAMED", "NULL"):
        return []
    runs = [("flexion: loads 1.5 times as large", 6.0), ("flexion: once more", 0.1)]
    names = "neutral_zone or nonlinear_stiffening"
    subject = names if answer == "SET" else "what no effect explains: a load in extension"
    return [
        {
            "effect_or_pair": subject,
            "test": words,
            "cycles": 3,
            "gain_in_log_evidence": gain,
            "gain_per_cycle": gain / 3.0,
            "status": "advised" if gain > 1.0 else "tells_nothing",
            "message": "expected, both models refitted",
        }
        for words, gain in runs
    ]


def _field_numbers() -> Rows:
    """A neutral zone at L4L5 in extension: soft at rest, twice 1.5 deg wide."""
    told = {"stiffness_at_zero": (0.21, "N m/deg"), "zone": (3.0, "deg")}
    told |= {f"stiffness_at_{side}": (1.0, "N m/deg") for side in ("minus", "plus")}
    told |= {"break_minus": (-1.5, "deg"), "break_plus": (1.5, "deg")}
    told["loop_area"] = (4.0, "N m deg")
    slopes = {name: (0.6, unit) for name, (_, unit) in told.items() if "stiffness" in name}
    return [
        {
            "model": model,
            "specimen": specimen,
            "joint": "L4L5",
            "coordinate": "extension",
            "number": number,
            "load": 5.0,
            "value": value,
            "unit": unit,
            "low": None if number == "loop_area" else value - 0.05,
            "high": None if number == "loop_area" else value + 0.05,
            "at_bound": False,
            "specimens": 3 if specimen == "*" else 1,
        }
        for specimen in (*SPECIMENS, "*")
        for model, numbers in (("base", slopes), ("with_effects", told))
        for number, (value, unit) in numbers.items()
    ]


def _tabulated() -> Rows:
    """Axial rotation at L3L4 that softens to the left."""
    loads = {-2.0: -6.0, 0.0: 0.0, 2.0: 3.0}
    return [
        {
            "specimen": specimen,
            "joint": "L3L4",
            "coordinate": "left_rotation",
            "over": "left_rotation",
            "motion": motion,
            "motion_unit": "deg",
            "load": load,
            "low": load - 0.1 * abs(load),
            "high": load + 0.1 * abs(load),
            "base": 2.5 * motion,
            "load_unit": "N m",
            "specimens": 3 if specimen == "*" else 1,
        }
        for specimen in (*SPECIMENS, "*")
        for motion, load in loads.items()
    ]
