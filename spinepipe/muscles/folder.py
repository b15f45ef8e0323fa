"""A trunk from the tables of a cohort folder: joints, muscles and where their bodies lie.

Rows are those of one specimen. Bodies that are no vertebra (pelvis, ribs, sternum) move with the
vertebra that carries them. Left out, each with a count: muscles of the shoulder and the arm,
muscles that cross none of the seven joints, and muscles of the abdominal wall other than rectus and
obliques. An oblique that ends on the body `Abdomen` hangs in the rectus sheath; the rectus runs
straight from pelvis to ribs, its points on that body left out.

Where the head and the shoulders are, the tables do not say. They lie above T1T2 as in the generic
male of Allaire 2020 (four lengths of a public OpenSim model), by as much as this spine is longer.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from spinepipe.effects.contract import Array
from spinepipe.facts import number, several
from spinepipe.frames import Pose, rotation_zxy
from spinepipe.muscles import trunk_source
from spinepipe.muscles.trunk import (
    BODIES,
    LEVELS,
    RECTUS,
    SIDES,
    SLICES,
    THORAX,
    Muscles,
    Trunk,
    body_of,
)
from spinepipe.muscles.trunk_source import Fascicle, Source

SHEATH = "Abdomen"
OBLIQUES = ("external_oblique", "internal_oblique")

SHOULDER = ("scapula", "clavicle", "humerus", "ulna", "radius", "hand")
"""Starts of the names of bodies that do not move with the thorax."""

PELVIS = ("pelvis", "sacrum")

_MM = 1e-3
_POINT = ["x_mm", "y_mm", "z_mm"]
_ANGLES = ["extension_deg", "right_bending_deg", "left_rotation_deg"]

_CHAIN = (*LEVELS, *(f"T{n}T{n + 1}" for n in range(10, 0, -1)))
"""Joints below L5, L4, ... T1."""

_REFERENCE_LENGTH_M = number(__name__, "generic_male_length")
_HEAD_M = np.array(several(__name__, "generic_male_head")[""])
_SHOULDER_M = np.array(several(__name__, "generic_male_shoulder")[""])
_ARM_LENGTH_M = number(__name__, "generic_male_arm_length")
"""Generic male of Allaire 2020: height of T1T2 above L5S1; from T1T2 to the centre of mass of head
and neck, and to the middle of the shoulder; from there to the centre of mass of a hanging hand."""

_GROUPS = {
    "longissimus_thoracis_pars_thoracis": "longissimus_thoracis",
    "longissimus_thoracis_pars_lumborum": "longissimus_lumborum",
    "multifidus_lumbar": "multifidus",
}


@dataclass(frozen=True)
class SpecimenTables:
    """Rows of one specimen, columns as in the forms of `trunk_loads`.

    Attributes
    ----------
    muscles : muscle, point, body, x_mm, y_mm, z_mm.
    parameters : muscle, group, side, and pcsa_mm2 or max_isometric_force_n.
    joints : joint, place and orientation, L5S1 to T1T2.
    frames : pose in ground of each body; None: points are in ground.
    """

    muscles: pd.DataFrame
    parameters: pd.DataFrame
    joints: pd.DataFrame
    frames: pd.DataFrame | None = None


def source_of_folder(name: str, tables: SpecimenTables, stress_pa: float | None = None) -> Source:
    """The trunk of one specimen and the remarks on it.

    Parameters
    ----------
    name : of the source, for pages.
    stress_pa : maximum force over cross-section in the source, where its table does not say.

    Raises
    ------
    ValueError
        In a sentence, when joints, bodies or cross-sections are missing.
    """
    poses = {str(row["joint"]): _pose(row) for _, row in tables.joints.iterrows()}
    if missing := [joint for joint in _CHAIN if joint not in poses]:
        raise ValueError(f"joints of a trunk are missing: {', '.join(missing)}")
    l5s1 = poses["L5S1"].origin
    fascicles, left_out = _fascicles(tables, l5s1, stress_pa)
    fascicles, remarks = trunk_source.mirror_wrong_sides(fascicles)
    muscles = trunk_source.muscles_of(fascicles)
    remarks = (*remarks, *left_out, trunk_source.DISC_REMARK)
    return Source(_trunk(name, poses, muscles), remarks)


def in_ground(frames: pd.DataFrame, names: list[str], points: Array) -> Array:
    """(P, 3) m, points of bodies, each in the frame of its own, in ground.

    Raises
    ------
    ValueError
        For a body without a frame.
    """
    return _Bodies.of(frames).in_ground(names, points)


def _pose(row: "pd.Series") -> Pose:
    angles = np.radians(row[_ANGLES].to_numpy(float))
    return Pose(rotation_zxy(*angles), row[_POINT].to_numpy(float) * _MM)


def _fascicles(
    tables: SpecimenTables, l5s1: Array, stress_pa: float | None
) -> tuple[list[Fascicle], tuple[str, ...]]:
    """Those that are of use, and a sentence for each reason why others are not."""
    bodies = _Bodies.of(tables.frames)
    parameters = {str(row["muscle"]): row for _, row in tables.parameters.iterrows()}
    found: list[Fascicle] = []
    why: dict[str, int] = {}
    in_order = tables.muscles.sort_values("point", kind="stable")
    for name, rows in in_order.groupby("muscle", sort=False):
        if name not in parameters:
            raise ValueError(f"{name} has points and no row in muscle_parameters")
        row = parameters[str(name)]
        names = rows["body"].tolist()
        places = bodies.in_ground(names, rows[_POINT].to_numpy(float) * _MM) - l5s1
        reason = _reason_against(str(row["group"]), names, bodies)
        if reason:
            why[reason] = why.get(reason, 0) + 1
        else:
            found.append(_fascicle(str(name), row, names, places, bodies, stress_pa))
    total = sum(why.values()) + len(found)
    return found, tuple(
        f"{count} of {total} muscles are left out: {text}" for text, count in why.items()
    )


@dataclass(frozen=True)
class _Bodies:
    """Which vertebra carries a body, and where the body lies in ground."""

    carried_by: Mapping[str, str]
    poses: Mapping[str, Pose]

    @classmethod
    def of(cls, frames: pd.DataFrame | None) -> "_Bodies":
        if frames is None:
            return cls({}, {})
        rows = [row for _, row in frames.iterrows()]
        return cls(
            {str(row["body"]): str(row["carried_by"]) for row in rows},
            {str(row["body"]): _pose(row) for row in rows},
        )

    def in_ground(self, names: list[str], points: Array) -> Array:
        """(P, 3) m; as they are where no frames are given."""
        if not self.poses:
            return points
        if unknown := sorted(set(names) - set(self.poses)):
            raise ValueError(f"body_frames does not hold {', '.join(unknown)}")
        placed = [self.poses[name].apply(at) for name, at in zip(names, points, strict=True)]
        return np.array(placed)

    def index(self, name: str) -> int:
        """Index into BODIES of what it moves with."""
        carrier = self.carried_by.get(name, "S1" if name in PELVIS else name)
        if carrier not in (*BODIES, *SLICES):
            raise ValueError(f"no vertebra is known to carry the body {name}")
        return body_of(carrier)


def _reason_against(group: str, names: list[str], bodies: _Bodies) -> str | None:
    """Why a muscle does not count, in words; None where it does."""
    if any(name.startswith(SHOULDER) for name in names):
        return "they end on the shoulder or the arm"
    if SHEATH in names:
        kept = group == RECTUS or (group in OBLIQUES and len(names) == 2)
        return None if kept else "they end in the abdominal wall"
    if len({bodies.index(name) for name in names}) == 1:
        return "they cross none of the joints L5S1 to T11T12"
    return None


def _fascicle(
    name: str,
    row: "pd.Series",
    names: list[str],
    places: Array,
    bodies: _Bodies,
    stress_pa: float | None,
) -> Fascicle:
    """A muscle of the table of parameters, through places (P, 3) m of the bodies so named."""
    group, side = str(row["group"]), str(row["side"])
    if side not in SIDES:
        raise ValueError(f"{name} is on the side {side}; allowed: {', '.join(SIDES)}")
    in_sheath = SHEATH in names and group in OBLIQUES
    order = [k for k, one in enumerate(names) if one != SHEATH]
    body = tuple(bodies.index(names[k]) for k in order)
    if in_sheath:  # one end hangs there, written down with the body of the ribs
        order, body = [*order, names.index(SHEATH)], (*body[:1], THORAX)
    if len(body) < 2:
        raise ValueError(f"{name} has fewer than two points on bodies")
    # iliocostalis lumborum that reaches ribs is its thoracic part
    group = _GROUPS.get(group, group)
    if group == "iliocostalis_lumborum" and max(body) >= BODIES.index("T12"):
        group = "iliocostalis_thoracis"
    fibre = row.get("optimal_fibre_length_mm")
    return Fascicle(
        name=name,
        group=group,
        side=side,
        pcsa=_pcsa(name, row, stress_pa),
        fibre=0.0 if fibre is None or pd.isna(fibre) else float(fibre) * _MM,
        body=body,
        point=places[order],
        in_sheath=in_sheath,
    )


def _pcsa(name: str, row: "pd.Series", stress_pa: float | None) -> float:
    """m2, as told or from the force."""
    area = row.get("pcsa_mm2")
    if area is not None and not pd.isna(area):
        return float(area) * _MM**2
    force, stress = row.get("max_isometric_force_n"), row.get("source_stress_mpa")
    if stress is not None and not pd.isna(stress):
        stress_pa = float(stress) * 1e6
    if force is None or pd.isna(force) or stress_pa is None:
        raise ValueError(
            f"{name} has no cross-section: give pcsa_mm2, or max_isometric_force_n and the stress "
            "of the source"
        )
    return float(force) / stress_pa


def _trunk(name: str, poses: Mapping[str, Pose], muscles: Muscles) -> Trunk:
    l5s1 = poses["L5S1"].origin
    chain = np.array([poses[joint].origin for joint in _CHAIN]) - l5s1
    # no joint above T1 is given: T1 is taken to be as high as T2 and to stand as its frame does
    top = poses[_CHAIN[-1]].rotation[:, 1] * np.linalg.norm(chain[-1] - chain[-2])
    ends = np.vstack([chain, chain[-1] + top])
    size = chain[-1, 1] / _REFERENCE_LENGTH_M
    shoulder = chain[-1] + size * _SHOULDER_M
    frames = [poses[level].rotation for level in LEVELS]
    return Trunk(
        source=name,
        joints=chain[: len(LEVELS)],
        # extension about +z of the joint frames
        disc_tilt=np.array([float(np.arctan2(-r[0, 1], r[1, 1])) for r in frames]),
        disc_height=trunk_source.disc_heights(),
        disc_area=trunk_source.disc_areas(),
        vertebrae=trunk_source.vertebra_centres(ends),
        head=chain[-1] + size * _HEAD_M,
        shoulders=np.array([shoulder, shoulder * [1.0, 1.0, -1.0]]),
        arm_length=size * _ARM_LENGTH_M,
        sheath=trunk_source.sheath_of(muscles),
        muscles=muscles,
    )
