"""Tables of a whole cohort study, made up: they keep their schemas, nothing is computed."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.cohort.cohort import joint_names
from spinepipe.studies.cohort_stiffness.kind import KIND
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness
from spinepipe.tables import StudyTables, from_rows
from spinepipe.units import COORDINATE_UNITS, COORDINATES, STIFFNESS_UNITS

Row = dict[str, Any]
DRIVES = {
    "flexion": "extension",
    "left_lateral_bending": "right_bending",
    "left_axial_rotation": "left_rotation",
}
PUBLISHED = {"extension": 51.0, "right_bending": 68.8, "left_rotation": 291.0}
FITTED = ("per_specimen", "level_ratio", "per_joint", "partially_pooled")
_ERROR = {"literature": 2.0, "fitted": 0.2, "left_out_case": 0.5, "left_out_specimen": 1.0}


@dataclass(frozen=True)
class Size:
    """How large a cohort study is, and how it ended."""

    specimens: tuple[str, ...] = ("a", "b", "c")
    vertebrae: tuple[str, ...] = ("L5", "L4", "L3")
    tests: tuple[str, ...] = tuple(DRIVES)
    representations: tuple[str, ...] = FITTED
    solved: bool = True

    @property
    def joints(self) -> tuple[str, ...]:
        """Names, caudal to cranial."""
        return joint_names(self.vertebrae)

    @property
    def label(self) -> str:
        """What fits to all load cases are called."""
        return "all" if len(self.tests) > 1 else self.tests[0]

    @property
    def load_sets(self) -> tuple[str, ...]:
        """What stiffness is fitted to, most load cases last."""
        left_out = [f"all_but_{test}" for test in self.tests] if len(self.tests) > 2 else []
        return tuple(dict.fromkeys([*self.tests, *left_out, self.label]))


def study_of(size: Size, **more: Any) -> CohortStiffness:
    """A study of the cohort."""
    return CohortStiffness(
        study="probe",
        kind="cohort_stiffness",
        cohort="made_up",
        representations=size.representations,
        **more,
    )


def cohort_of(size: Size) -> Cohort:
    """A straight stack of joint frames without loads or motion."""
    rows = [
        (specimen, joint, 0.0, 36.0 * level, 0.0, 0.0, 0.0, 0.0)
        for specimen in size.specimens
        for level, joint in enumerate(size.joints)
    ]
    names = ("x_mm", "y_mm", "z_mm", "extension_deg", "right_bending_deg", "left_rotation_deg")
    return Cohort(
        name="made_up",
        title="a made-up cohort",
        source="written for the tests",
        folder=Path(),
        vertebrae=size.vertebrae,
        gravity=False,
        zeroed_at_step_0=True,
        measurement_sd=None,
        specimens=pd.DataFrame({"specimen": size.specimens}),
        landmarks=None,
        joints=pd.DataFrame(rows, columns=["specimen", "joint", *names]),
        bodies=None,
        loads=None,
        motion=None,
        digest="0" * 64,
    )


def tables_of(size: Size, **changed: pd.DataFrame) -> StudyTables:
    """Rows of all tables that figures and findings read, those of ``changed`` in their place."""
    return StudyTables({name: found.copy() for name, found in _made(size).items()} | changed)


@cache
def _made(size: Size) -> dict[str, pd.DataFrame]:
    """These tables, to be copied."""
    rng = np.random.default_rng(5)
    rows = {
        "stiffness": _stiffness(size, rng),
        "errors": _errors(size, rng),
        "sign_checks": _signs(size),
        "fits": _fits(size),
        "pooling": _pooling(size),
        "ranking": _ranking(size),
        "mae": _mae(size),
        "load_displacement": _curves(size),
        "helical_axes": _axes(size),
        "findings": iter(()),
        "statistics": iter(()),
    }
    return {name: frame(name, list(found)) for name, found in rows.items()}


def frame(name: str, rows: list[Row]) -> pd.DataFrame:
    """Rows as they come out of the file of a table."""
    (shape,) = (table for table in KIND.tables if table.name == name)
    empty = dict.fromkeys(column.name for column in shape.columns)
    return from_rows(shape, [{**empty, **row} for row in rows]).to_pandas()


def _ended(size: Size) -> Row:
    if size.solved:
        return {"status": "converged", "message": ""}
    return {"status": "unstable", "message": "it tips <over>"}


def _stages(size: Size) -> Iterator[tuple[str, str, str, str]]:
    """Representation, fitted to, source and stage of every stiffness but literature's."""
    for name, label in product(size.representations, size.load_sets):
        yield name, label, "own", "fitted"
        if len(size.specimens) > 1 and not label.startswith("all_but_"):
            source = "others_pooled" if name == "partially_pooled" else "others_median"
            yield name, label, source, "left_out_specimen"


def _stiffness(size: Size, rng: np.random.Generator) -> Iterator[Row]:
    keys = [(name, "nothing", "literature", "") for name in ("literature", "literature_levels")]
    keys += list(_stages(size))
    for (name, label, source, _), specimen, joint, coordinate in product(
        keys, size.specimens, size.joints, PUBLISHED
    ):
        row: Row = {
            "specimen": specimen,
            "representation": name,
            "fitted_to": label,
            "source": source,
            "joint": joint,
            "coordinate": coordinate,
            "unit": STIFFNESS_UNITS[coordinate],
            "at_bound": "no",
            **_ended(size),
        }
        if source == "literature":
            yield row | {"stiffness": PUBLISHED[coordinate], "status": "converged", "message": ""}
        elif not size.solved:
            yield row | {"identifiable": False}
        else:
            value = PUBLISHED[coordinate] * float(np.exp(rng.normal(0.0, 0.3)))
            ends = {"low": value / 1.2, "high": value * 1.2, "standard_error": 0.1 * value}
            yield row | {"stiffness": value, "identifiable": True, **ends}


def _errors(size: Size, rng: np.random.Generator) -> Iterator[Row]:
    keys = [
        (name, "nothing", "literature", "literature")
        for name in ("literature", "literature_levels")
    ]
    keys += list(_stages(size))
    for (name, label, source, stage), specimen, test, joint, coordinate in product(
        keys, size.specimens, size.tests, size.joints, COORDINATES
    ):
        held_out = source == "own" and test not in _within(label, size)
        if source.startswith("others") and test not in _within(label, size):
            continue
        told = "left_out_case" if held_out else stage
        row: Row = {
            "specimen": specimen,
            "representation": name,
            "fitted_to": label,
            "source": source,
            "stage": told,
            "test": test,
            "joint": joint,
            "coordinate": coordinate,
            "loaded": DRIVES.get(test, "extension") == coordinate,
            "unit": COORDINATE_UNITS[coordinate],
            "readings": 10,
            "measured": 3.0,
            "measured_peak": 6.0,
            **_ended(size),
        }
        if size.solved:
            error = _ERROR[told] * float(rng.normal())
            row |= {"bias": error, "mae": abs(error), "rmse": abs(error), "peak_error": error}
        yield row


def _within(label: str, size: Size) -> tuple[str, ...]:
    """The tests that a label means."""
    if label.startswith("all_but_"):
        return tuple(test for test in size.tests if label != f"all_but_{test}")
    return size.tests if label in ("all", "nothing") else (label,)


def _signs(size: Size) -> Iterator[Row]:
    for specimen, test, joint in product(size.specimens, size.tests, size.joints):
        yield {
            "specimen": specimen,
            "test": test,
            "joint": joint,
            "coordinate": DRIVES.get(test, "extension"),
            "readings": 10,
            "measured_over_expected": 1.1,
            "standard_error": 0.01,
            "verdict": "as_expected",
            "message": "",
        }


def _fits(size: Size) -> Iterator[Row]:
    for specimen, name, label in product(size.specimens, size.representations, size.load_sets):
        row = {"specimen": specimen, "representation": name, "fitted_to": label}
        row |= dict.fromkeys(("readings", "unknowns", "iterations", "evaluations", "n_optima"), 1)
        yield row | _ended(size)


def _pooling(size: Size) -> Iterator[Row]:
    if "partially_pooled" not in size.representations:
        return
    for coordinate, centre in PUBLISHED.items():
        row = {"representation": "partially_pooled", "fitted_to": size.label}
        row |= {"without": "nobody", "coordinate": coordinate}
        row |= {"unit": "N m/rad", "specimens": len(size.specimens), "iterations": 5}
        several = len(size.specimens) > 1
        found = {"centre": centre, "between_joints": 0.15}
        spread = {"between_levels": 0.1, "between_specimens": 0.25} if several else {}
        yield row | _ended(size) | (found | spread if size.solved else {})


def _ranking(size: Size) -> Iterator[Row]:
    for rank, name in enumerate(size.representations):
        row = {"criterion": "left_out_specimen", "representation": name, "source": "others_median"}
        row |= {"unit": "deg", "specimens": len(size.specimens), "message": ""}
        p = {} if rank == 0 else {"p": 0.3 if rank == 1 else 0.001}
        found = {"rank": rank + 1, "value": 0.5 + 0.1 * rank, "standard_error": 0.05} | p
        yield row | (found if size.solved else {"message": "no specimen has a result"})


def _mae(size: Size) -> Iterator[Row]:
    for name, test in product(size.representations, size.tests):
        row = {"representation": name, "fitted_to": size.label, "source": "own", "stage": "fitted"}
        row |= {"test": test, "coordinate": DRIVES.get(test, "extension"), "steps": "peak"}
        row |= {
            "specimens": len(size.specimens) if size.solved else 0,
            "largest_motion": 8.0,
            "unit": "deg",
        }
        yield row | ({"mae": 2.0, "mae_percent": 25.0} if size.solved else {})


def _sources(size: Size) -> Iterator[Row]:
    """Keys of curves and axes: whole loops, measured and simulated."""
    for specimen, test, joint, cycle in product(size.specimens, size.tests, size.joints, (2, 3)):
        key = {"specimen": specimen, "joint": joint, "test": test, "cycle": cycle}
        yield key | {"source": "measured", "representation": ""}
        yield key | {"source": "simulated", "representation": size.representations[0]}


def _curves(size: Size) -> Iterator[Row]:
    for number, key in enumerate(_sources(size)):
        measured = key["source"] == "measured"
        row = {**key, "coordinate": DRIVES.get(key["test"], "extension"), "readings": 41}
        row |= {"least_load_nm": -7.5, "largest_load_nm": 7.5, "elastic_zone": "upper_half"}
        row |= {"neutral_zone_definition": "double_sigmoid", "neutral_zone_formula": "bends"}
        if not size.solved and not measured:
            yield row | _ended(size) | {"neutral_zone": "not_read", "elastic_zone": "none"}
            continue
        turned = 10.0 + number % 7 + (0.0 if measured else 0.5)
        ends = {"range_of_motion_low_deg": turned - 0.3, "range_of_motion_high_deg": turned + 0.3}
        row |= {"range_of_motion_deg": turned, **ends, "status": "converged", "message": ""}
        work = {"hysteresis_area_low_j": 0.15, "hysteresis_area_high_j": 0.25}
        row |= {"hysteresis_area_j": 0.2, **work} if measured else {"hysteresis_area_j": 0.0}
        zone = {"neutral_zone_low_deg": 3.5, "neutral_zone_high_deg": 4.5}
        found = {"neutral_zone": "found", "neutral_zone_deg": 4.0, **zone}
        yield row | (found if measured else {"neutral_zone": "not_meaningful"})


def _axes(size: Size) -> Iterator[Row]:
    for key in _sources(size):
        row = {**key, "from_nm": -7.5, "to_nm": 7.5, "status": "found", "message": ""}
        if not size.solved and key["source"] == "simulated":
            yield row | {"status": "no_pose", "message": "it tips <over>"}
            continue
        sds = {
            "centre_anterior_sd_mm": 0.6,
            "centre_superior_sd_mm": 0.8,
            "centre_right_sd_mm": 0.0,
        }
        yield (
            row | {"angle_deg": 12.0, "centre_anterior_mm": -3.0, "centre_superior_mm": -8.0} | sds
        )
