"""A step of a scene as an SVG, for print and for readers without scripts.

The same painter's algorithm as in viewer.js: parts are projected along the line of sight, sorted
by their mean depth, and drawn from the farthest to the nearest.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.report.viewer.meshes import SIDES
from spinepipe.report.viewer.scene import Camera, Scene, SceneStep, load_path, posed

WIDTH, HEIGHT = 640, 420

LIGHT = np.array([-0.35, 0.55, 0.76])
"""Direction to the light: left, above and behind the reader."""

_NEAR, _NAME = 1e6, 2e6
"""Depth, mm, of what stands in front of all bodies, and of their names."""

_FAINTEST = 0.1
"""Muscles with a smaller share are left out: a still has no room to tell them apart."""

_FILLED = 0.92
_HEAD, _HEAD_RAD = 11.0, 0.42


@dataclass(frozen=True, eq=False)
class Part:
    """Something to draw.

    Attributes
    ----------
    at : (P, 3) projected mm: right, up, towards the reader. depth : that it is sorted by.
    look : its class. light : share of the colour of a face. tint : share of the hot colour.
    width : of a line, px. alpha : its opacity.
    """

    at: Array
    depth: float
    look: str
    light: float = 1.0
    tint: float | None = None
    width: float = 0.0
    alpha: float = 1.0
    text: str = ""


def view_matrix(camera: Camera) -> Array:
    """(3, 3) rows to the right, up, and towards the reader."""
    azimuth, elevation = np.deg2rad([camera.azimuth_deg, camera.elevation_deg])
    ca, sa, ce, se = np.cos(azimuth), np.sin(azimuth), np.cos(elevation), np.sin(elevation)
    return np.array([[ca, 0.0, -sa], [-se * sa, ce, -ca * se], [sa * ce, se, ca * ce]])


def telling_step(scene: Scene) -> int:
    """The step whose bodies are farthest, on average, from where they are in the first.

    One with muscles, where there are any.
    """

    def places(step: SceneStep) -> Array:
        if step.measured is None:
            return step.poses[:, :3]
        return np.where(np.isfinite(step.measured), step.measured, step.poses)[:, :3]

    start = places(scene.steps[0])
    apart = [
        (bool(step.muscles), np.linalg.norm(places(step) - start, axis=1).mean())
        for step in scene.steps
    ]
    return apart.index(max(apart))


def still(scene: Scene, number: int) -> str:
    """A step as an SVG; its colours are variables of the page, so that dark mode has its own."""
    step, view = scene.steps[number], view_matrix(scene.camera)
    parts = sorted(projected_parts(scene, step, view), key=lambda part: part.depth)
    # muscles may leave the picture: some reach far beyond the vertebrae, which would then be small
    flat = np.vstack([part.at[:, :2] for part in parts if part.look != "muscle"])
    low, high = flat.min(axis=0), flat.max(axis=0)
    scale = _FILLED * float(np.min([WIDTH, HEIGHT] / np.maximum(high - low, 1.0)))
    middle = 0.5 * (low + high)

    def spot(points: Array) -> Array:
        return np.array([WIDTH / 2, HEIGHT / 2]) + scale * (points[:, :2] - middle) * [1.0, -1.0]

    drawn = "".join(_element(part, spot(part.at)) for part in parts)
    label = escape(f"{scene.title}: {step.says}")
    return (
        f'<svg class="still" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{label}">'
        f"{drawn}</svg>"
    )


def projected_parts(scene: Scene, step: SceneStep, view: Array) -> Iterator[Part]:
    """All that a step shows, in the frame of the reader (`view_matrix`), not yet sorted."""
    corners = [
        posed(b.mesh.vertices, pose) for b, pose in zip(scene.bodies, step.poses, strict=True)
    ]
    for body, points in zip(scene.bodies, corners, strict=True):
        for face in body.mesh.faces:
            yield from _face(view, points[list(face)], "fixed" if body.fixed else "bone")
    following = np.roll(np.arange(SIDES), -1)
    for k in range(len(scene.bodies) - 1):
        below, above = corners[k][SIDES : 2 * SIDES], corners[k + 1][:SIDES]
        tint = None if step.disc is None else float(step.disc[k])
        for i, j in enumerate(following):
            quad = np.array([below[i], above[i], above[j], below[j]])
            yield from _face(view, quad, "disc", tint)
    for load in step.loads:
        at = posed(load.at, step.poses[load.body])
        yield _line(view, at + load_path(load, scene), "load", 3.0, near=True)
    for muscle in step.muscles:
        if muscle.share >= _FAINTEST:
            width, alpha = 0.6 + 3.0 * muscle.share, 0.25 + 0.75 * muscle.share
            yield _line(view, muscle.path, "muscle", width, alpha=alpha)
    if step.measured is not None:
        yield from _ghost(scene, step.measured, view)
    if step.markers is not None:
        for model, read in step.markers.reshape(-1, 2, 3):
            for place, look in ((model, "model"), (read, "marker")):
                if np.isfinite(place).all():
                    yield Part(place[None, :] @ view.T, _NEAR, look)
    for body, pose in zip(scene.bodies, step.poses, strict=True):
        front = np.array([[1.24 * body.mesh.vertices[: 2 * SIDES, 0].max(), 0.0, 0.0]])
        middle = body.mesh.vertices[: 2 * SIDES].mean(axis=0) * [0.0, 1.0, 1.0]
        yield Part(posed(front + middle, pose) @ view.T, _NAME, "name", text=body.name)


def _face(view: Array, corners: Array, look: str, tint: float | None = None) -> Iterator[Part]:
    """A face, if its front is seen: bodies are closed, so nobody sees the back of one."""
    at = corners @ view.T
    normal = np.cross(at[1] - at[0], at[2] - at[0])
    if normal[2] > 0.0:
        light = float(abs(LIGHT @ normal) / np.linalg.norm(normal))
        yield Part(at, float(at[:, 2].mean()), look, 0.45 + 0.55 * min(light, 1.0), tint)


def _line(
    view: Array, path: Array, look: str, width: float, alpha: float = 1.0, near: bool = False
) -> Part:
    at = path @ view.T
    depth = _NEAR if near else float(at[:, 2].mean())
    return Part(at, depth, look, width=width, alpha=alpha)


def _ghost(scene: Scene, measured: Array, view: Array) -> Iterator[Part]:
    """Both rims of every measured body, and four lines between them."""
    for body, pose in zip(scene.bodies, measured, strict=True):
        if np.isfinite(pose).all() and not body.fixed:
            points = posed(body.mesh.vertices[: 2 * SIDES], pose)
            for rim in (points[:SIDES], points[SIDES:]):
                yield _line(view, np.vstack([rim, rim[:1]]), "measured", 2.0, near=True)
            for k in range(0, SIDES, SIDES // 4):
                yield _line(view, points[[k, k + SIDES]], "measured", 1.5, near=True)


def _element(part: Part, at: Array) -> str:
    """A part as an element of an SVG; ``at`` (P, 2) px."""
    x, y = at[0]
    if part.text:
        return f'<text x="{x:.0f}" y="{y + 4:.0f}">{escape(part.text)}</text>'
    if part.look in ("model", "marker"):
        return f'<circle class="{part.look}" cx="{x:.1f}" cy="{y:.1f}" r="3"/>'
    points = " ".join(f"{x:.1f},{y:.1f}" for x, y in at)
    if not part.width:
        tint = "" if part.tint is None else f";--t:{100 * part.tint:.0f}%"
        style = f"--l:{100 * part.light:.0f}%{tint}"
        return f'<polygon class="{part.look}" points="{points}" style="{style}"/>'
    faint = "" if part.alpha == 1.0 else f' opacity="{part.alpha:.2f}"'
    line = (
        f'<polyline class="{part.look}" points="{points}" stroke-width="{part.width:.1f}"{faint}/>'
    )
    return line + (_head(at) if part.look == "load" else "")


def _head(at: Sequence[Array] | Array) -> str:
    """The head of an arrow at the end of a line (P, 2) px."""
    (x0, y0), (x, y) = at[-2], at[-1]
    angle = np.arctan2(y - y0, x - x0)
    wings = [
        (x - _HEAD * np.cos(angle + turn), y - _HEAD * np.sin(angle + turn))
        for turn in (-_HEAD_RAD, _HEAD_RAD)
    ]
    points = " ".join(f"{u:.1f},{v:.1f}" for u, v in [(x, y), *wings])
    return f'<polygon class="head" points="{points}"/>'
