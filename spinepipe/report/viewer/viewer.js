"use strict";
// 3-D viewer on a 2-D canvas. The page's JSON holds meshes in the frames of their bodies (mm), and
// of each step the pose of every body: place in mm and rotation vector in degrees. This script
// poses, projects (orthographic), sorts (painter's algorithm), shades and draws; still.py does the
// same for print. Axes: x anterior, y superior, z right. On the screen: right, up, to the reader.
const SpineViewer = (function () {
  const LIGHT = [-0.35, 0.55, 0.76];
  const NEAR = 1e6, NAME = 2e6; // depth of what stands in front of all bodies, and of their names
  const FILLED = 0.92, HEAD = 11, HEAD_RAD = 0.42;
  const DEG = Math.PI / 180;

  const subtract = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const cross = (a, b) =>
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const turned = (m, p) => [dot(m[0], p), dot(m[1], p), dot(m[2], p)];
  const meanDepth = (points) => points.reduce((sum, p) => sum + p[2], 0) / points.length;

  // Rodrigues' formula: rows of the rotation by |v| degrees about v
  function rotation(v) {
    const degrees = Math.hypot(v[0], v[1], v[2]);
    const [x, y, z] = degrees ? v.map((part) => part / degrees) : [0, 0, 0];
    const s = Math.sin(degrees * DEG), c = Math.cos(degrees * DEG), d = 1 - c;
    return [
      [c + x * x * d, x * y * d - z * s, x * z * d + y * s],
      [y * x * d + z * s, c + y * y * d, y * z * d - x * s],
      [z * x * d - y * s, z * y * d + x * s, c + z * z * d],
    ];
  }

  // Points of a body in ground
  function posed(points, pose) {
    const m = rotation(pose.slice(3));
    return points.map((p) => {
      const t = turned(m, p);
      return [t[0] + pose[0], t[1] + pose[1], t[2] + pose[2]];
    });
  }

  // Rows to the right, up, and towards the reader: azimuth and elevation in degrees
  function viewMatrix(camera) {
    const ca = Math.cos(camera[0] * DEG), sa = Math.sin(camera[0] * DEG);
    const ce = Math.cos(camera[1] * DEG), se = Math.sin(camera[1] * DEG);
    return [[ca, 0, -sa], [-se * sa, ce, -ca * se], [sa * ce, se, ca * ce]];
  }

  const pathOf = (load, poses) => {
    const at = posed([load.at], poses[load.body])[0];
    return load.path.map((p) => [at[0] + p[0], at[1] + p[1], at[2] + p[2]]);
  };

  // All that a step shows, projected and sorted from the farthest to the nearest
  function partsOf(data, scene, step, camera, shown) {
    const view = viewMatrix(camera), sides = data.sides, parts = [];
    const face = function (corners, look, tint) {
      const at = corners.map((p) => turned(view, p));
      const normal = cross(subtract(at[1], at[0]), subtract(at[2], at[0]));
      if (normal[2] <= 0) { return; } // its back: bodies are closed
      const light = Math.min(1, Math.abs(dot(LIGHT, normal)) / Math.hypot(...normal));
      parts.push({ at, depth: meanDepth(at), look, light: 0.45 + 0.55 * light, tint });
    };
    const line = function (path, look, width, more) {
      const at = path.map((p) => turned(view, p));
      parts.push({ at, depth: meanDepth(at), look, width, ...more });
    };
    const mesh = (k) => data.meshes[scene.bodies[k].mesh];
    const corners = step.poses.map((pose, k) => posed(mesh(k).points, pose));
    corners.forEach(function (points, k) {
      const look = scene.bodies[k].fixed ? "fixed" : "bone";
      data.shapes[mesh(k).shape].forEach((f) => face(f.map((v) => points[v]), look));
    });
    // a disc: from the upper rim of a body to the lower rim of the next
    for (let k = 0; k + 1 < corners.length; k++) {
      const below = corners[k].slice(sides, 2 * sides), above = corners[k + 1].slice(0, sides);
      for (let i = 0; i < sides; i++) {
        const j = (i + 1) % sides;
        face([below[i], above[i], above[j], below[j]], "disc", step.disc && step.disc[k]);
      }
    }
    if (shown.loads) {
      (step.loads || []).forEach((load) =>
        line(pathOf(load, step.poses), "load", 3, { depth: NEAR, head: true }));
    }
    if (shown.muscles) {
      (step.muscles || []).forEach((m) =>
        line(m.path, "muscle", 0.6 + 3 * m.share, { alpha: 0.25 + 0.75 * m.share }));
    }
    if (shown.measured) {
      (step.measured || []).forEach(function (pose, k) {
        if (!pose || scene.bodies[k].fixed) { return; }
        const rims = posed(mesh(k).points.slice(0, 2 * sides), pose);
        const low = rims.slice(0, sides), top = rims.slice(sides), near = { depth: NEAR, dash: true };
        [low, top].forEach((rim) => line([...rim, rim[0]], "measured", 2, near));
        for (let i = 0; i < sides; i += sides / 4) { line([low[i], top[i]], "measured", 1.5, near); }
      });
    }
    if (shown.markers) {
      (step.markers || []).forEach(function (row) {
        [[row.slice(0, 3), "model"], [row.slice(3), "marker"]].forEach(function ([place, look]) {
          if (place[0] !== null) {
            parts.push({ at: [turned(view, place)], depth: NEAR, look, radius: 3 });
          }
        });
      });
    }
    if (shown.names) {
      step.poses.forEach(function (pose, k) {
        const at = [turned(view, posed([mesh(k).name], pose)[0])];
        parts.push({ at, depth: NAME, look: "name", text: scene.bodies[k].name });
      });
    }
    return parts.sort((a, b) => a.depth - b.depth);
  }

  // Points that the view must hold at all of these steps, ground. Muscles may leave it: some
  // reach far beyond the vertebrae, which would then be small
  function reachOf(data, scene, steps) {
    const found = [];
    steps.forEach(function (step) {
      [step.poses, step.measured || []].forEach((poses) => poses.forEach(function (pose, k) {
        if (pose) { found.push(...posed(data.meshes[scene.bodies[k].mesh].box, pose)); }
      }));
      (step.loads || []).forEach((load) => found.push(...pathOf(load, step.poses)));
      (step.markers || []).forEach(function (row) {
        [row.slice(0, 3), row.slice(3)].forEach((p) => p[0] !== null && found.push(p));
      });
    });
    return found;
  }

  // Of every mesh its points as triples, its bounding box, and where its name stands
  function unpack(data) {
    data.meshes.forEach(function (mesh) {
      mesh.points = [];
      for (let k = 0; k < mesh.at.length; k += 3) { mesh.points.push(mesh.at.slice(k, k + 3)); }
      const span = (points, axis) => {
        const values = points.map((p) => p[axis]);
        return [Math.min(...values), Math.max(...values)];
      };
      const [x, y, z] = [0, 1, 2].map((axis) => span(mesh.points, axis));
      mesh.box = x.flatMap((a) => y.flatMap((b) => z.map((c) => [a, b, c])));
      const rims = mesh.points.slice(0, 2 * data.sides);
      const mean = (axis) => rims.reduce((sum, p) => sum + p[axis], 0) / rims.length;
      mesh.name = [1.24 * span(rims, 0)[1], mean(1), mean(2)];
    });
    return data;
  }

  function mount(figure) {
    const data = unpack(JSON.parse(figure.querySelector("script").textContent));
    const canvas = figure.querySelector("canvas"), pen = canvas.getContext("2d");
    const find = (name) => figure.querySelector(name);
    const slider = find("input[type=range]"), says = find("output"), play = find(".play");
    const course = find(".course");
    const chooser = find("select"), boxes = [...figure.querySelectorAll("[data-show]")];
    let scene, reach, camera, number, zoom = 1, timer = 0, waiting = false, held = null;

    // a colour of the page's style as red, green and blue, however it is written there
    function color(name) {
      pen.fillStyle = "#000000";
      pen.fillStyle = getComputedStyle(figure).getPropertyValue("--" + name).trim();
      return [1, 3, 5].map((k) => parseInt(pen.fillStyle.slice(k, k + 2), 16));
    }
    const rgb = (parts) => `rgb(${parts.map(Math.round).join()})`;

    function draw() {
      waiting = false;
      const ratio = window.devicePixelRatio || 1;
      const width = canvas.clientWidth, height = canvas.clientHeight;
      canvas.width = width * ratio;
      canvas.height = height * ratio;
      pen.setTransform(ratio, 0, 0, ratio, 0, 0);
      // the scale at which all steps are in view
      const view = viewMatrix(camera), ends = [Infinity, -Infinity, Infinity, -Infinity];
      for (const p of reach) {
        const x = dot(view[0], p), y = dot(view[1], p);
        ends[0] = Math.min(ends[0], x); ends[1] = Math.max(ends[1], x);
        ends[2] = Math.min(ends[2], y); ends[3] = Math.max(ends[3], y);
      }
      const scale = FILLED * zoom * Math.min(width / (ends[1] - ends[0]), height / (ends[3] - ends[2]));
      const spot = (p) => [
        width / 2 + scale * (p[0] - (ends[0] + ends[1]) / 2),
        height / 2 - scale * (p[1] - (ends[2] + ends[3]) / 2),
      ];
      const colors = {};
      for (const [look, name] of Object.entries({
        bone: "bone", fixed: "bone-fixed", disc: "disc", hot: "hot", load: "load", muscle: "muscle",
        measured: "ink", marker: "ink", model: "model", name: "ink", paper: "paper",
      })) { colors[look] = color(name); }
      const shown = Object.fromEntries(boxes.map((box) => [box.dataset.show, box.checked]));
      const parts = partsOf(data, scene, scene.steps[number], camera, { names: true, ...shown });
      for (const part of parts) { drawPart(part, part.at.map(spot), colors); }
    }

    function drawPart(part, at, colors) {
      const trace = function (points) {
        pen.beginPath();
        points.forEach((p, k) => (k ? pen.lineTo(p[0], p[1]) : pen.moveTo(p[0], p[1])));
      };
      pen.lineWidth = part.width || 0.6;
      if (part.text) {
        pen.font = "600 13px system-ui, sans-serif";
        pen.lineWidth = 3; // a halo, so that names can be read in front of bones
        pen.strokeStyle = rgb(colors.paper);
        pen.strokeText(part.text, at[0][0], at[0][1] + 4);
        pen.fillStyle = rgb(colors.name);
        pen.fillText(part.text, at[0][0], at[0][1] + 4);
      } else if (part.radius) {
        pen.beginPath();
        pen.arc(at[0][0], at[0][1], part.radius, 0, 2 * Math.PI);
        pen.fillStyle = pen.strokeStyle = rgb(colors[part.look]);
        pen.lineWidth = 1.2;
        if (part.look === "model") { pen.fill(); } else { pen.stroke(); }
      } else if (part.width) {
        trace(at);
        pen.fillStyle = pen.strokeStyle = rgb(colors[part.look]);
        pen.globalAlpha = part.alpha || 1;
        pen.setLineDash(part.dash ? [4, 3] : []);
        pen.stroke();
        pen.setLineDash([]);
        pen.globalAlpha = 1;
        if (part.head) {
          const [before, tip] = at.slice(-2);
          const angle = Math.atan2(tip[1] - before[1], tip[0] - before[0]);
          trace([tip, ...[-HEAD_RAD, HEAD_RAD].map((turn) =>
            [tip[0] - HEAD * Math.cos(angle + turn), tip[1] - HEAD * Math.sin(angle + turn)])]);
          pen.fill();
        }
      } else {
        trace(at);
        pen.closePath();
        const tint = part.tint || 0;
        const base = colors[part.look].map((c, k) => (1 - tint) * c + tint * colors.hot[k]);
        pen.fillStyle = pen.strokeStyle = rgb(base.map((c) => c * part.light));
        pen.fill();
        pen.stroke();
      }
    }

    const redraw = function () {
      if (!waiting) { waiting = true; requestAnimationFrame(draw); }
    };
    function moveTo(k) {
      number = Math.max(0, Math.min(scene.steps.length - 1, k));
      if (!scene.oneScale) { reach = reachOf(data, scene, [scene.steps[number]]); }
      slider.value = String(number);
      slider.setAttribute("aria-valuetext", scene.steps[number].label);
      says.textContent = scene.steps[number].says;
      if (scene.course) {
        for (const end of ["x1", "x2"]) { course.querySelector("line").setAttribute(end, scene.course.at[number]); }
      }
      redraw();
    }
    function stop() {
      window.clearInterval(timer);
      timer = 0;
      play.textContent = "Play";
      says.setAttribute("aria-live", "polite");
    }
    function start() {
      play.textContent = "Pause";
      says.setAttribute("aria-live", "off"); // nobody wants every frame read out
      timer = window.setInterval(() => moveTo((number + 1) % scene.steps.length), scene.pause);
    }
    function open(k, first) {
      stop();
      scene = data.scenes[k];
      reach = reachOf(data, scene, scene.steps);
      if (!camera) { camera = scene.camera.slice(); }
      find("figcaption").textContent = scene.caption;
      find(".slider").textContent = scene.slider;
      slider.max = String(scene.steps.length - 1);
      if (scene.course) {
        course.querySelector("polyline").setAttribute("points", scene.course.line.join(" "));
        course.querySelector("title").textContent = scene.course.says;
      }
      for (const part of figure.querySelectorAll(".moves")) { part.hidden = scene.steps.length < 2; }
      moveTo(first);
    }
    function turn(azimuth, elevation) {
      camera = [azimuth, Math.max(-90, Math.min(90, elevation))];
      redraw();
    }
    function enlarge(factor) {
      zoom = Math.max(0.5, Math.min(6, zoom * factor));
      redraw();
    }

    slider.addEventListener("input", function () { stop(); moveTo(Number(slider.value)); });
    play.addEventListener("click", () => (timer ? stop() : start()));
    boxes.forEach((box) => box.addEventListener("change", redraw));
    if (chooser) { chooser.addEventListener("change", () => open(chooser.selectedIndex, 0)); }
    figure.querySelectorAll("[data-view]").forEach((button) =>
      button.addEventListener("click", function () {
        zoom = 1;
        turn(...button.dataset.view.split(" ").map(Number));
      }));
    canvas.addEventListener("pointerdown", function (event) {
      held = [event.clientX, event.clientY, ...camera];
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", function (event) {
      if (!held) { return; }
      turn(held[2] - 0.5 * (event.clientX - held[0]), held[3] + 0.5 * (event.clientY - held[1]));
    });
    for (const end of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(end, function () { held = null; });
    }
    canvas.addEventListener("wheel", function (event) {
      if (!event.ctrlKey) { return; } // a page that is scrolled does not catch in the view
      event.preventDefault();
      enlarge(Math.exp(-0.01 * event.deltaY));
    }, { passive: false });
    canvas.addEventListener("keydown", function (event) {
      const way = { ArrowLeft: [-6, 0], ArrowRight: [6, 0], ArrowUp: [0, 6], ArrowDown: [0, -6] };
      const factor = { "+": 1.15, "-": 1 / 1.15 };
      if (way[event.key]) {
        turn(camera[0] + way[event.key][0], camera[1] + way[event.key][1]);
      } else if (factor[event.key]) {
        enlarge(factor[event.key]);
      } else { return; }
      event.preventDefault();
    });
    new ResizeObserver(redraw).observe(canvas);
    new MutationObserver(redraw).observe(document.documentElement, { attributes: true });
    window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
    open(chooser ? chooser.selectedIndex : 0, Number(slider.value));
  }

  return { mount, posed, viewMatrix, partsOf, unpack };
})();
document.documentElement.classList.add("js");
document.querySelectorAll(".spine3d").forEach(SpineViewer.mount);
