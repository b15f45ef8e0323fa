"""A made-up cohort as a folder, and its truth beside it."""

import csv
import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import Rotation

from .anatomy import COORDINATES, Bones, joints_of_recipe, vertebrae_of_recipe
from .design import Test
from .errors import load_factor
from .recipe import Recipe
from .scene import Scene, preload_points
from .tell import effect_told

if TYPE_CHECKING:
    from .make import Truth

HEADERS = {
    "specimens.csv": "specimen",
    "joints.csv": "specimen,joint,x_mm,y_mm,z_mm,extension_deg,right_bending_deg,left_rotation_deg",
    "bodies.csv": "specimen,vertebra,mass_kg,com_x_mm,com_y_mm,com_z_mm,"
    "ixx_kg_m2,iyy_kg_m2,izz_kg_m2,ixy_kg_m2,ixz_kg_m2,iyz_kg_m2",
    "loads.csv": "specimen,test,step,vertebra,fx_n,fy_n,fz_n,mx_nm,my_nm,mz_nm,"
    "px_mm,py_mm,pz_mm,time_s",
    "motion.csv": "specimen,test,cycle,step,joint,"
    "extension_deg,right_bending_deg,left_rotation_deg,anterior_mm,superior_mm,right_mm",
}

COHORT_YAML = """\
cohort: "{name}"
title: Made-up {ends} specimens
source: no measurement; tests/generators/hidden, seed {seed}
made_up: true
vertebrae: [{vertebrae}]
gravity: {gravity}
zeroed_at_step_0: {zeroed}
accuracy: {{rotation_deg: 0.001, translation_mm: 0.001}}
"""
MEASUREMENT_SD = """\
measurement_sd:
  rotation_deg: {rotation}
  translation_mm: {translation}
"""

Rows = Iterator[list[Any]]


def write_cohort(recipe: Recipe, scene: Scene, table: np.ndarray, folder: Path) -> None:
    """The cohort folder; ``table`` (P, T, C, S, J, 6) mm and deg is its motion."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "cohort.yaml").write_text(_yaml(recipe, folder.resolve().name), encoding="utf-8")
    rows = {
        "specimens.csv": ([name] for name in names(scene)),
        "joints.csv": _joints(recipe, scene),
        "bodies.csv": _bodies(recipe, scene),
        "loads.csv": _loads(recipe, scene),
        "motion.csv": _motion(recipe, scene, table),
    }
    for name, lines in rows.items():
        with (folder / name).open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(HEADERS[name].split(","))
            writer.writerows(lines)


def write_truth(truth: "Truth", folder: Path) -> None:
    """truth.json: recipe, effects in SI and border units, gaps, base stiffness, mistakes."""
    told = {
        "recipe": truth.recipe.as_dict(),
        "effects": [
            effect_told(hidden, gap, truth.recipe)
            for hidden, gap in zip(truth.recipe.hidden, truth.gaps, strict=True)
        ],
        "gap": truth.gap,
        "stiffness": truth.stiffness.tolist(),
        "errors": truth.errors,
    }
    (folder / "truth.json").write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")


def names(scene: Scene) -> list[str]:
    """Specimen names."""
    return [f"s{number + 1:02d}" for number in range(len(scene.bones))]


def _yaml(recipe: Recipe, name: str) -> str:
    vertebrae = vertebrae_of_recipe(recipe)
    header = COHORT_YAML.format(
        name=name,
        seed=recipe.seed,
        vertebrae=", ".join(vertebrae),
        ends=f"{vertebrae[-1]}-{vertebrae[0]}",
        gravity=str(recipe.gravity).lower(),
        zeroed=str(recipe.zeroed).lower(),
    )
    sd = MEASUREMENT_SD.format(rotation=recipe.noise_sd_deg, translation=recipe.noise_sd_mm)
    return header + (sd if recipe.state_sd else "")


def _joints(recipe: Recipe, scene: Scene) -> Rows:
    joints = joints_of_recipe(recipe)
    for name, bones in zip(names(scene), scene.bones, strict=True):
        angles = Rotation.from_matrix(bones.rotations).as_euler("ZXY", degrees=True)
        for joint, origin, zxy in zip(joints, bones.origins, angles, strict=True):
            yield [name, joint, *_cells(1000.0 * origin, 9), *_cells(zxy, 10)]


def _bodies(recipe: Recipe, scene: Scene) -> Rows:
    vertebrae = vertebrae_of_recipe(recipe)[1:]
    for name, bones in zip(names(scene), scene.bones, strict=True):
        segments = zip(vertebrae, bones.masses, bones.centres, bones.inertias, strict=True)
        for vertebra, mass, centre, inertia in segments:
            six = [*np.diag(inertia), inertia[0, 1], inertia[0, 2], inertia[1, 2]]
            yield [name, vertebra, mass, *_cells(1000.0 * centre, 9), *(f"{i:.9e}" for i in six)]


def _loads(recipe: Recipe, scene: Scene) -> Rows:
    vertebrae, factor = vertebrae_of_recipe(recipe)[1:], load_factor(recipe.errors)
    for name, bones in zip(names(scene), scene.bones, strict=True):
        for test in scene.tests:
            for step, time in enumerate(test.seconds):
                for body, *cells in _wrenches(test, step, factor, bones):
                    yield [name, test.name, step, vertebrae[body], *cells, time]


def _wrenches(test: Test, step: int, factor: float, bones: Bones) -> Rows:
    """Body, force, moment and point: all bodies where there is a preload, else the top alone."""
    points, top = preload_points(bones), len(bones.masses) - 1
    if test.forces.any():
        force, moment = test.forces[step], factor * test.moments[step]
        place = _cells(1000.0 * np.round(bones.origins[-1], 9), 6)
        yield [top, *_cells(force, 9), *_cells(moment, 9), *place]
        return
    share = test.preload / len(bones.masses)
    for body in range(0 if test.preload else top, top + 1):
        force = [0, f"{-share:.9f}" if share else 0, 0]
        moments = _cells(factor * test.moments[step], 9) if body == top else [0, 0, 0]
        yield [body, *force, *moments, *_cells(1000.0 * points[body], 6)]


def _motion(recipe: Recipe, scene: Scene, table: np.ndarray) -> Rows:
    specimens, joints = names(scene), joints_of_recipe(recipe)
    blank = np.array([name not in recipe.read for name in COORDINATES])
    for place in np.ndindex(table.shape[:-1]):
        number, test, cycle, step, joint = place
        cells = [
            "" if off else cell for off, cell in zip(blank, _cells(table[place], 9), strict=True)
        ]
        key = [specimens[number], scene.tests[test].name, cycle + 1, step, joints[joint]]
        yield [*key, *cells[3:], *cells[:3]]


def _cells(values: np.ndarray, digits: int) -> list[str]:
    """Cells with so many decimals, without negative zero."""
    return [f"{value:.{digits}f}" for value in np.round(values, digits) + 0.0]
