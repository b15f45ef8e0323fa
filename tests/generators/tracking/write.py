"""A cohort of made-up people as files: what is seen and told, and apart from it the truth."""

import csv
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from tests.generators.tracking.moved import Motion, moved
from tests.generators.tracking.person import BODIES, JOINTS, Array, Person, drawn
from tests.generators.tracking.seen import EXACT, Errors, Told, Worn, seen, told, worn

ARMS = {"stance": "hanging", "flexion_extension": "behind_head", "lateral_bending": "hanging"}
LONG_S = {"stance": 0.4, "flexion_extension": 4.0, "lateral_bending": 5.0}
TRUE_FRAMES = 21


@dataclass(frozen=True)
class Wanted:
    """A cohort that is wanted; `plain`: the control, exact but for noise (`person.plain_curves`)."""

    seed: int
    generator: str
    subjects: int
    plain: bool = False
    rate_hz: float = 50.0


def cohort(wanted: Wanted, folder: Path) -> None:
    """Write all files of a cohort."""
    folder.mkdir(parents=True, exist_ok=True)
    rows: dict[str, list[dict[str, Any]]] = {name: [] for name in _FILES}
    errors = EXACT if wanted.plain else Errors()
    for number in range(wanted.subjects):
        name = f"s{number + 1:02d}"
        rng = np.random.default_rng([wanted.seed, number])
        male = number % 10 in (2, 5, 8)
        _subject(wanted, folder, name, rng, male, errors, rows)
    for stem, columns in _FILES.items():
        _csv(folder / f"{stem}.csv", columns, rows[stem])
    (folder / "cohort.yaml").write_text(
        f"cohort: {folder.name}\n"
        f"title: Made-up people bending with markers on their backs ({wanted.generator})\n"
        f"source: python -m tests.generators.tracking --seed {wanted.seed} --generator "
        f"{wanted.generator} --subjects {wanted.subjects}{' --plain' * wanted.plain}\n"
        f"vertebrae: [{', '.join(BODIES)}]\ngravity: true\n"
    )


_PLACE = ("x_mm", "y_mm", "z_mm")
_TURN = ("extension_deg", "right_bending_deg", "left_rotation_deg")
_INERTIA = ("ixx_kg_m2", "iyy_kg_m2", "izz_kg_m2", "ixy_kg_m2", "ixz_kg_m2", "iyz_kg_m2")
_FILES: dict[str, Sequence[str]] = {
    "specimens": ("specimen",),
    "subjects": ("specimen", "sex", "age_years", "height_cm", "mass_kg"),
    "joints": ("specimen", "joint", *_PLACE, *_TURN),
    "bodies": ("specimen", "vertebra", "mass_kg", "com_x_mm", "com_y_mm", "com_z_mm", *_INERTIA),
    "marker_set": ("specimen", "marker", "vertebra", *_PLACE, "weight", "cluster"),
    "trials": ("specimen", "trial", "kind", "file", "start_s", "end_s", "axes", "arms"),
    "centres": ("specimen", "vertebra", *_PLACE),
    "truth_centres": ("specimen", "trial", "time_s", "vertebra", *_PLACE, *_TURN),
}


def _subject(
    wanted: Wanted,
    folder: Path,
    name: str,
    rng: np.random.Generator,
    male: bool,
    errors: Errors,
    rows: dict[str, list[dict[str, Any]]],
) -> None:
    seeds = {kind: int(seed) for kind, seed in zip(ARMS, rng.integers(2**32, size=3), strict=True)}
    drawing = int(rng.integers(2**32))
    markers: Worn | None = None
    for kind, arms in ARMS.items():
        person = drawn(np.random.default_rng(drawing), male, arms, wanted.plain)
        if markers is None:
            markers = worn(person, rng, errors)
            known = told(
                drawn(np.random.default_rng(drawing), male, "none", wanted.plain), rng, errors
            )
            _told_rows(name, person, known, markers, rows)
        of_trial = np.random.default_rng(seeds[kind])
        motion = moved(person, kind, wanted.generator, of_trial, wanted.rate_hz, LONG_S[kind])
        file = f"{name}_{kind}.trc"
        _trc(folder / file, markers, motion.time_s, seen(motion, markers, of_trial, errors))
        rows["trials"].append(
            {
                "specimen": name,
                "trial": kind,
                "kind": kind,
                "file": file,
                "axes": "x z -y",
                "arms": arms,
            }
        )
        rows["truth_centres"] += _truth(name, kind, person, motion)


def _told_rows(
    name: str, person: Person, known: Told, markers: Worn, rows: dict[str, list[dict[str, Any]]]
) -> None:
    rows["specimens"].append({"specimen": name})
    rows["subjects"].append(
        {
            "specimen": name,
            "sex": person.sex,
            "age_years": round(person.age_years),
            "height_cm": _short(100.0 * person.height_m, 1),
            "mass_kg": _short(person.mass_kg, 1),
        }
    )
    for k, joint in enumerate(JOINTS):
        angles = Rotation.from_matrix(known.turns[k]).as_euler("ZXY", degrees=True)
        rows["joints"].append(
            {"specimen": name, "joint": joint, **_at(known.places[k]), **_turned(angles)}
        )
    for k, body in enumerate(BODIES):
        about = known.about[k]
        each = [about[0, 0], about[1, 1], about[2, 2], about[0, 1], about[0, 2], about[1, 2]]
        rows["bodies"].append(
            {
                "specimen": name,
                "vertebra": body,
                "mass_kg": _short(known.kg[k], 4),
                **{f"com_{axis}": value for axis, value in _at(known.com[k]).items()},
                **{key: _short(value, 7) for key, value in zip(_INERTIA, each, strict=True)},
            }
        )
        rows["centres"].append({"specimen": name, "vertebra": body, **_at(_centre(person, k))})
    for k, marker in enumerate(markers.names):
        rows["marker_set"].append(
            {
                "specimen": name,
                "marker": marker,
                "vertebra": BODIES[int(markers.body[k])],
                **_at(markers.told[k]),
                "weight": 1,
                "cluster": markers.cluster[k],
            }
        )


def _centre(person: Person, body: int) -> Array:
    """(3,) m, half way to the joint above; of T1 and the pelvis a little above the joint."""
    above = person.steps[body] if 0 < body < 17 else np.array([0.0, 0.018, 0.0])
    found: Array = 0.5 * above
    return found


def _truth(name: str, kind: str, person: Person, motion: Motion) -> Iterable[dict[str, Any]]:
    frames = np.unique(np.linspace(0, len(motion.time_s) - 1, TRUE_FRAMES).astype(int))
    for frame in frames:
        turns = Rotation.from_matrix(motion.turns[frame]).as_euler("ZXY", degrees=True)
        for k, body in enumerate(BODIES):
            at = motion.places[frame, k] + motion.turns[frame, k] @ _centre(person, k)
            yield {
                "specimen": name,
                "trial": kind,
                "time_s": _short(motion.time_s[frame], 3),
                "vertebra": body,
                **_at(at),
                **_turned(turns[k]),
            }


def _at(place: Array) -> dict[str, str]:
    return {key: _short(1e3 * value, 3) for key, value in zip(_PLACE, place, strict=True)}


def _turned(angles: Array) -> dict[str, str]:
    return {key: _short(value, 4) for key, value in zip(_TURN, angles, strict=True)}


def _short(value: float, digits: int) -> str:
    return f"{round(float(value), digits) + 0.0:.{digits}f}"


def _csv(path: Path, columns: Sequence[str], rows: Iterable[dict[str, Any]]) -> None:
    with path.open("w", newline="") as file:
        table = csv.DictWriter(file, columns, restval="", lineterminator="\n")
        table.writeheader()
        table.writerows(rows)


def _trc(path: Path, markers: Worn, time_s: Array, places: Array) -> None:
    """As motion capture writes it: z up, mm; the lab's x is forwards and its y to the left."""
    rate = 1.0 / (time_s[1] - time_s[0])
    count, frames = len(markers.names), len(time_s)
    lines = [
        f"PathFileType\t4\t(X/Y/Z)\t{path.name}",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
        f"{rate:g}\t{rate:g}\t{frames}\t{count}\tmm\t{rate:g}\t1\t{frames}",
        "Frame#\tTime\t" + "\t\t\t".join(markers.names) + "\t\t",
        "\t\t" + "\t".join(f"X{k}\tY{k}\tZ{k}" for k in range(1, count + 1)),
        "",
    ]
    for frame in range(frames):
        cells = [str(frame + 1), f"{time_s[frame]:.4f}"]
        for x, y, z in 1e3 * places[frame]:
            cells += ["", "", ""] if np.isnan(x) else [f"{x:.2f}", f"{-z:.2f}", f"{y:.2f}"]
        lines.append("\t".join(cells))
    path.write_text("\n".join(lines) + "\n")
