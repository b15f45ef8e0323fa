"""The 3-D viewer in Chromium: it draws what Python draws, moves with its slider, and runs no name.

Skipped where no Chromium is installed.

Catches a script that fails, a slider that does not move, and a projection that differs from the
still's.
"""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from test_pages_in_a_browser import CHROMIUM, RUNS, seen
from tracking_table_cases import Size, tables_of

from spinepipe.cohort import read
from spinepipe.report.viewer.figure import viewer_html, viewer_script, viewer_style
from spinepipe.report.viewer.meshes import Endplate, vertebra
from spinepipe.report.viewer.scene import Muscle, Scene, SceneBody, SceneLoad, SceneStep
from spinepipe.report.viewer.specimens import specimen_scenes
from spinepipe.report.viewer.still import projected_parts, view_matrix
from spinepipe.studies.tracking.scenes import tracking_scenes

ROOT = Path(__file__).resolve().parents[2]

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM, reason="no Chromium is installed here"),
]

COLORS = "--ink:#111;--soft:#555;--line:#ccc;--paper:#fff;--tint:#eee;--bone:#e6dac0;--disc:#a9cbe8"
COLORS += ";--bone-fixed:#c3c9cf;--hot:#b8410b;--load:#93397d;--muscle:#b3261e;--model:#0b62a8"
CSP = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'"

AT_ONCE = "window.requestAnimationFrame = (draw) => setTimeout(draw, 0);"
"""A browser without a screen paints when it likes."""


def page(scenes: list[Scene], then: str) -> str:
    """A page of nothing but a viewer; ``then`` is a script that runs when it stands."""
    return (
        f'<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>t</title>'
        f'<meta http-equiv="Content-Security-Policy" content="{CSP}">'
        f"<style>:root{{{COLORS}}}{viewer_style()}</style></head><body>{viewer_html(scenes)}"
        f"<script>{AT_ONCE}</script><script>{viewer_script()}</script>"
        f'<pre id="told"></pre><script>{then}</script></body></html>'
    )


def told(scenes: list[Scene], then: str, folder: Path) -> list[object]:
    """What ``then`` noted by ``tell(...)``; no script failed, and nothing was fetched."""
    note = 'const tell = (x) => { told.textContent += JSON.stringify(x) + "\\n"; };'
    found = seen(page(scenes, f"{note}\n{then}"), folder)
    assert found.asked_for == ()
    assert [line for line in found.said if "rror" in line or "Uncaught" in line] == []
    assert not found.ran
    lines = re.findall(r'<pre id="told">(.*?)</pre>', found.elements, re.DOTALL)[0]
    return [json.loads(line) for line in lines.replace("&amp;", "&").splitlines()]


FIND = """
const slider = document.querySelector("input[type=range]"), says = document.querySelector("output");
const canvas = document.querySelector("canvas");
const later = (task, wait) => setTimeout(task, wait);
"""


def test_the_slider_moves_the_bodies_and_tells_the_step(tmp_path: Path) -> None:
    scenes = specimen_scenes(read(ROOT / "config/cohorts/l4l5_disc"))
    steps = scenes[0].steps
    move = """
    const pictures = new Set(), state = () => [says.textContent, slider.ariaValueText];
    const go = (k) => { slider.value = k; slider.dispatchEvent(new Event("input")); };
    const left = {key: "ArrowLeft"}, acts = [
      () => go(0),
      () => { tell(state()); go(2); },
      () => { tell(state()); canvas.dispatchEvent(new KeyboardEvent("keydown", left)); },
      () => document.querySelector("[data-show=measured]").click(),
      () => document.querySelector("[data-view='-90 90']").click(),
      () => tell(pictures.size),
    ];
    const next = (act) => { pictures.add(canvas.toDataURL()); act(); };
    acts.forEach((act, k) => later(() => (k ? next(act) : act()), 200 * k));
    """
    first, second, different = told(scenes, FIND + move, tmp_path)
    assert first == [steps[0].says, steps[0].label]
    assert second == [steps[2].says, steps[2].label]
    assert different == 5, "slider, key, check box and view each change the picture"


def test_another_choice_shows_another_scene_and_play_moves_on(tmp_path: Path) -> None:
    scenes = tracking_scenes(tables_of(Size(1))["drawn"])
    moving = [scene for scene in scenes if len(scene.steps) > 1]
    choose = """
    const chooser = document.querySelector("select"), play = document.querySelector(".play");
    chooser.selectedIndex = 1;
    chooser.dispatchEvent(new Event("change"));
    tell([says.textContent, slider.max]);
    play.click();
    tell(says.getAttribute("aria-live"));
    later(() => { play.click(); tell([play.textContent, says.textContent]); }, 150);
    """
    chosen, live, moved = told(scenes, FIND + choose, tmp_path)
    assert chosen == [moving[1].steps[0].says, str(len(moving[1].steps) - 1)]
    assert live == "off", "a reader is not told every frame"
    assert moved == ["Play", moving[1].steps[1].says], "one step in 100 ms, then it stands"


def test_the_script_draws_what_the_still_draws(tmp_path: Path) -> None:
    """Every part of a step, one by one: what it is, where it is, and how light."""
    flat = np.eye(3)
    ends = [Endplate(np.array([0.0, y, 0.0]), flat) for y in (0.0, 27.0)]
    bodies = [SceneBody("S1", vertebra(*ends, 48.0, 34.0, sacrum=True), fixed=True)]
    bodies.append(SceneBody("L5", vertebra(*ends, 46.0, 33.0)))
    poses = np.array([[1.0, 2, 3, -20, 5, 0], [8.0, 36, -4, 10, -30, 15]])
    step = SceneStep(
        *("a", "A.", poses, poses + np.array([3.0, 1, 0, 0, 0, 5])),
        loads=[SceneLoad("moment", 1, np.array([1.0, 2.0, 3.0]), np.array([1.0, -2.0, 5.0]))],
        disc=np.array([0.4]),
        muscles=[Muscle(np.array([[0.0, 0, 0], [20.0, 60, 10], [5.0, 90, 30]]), 0.5)],
        markers=np.array([[10.0, 20, 30, 11, 21, 31], [5.0, 6, 7, np.nan, np.nan, np.nan]]),
    )
    scene = Scene("s", "Load", bodies, [step], "")
    draw = """
    const source = document.querySelector("script[type='application/json']").textContent;
    const data = SpineViewer.unpack(JSON.parse(source));
    const shown = {names: true, measured: true, loads: true, muscles: true, markers: true};
    const scene = data.scenes[0];
    tell(SpineViewer.partsOf(data, scene, scene.steps[0], scene.camera, shown));
    """
    (drawn,) = told([scene], draw, tmp_path)
    assert isinstance(drawn, list)
    parts = list(projected_parts(scene, step, view_matrix(scene.camera)))
    # what is nearly edge-on may be seen by one of the two alone: positions are rounded
    for look in {part.look for part in parts}:
        own = [part for part in parts if part.look == look]
        other = [part for part in drawn if part["look"] == look]
        assert abs(len(own) - len(other)) <= 2, look
        matched = 0
        for part in own:
            alike = [o for o in other if len(o["at"]) == len(part.at)]
            gaps = [float(np.abs(np.array(o["at"]) - part.at).max()) for o in alike]
            if gaps and min(gaps) < 0.2:
                found = alike[int(np.argmin(gaps))]
                assert abs(found["depth"] - part.depth) < 0.2
                assert abs(found.get("light", 1.0) - part.light) < 0.03
                assert (found.get("tint"), found.get("text", "")) == (part.tint, part.text)
                matched += 1
        assert matched >= len(own) - 2, look
    depths = [part["depth"] for part in drawn]
    assert depths == sorted(depths), "the nearest is drawn last"


def test_no_name_runs(tmp_path: Path) -> None:
    scene = specimen_scenes(read(ROOT / "config/cohorts/l4l5_disc"))[0]
    body = [SceneBody(RUNS, one.mesh) for one in scene.bodies]
    step = SceneStep(RUNS, RUNS, scene.steps[0].poses)
    hostile = Scene(RUNS, RUNS, body, [step, step], RUNS)
    found = seen(page([hostile, hostile], ""), tmp_path)
    assert not found.ran
    assert [line for line in found.said if "rror" in line] == []
