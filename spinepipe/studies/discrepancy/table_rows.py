"""The tabulated law of what has no name, as rows: load over motion, point by point."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.effects.field_numbers import load_over
from spinepipe.effects.tabulated_law import KNOTS, TabulatedLaw
from spinepipe.studies.discrepancy.read_off import Laws, laws_at, mean_of, told
from spinepipe.studies.discrepancy.search.joint_fit import JointFit
from spinepipe.studies.discrepancy.search.model_files import covariance
from spinepipe.studies.discrepancy.verdict import EVERY
from spinepipe.units import COORDINATE_UNITS, COORDINATES, DISPLAY_PER_SI, LOAD_UNITS

Row = dict[str, Any]


def tabulated_rows(base: JointFit, final: JointFit) -> list[Row]:
    """Each table of the final fit at each knot, joint and specimen, and the mean of specimens.

    Parameters
    ----------
    base : fit of the base model, whose load at the same motion is told beside it.
    """
    joints = next(iter(final.models.values())).joints
    rows: dict[tuple[Any, ...], Row] = {}
    for one in final.hypothesis.supposed:
        law = one.form.variant.create()
        if isinstance(law, TabulatedLaw):
            acting = [name for name in final.models if one.form.acts_in(name)]
            for joint in joints if one.form.joint is None else (joints[one.form.joint],):
                for row in _of_joint(base, final, acting, joint, law):
                    key = tuple(row[name] for name in ("specimen", "joint", "coordinate", "over"))
                    rows.setdefault((*key, row["motion"]), row)
    return list(rows.values())


def _of_joint(
    base: JointFit, final: JointFit, specimens: Sequence[str], joint: str, law: TabulatedLaw
) -> Iterator[Row]:
    along = COORDINATES.index(law.along)
    motions = law.furthest * KNOTS

    def loads(joints: Sequence[Laws]) -> list[Array]:
        return [load_over(laws, law.coordinate, law.along, motions) for laws in joints]

    found = told(final, specimens, joint, loads)
    spread = covariance(final)
    groups = [*((name, [name]) for name in specimens), (EVERY[0], list(specimens))]
    for specimen, names in groups:
        of_base = np.mean([_at_base(base, name, joint, loads) for name in names], axis=0)
        for number, motion in enumerate(motions):
            value, away = mean_of([found[name] for name in names], number, spread)
            assert away is not None
            yield {
                "specimen": specimen,
                "joint": joint,
                "coordinate": law.coordinate,
                "over": law.along,
                "motion": float(motion * DISPLAY_PER_SI[along]),
                "motion_unit": COORDINATE_UNITS[law.along],
                "load": value,
                "low": value - away,
                "high": value + away,
                "base": float(of_base[number]),
                "load_unit": LOAD_UNITS[law.coordinate],
                "specimens": len(names),
            }


def _at_base(base: JointFit, specimen: str, joint: str, loads: Any) -> Array:
    model = base.models[specimen]
    (found,) = loads([laws_at(model, model.joints.index(joint))])
    held: Array = found
    return held
