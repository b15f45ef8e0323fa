"""Fitted parameters beside true ones, where both stand for the same thing at the same place."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from tests.generators.hidden import recipe_from
from tests.generators.hidden.anatomy import joints_of_recipe
from tests.validation.discrepancy.parameter_truth import TRUTHS, VECTORS, Values, levels, tilts
from tests.validation.discrepancy.row import Row

PER_UNIT = {"deg": np.pi / 180.0, "mm": 1e-3, "mm/deg": 1e-3 * 180.0 / np.pi}
"""SI per unit of tables; other units are SI."""

CLOSE = 0.1

Joints = tuple[str, ...]


@dataclass(frozen=True)
class Compared:
    """One parameter, SI.

    Attributes
    ----------
    size : what an error counts against. inside : whether the truth is in the 95 % region, which may
        be open; None without one. identifiable : whether both ends are known.
    """

    effect: str
    name: str
    truth: float
    fitted: float
    size: float
    inside: bool | None
    identifiable: bool = True

    @property
    def error(self) -> float:
        """Share of the size; none, NaN, where the truth is 0."""
        return abs(self.fitted - self.truth) / self.size if self.size else np.nan

    @property
    def close(self) -> bool:
        """Within ten percent."""
        return self.error <= CLOSE


def compared(row: Row) -> list[Compared]:
    """All parameters of a row's named effects that have a counterpart."""
    hidden = {one["name"]: one for one in row["recipe"]["hidden"]}
    joints = joints_of_recipe(recipe_from(row["recipe"]))
    found: list[Compared] = []
    for one in row["standing"]:
        truth = hidden.get(one["name"])
        if truth is not None and _same_coordinate(one, truth):
            found += (_of_levels if _by_level(one) else _of)(one, truth, joints)
    return found


def _same_coordinate(one: dict[str, Any], truth: dict[str, Any]) -> bool:
    return one["options"].get("coordinate") in (None, truth["coordinate"])


def _by_level(one: dict[str, Any]) -> bool:
    return bool(one["name"] == "level_dependence")


def _of(one: dict[str, Any], truth: dict[str, Any], joints: Joints) -> Iterator[Compared]:
    for value in one["values"]:
        true = _true(one, truth, value["place"])
        known = true is not None and value["name"] in true
        if known and _same_place(one, truth, value["place"], joints):
            size = _size(one["name"], true, value["name"])
            factor = PER_UNIT.get(value["unit"], 1.0)
            at, fitted = true[value["name"]], factor * value["value"]
            low = -np.inf if value["low"] is None else factor * value["low"]
            high = np.inf if value["high"] is None else factor * value["high"]
            inside, known = bool(low <= at <= high), value.get("identifiable", True)
            yield Compared(one["name"], value["name"], at, fitted, size, inside, known)


def _true(one: dict[str, Any], truth: dict[str, Any], place: list[str]) -> Values | None:
    if one["name"] == "load_misalignment":
        return tilts(truth, place[-1]) if one["spread"] == "by test" else None
    return TRUTHS[one["name"]](truth, one["options"])


def _size(effect: str, true: Values, name: str) -> float:
    if effect in VECTORS:
        return float(np.linalg.norm(list(true.values())))
    return abs(true[name])


def _same_place(
    one: dict[str, Any], truth: dict[str, Any], place: list[str], joints: Joints
) -> bool:
    """Whether a value is of the joint and specimen that truly have the effect, and of no other."""
    joint, specimen = truth["joint"], truth["specimen"]
    if joint is None:
        same_joint = one["joint"] is None
    else:
        same_joint = one["joint"] == joint or joints[joint] in place
    if specimen is None:
        return same_joint and one["specimen"] is None
    name = f"s{specimen + 1:02d}"
    return same_joint and (one["specimen"] == name or name in place)


def _of_levels(one: dict[str, Any], truth: dict[str, Any], joints: Joints) -> Iterator[Compared]:
    """Ratios of levels against their geometric mean: a common factor belongs to the base.

    Intervals are of the ratios themselves and hold that common factor too: none is scored.
    """
    fitted = {value["place"][-1]: value["value"] for value in one["values"] if value["place"]}
    if set(fitted) != set(joints):
        return
    mean = float(np.exp(np.mean(np.log(list(fitted.values())))))
    for joint, ratio in zip(joints, levels(truth), strict=True):
        yield Compared(one["name"], "ratio", ratio, fitted[joint] / mean, ratio, None)
