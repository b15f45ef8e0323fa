"""What the viewer is given: bodies, their poses step by step, loads, muscles; and its JSON.

Axes of the product: x anterior, y superior, z right. mm and degrees.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any, Literal

import numpy as np
from scipy.spatial.transform import Rotation

from spinepipe.effects.contract import Array
from spinepipe.report.viewer.meshes import SIDES, Mesh

_ARC_DEG = np.arange(-40.0, 231.0, 15.0)
"""A moment is drawn as an arc about it, right-handed."""

_SHORTEST, _LONGEST_PER_BODY = 0.45, 0.9
"""Length of an arrow: the largest load of its kind is so many bodies' heights long or wide, the
smallest has this share of it."""


@dataclass(frozen=True)
class Camera:
    """Where it is seen from; 0, 0 is from the right, -90, 0 from behind, -90, 90 from above."""

    azimuth_deg: float = -28.0
    elevation_deg: float = 10.0


@dataclass(frozen=True, eq=False)
class SceneBody:
    """A vertebra.

    Attributes
    ----------
    mesh : in the body's frame. fixed : whether it does not move, and is drawn grey.
    """

    name: str
    mesh: Mesh
    fixed: bool = False


def bodies_at(
    names: Sequence[str], meshes: Sequence[Mesh], origins: Array, axes: Array
) -> list[SceneBody]:
    """Vertebrae from below, the first one fixed.

    Parameters
    ----------
    meshes : in ground. origins : (B, 3) mm, axes : (B, 3, 3), of the bodies' frames in ground.
    """
    rows = zip(names, meshes, origins, axes, strict=True)
    return [
        SceneBody(name, mesh.seen_from(origin, turn), fixed=k == 0)
        for k, (name, mesh, origin, turn) in enumerate(rows)
    ]


@dataclass(frozen=True, eq=False)
class SceneLoad:
    """A load on a vertebra; its point moves with the vertebra, its direction does not.

    Attributes
    ----------
    body : place of the vertebra in the scene. at : (3,) mm in the body's frame.
    vector : (3,) N or N m, ground.
    """

    kind: Literal["force", "moment"]
    body: int
    at: Array
    vector: Array


@dataclass(frozen=True, eq=False)
class Muscle:
    """A line of action.

    Attributes
    ----------
    path : (P, 3) mm, ground. share : 0 to 1, of the largest that the scene is about.
    """

    path: Array
    share: float


@dataclass(frozen=True, eq=False)
class SceneStep:
    """One place of the slider.

    Attributes
    ----------
    says : read aloud and shown: one or two sentences.
    poses, measured : (B, 6) place in mm and rotation vector in deg of each body in ground; a row
        of NaN in ``measured`` where nothing was.
    disc : (B - 1,) load of each disc, 0 to 1.
    markers : (M, 6) mm, ground: place in the model, then as measured; NaN where it is not known.
    """

    label: str
    says: str
    poses: Array
    measured: Array | None = None
    loads: Sequence[SceneLoad] = ()
    disc: Array | None = None
    muscles: Sequence[Muscle] = ()
    markers: Array | None = None


@dataclass(frozen=True, eq=False)
class Timeline:
    """A number over the time of a motion, drawn below its slider.

    Attributes
    ----------
    time_s, value : (N,). at_s : of each step. says : what it is, with its largest value.
    """

    time_s: Array
    value: Array
    at_s: Array
    says: str


@dataclass(frozen=True, eq=False)
class Scene:
    """What one choice of the viewer shows.

    Attributes
    ----------
    title : of the choice. slider : what the steps are, e.g. "Load". bodies : caudal to cranial;
        between two that follow each other a disc is drawn.
    pause_ms : how long each step stands when they play.
    one_scale : whether all steps are drawn at the same scale; else each fills the view.
    course : a curve over time; None for none.
    """

    title: str
    slider: str
    bodies: Sequence[SceneBody]
    steps: Sequence[SceneStep]
    caption: str
    camera: Camera = Camera()
    pause_ms: int = 700
    one_scale: bool = True
    course: Timeline | None = None


def rotation_vector(rotation: Array) -> Array:
    """(…, 3) deg of rotations (…, 3, 3)."""
    return Rotation.from_matrix(rotation).as_rotvec(degrees=True)


def posed_axes(poses: Array) -> Array:
    """(N, 3, 3) axes of bodies as columns, for their poses (N, 6)."""
    return Rotation.from_rotvec(poses[:, 3:], degrees=True).as_matrix()


def posed(points: Array, pose: Array) -> Array:
    """(…, 3) points of a body in ground, for its pose (6,)."""
    return points @ posed_axes(pose[None, :])[0].T + pose[:3]


def load_path(load: SceneLoad, scene: Scene) -> Array:
    """(P, 3) mm from the load's point, ground axes: an arrow that ends there, or an arc."""
    size = float(np.linalg.norm(load.vector))
    alike = [other for step in scene.steps for other in step.loads if other.kind == load.kind]
    share = size / max(float(np.linalg.norm(other.vector)) for other in alike)
    body = float(np.mean([np.ptp(b.mesh.vertices[: 2 * SIDES, 2]) for b in scene.bodies]))
    length = (_SHORTEST + (1.0 - _SHORTEST) * share) * _LONGEST_PER_BODY * body
    along = load.vector / size
    if load.kind == "force":
        return np.array([-length * along, np.zeros(3)])
    # any two directions across the moment that turn in its sense
    u = np.cross(along, [0.0, 1.0, 0.0] if abs(along[1]) < 0.9 else [1.0, 0.0, 0.0])
    u /= np.linalg.norm(u)
    angles = np.deg2rad(_ARC_DEG)
    return length * (np.outer(np.cos(angles), u) + np.outer(np.sin(angles), np.cross(along, u)))


def scenes_as_data(scenes: Sequence[Scene]) -> dict[str, Any]:
    """All scenes as plain data; a mesh that several bodies have, and faces, stand there once."""
    meshes: dict[str, int] = {}
    shapes: dict[tuple[tuple[int, ...], ...], int] = {}

    def mesh_of(mesh: Mesh) -> int:
        shape = shapes.setdefault(mesh.faces, len(shapes))
        text = json.dumps({"shape": shape, "at": _plain(mesh.vertices.ravel(), 1)})
        return meshes.setdefault(text, len(meshes))

    told = [
        {
            "title": scene.title,
            "slider": scene.slider,
            "caption": scene.caption,
            "pause": scene.pause_ms,
            "oneScale": scene.one_scale,
            "camera": [scene.camera.azimuth_deg, scene.camera.elevation_deg],
            "bodies": [
                {"name": b.name, "mesh": mesh_of(b.mesh), "fixed": b.fixed} for b in scene.bodies
            ],
            "steps": [_step(step, scene) for step in scene.steps],
            **({} if scene.course is None else {"course": _course(scene.course)}),
        }
        for scene in scenes
    ]
    kept = [json.loads(text) for text in meshes]
    return {"sides": SIDES, "shapes": list(shapes), "meshes": kept, "scenes": told}


def _course(course: Timeline) -> dict[str, Any]:
    """In percent of the time and of the largest value; down is positive, as in SVG."""
    start, end = float(course.time_s[0]), float(course.time_s[-1])
    share = 100.0 / max(end - start, 1e-9)
    top = max(float(course.value.max()), 1e-9)
    line = np.column_stack([share * (course.time_s - start), 100.0 * (1.0 - course.value / top)])
    return {
        "line": _rows(line),
        "at": _plain(share * (course.at_s - start), 1),
        "says": course.says,
    }


def _step(step: SceneStep, scene: Scene) -> dict[str, Any]:
    """A step as plain data, without what it does not have."""
    told: dict[str, Any] = {"label": step.label, "says": step.says, "poses": _poses(step.poses)}
    if step.measured is not None:
        told["measured"] = _poses(step.measured)
    if step.loads:
        told["loads"] = [
            {"body": one.body, "at": _plain(one.at, 1), "path": _rows(load_path(one, scene))}
            for one in step.loads
        ]
    if step.disc is not None:
        told["disc"] = _plain(step.disc, 2)
    if step.muscles:
        # whole millimetres: there are thousands of points
        told["muscles"] = [
            {"share": round(one.share, 2), "path": _rows(one.path, 0)} for one in step.muscles
        ]
    if step.markers is not None:
        told["markers"] = _rows(step.markers)
    return told


def _poses(poses: Array) -> list[list[float | None] | None]:
    """Rows of 0.1 mm and 0.01 deg; None for one that is not known."""
    rows = [[*_plain(row[:3], 1), *_plain(row[3:], 2)] for row in poses]
    return [row if np.isfinite(pose).all() else None for row, pose in zip(rows, poses, strict=True)]


def _rows(points: Array, decimals: int = 1) -> list[list[float | None]]:
    return [_plain(row, decimals) for row in points]


def _plain(values: Array, decimals: int) -> list[float | None]:
    """Rounded, None for NaN; whole numbers without a point, for they are shorter."""
    rounded = [round(x, decimals) if isfinite(x) else None for x in np.asarray(values).tolist()]
    return [int(value) if value is not None and value == int(value) else value for value in rounded]


def as_script(data: Any) -> str:
    """JSON that can stand inside a script element, whatever a specimen is called."""
    text = json.dumps(data, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
