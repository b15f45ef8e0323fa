"""A small cohort of a person who bends, or two, with markers; written without the library."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
from cohort_cases import Change, Files
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]

NAME = "tracked"
BODIES = ("S1", "L5", "L4", "L3", "L2", "L1", *(f"T{k}" for k in range(12, 0, -1)))
TURNS = "extension_deg,right_bending_deg,left_rotation_deg"
SIX = "ixx_kg_m2,iyy_kg_m2,izz_kg_m2,ixy_kg_m2,ixz_kg_m2,iyz_kg_m2"
KG = (1.4, 10.0)
"""Of a slice and of the pelvis."""

STEP_MM = 26.0
TILT_DEG = tuple(np.linspace(-18.0, 20.0, 17).tolist())
"""Of joints in ground, L5S1 to T1T2: forwards is negative."""

RATE = 20.0
FRAMES = {"stance": 5, "flexion_extension": 41, "lateral_bending": 41}
WHOLE_DEG = {"flexion_extension": (-45.0, 0.0, 0.0), "lateral_bending": (0.0, 35.0, 0.0)}
"""Extension, right bending, left rotation of T1 against the pelvis at the end, in equal shares."""

MARKERS: dict[str, tuple[str, tuple[float, float, float], str]] = {
    **{
        f"{body}_{letter}": (body, at, body)
        for body in ("T1", "T3", "T7", "T11", "L2", "L4")
        for letter, at in {
            "a": (-60.0, 30.0, 0.0),
            "b": (-65.0, 0.0, 17.0),
            "c": (-65.0, -8.0, -19.0),
        }.items()
    },
    **{body: (body, (-55.0, 10.0, 0.0), "") for body in ("T5", "T9", "T12", "L3")},
    "LASI": ("S1", (80.0, 10.0, -120.0), ""),
    "RASI": ("S1", (80.0, 10.0, 120.0), ""),
    "LPSI": ("S1", (-60.0, 5.0, -45.0), ""),
    "RPSI": ("S1", (-60.0, 5.0, 45.0), ""),
    "SACR": ("S1", (-75.0, -25.0, 0.0), ""),
}
"""Body, place in its frame mm, cluster; the paper's set."""

JOINT_TURNS = Rotation.from_euler("z", np.array(TILT_DEG)[:, None], degrees=True)
PLACES_MM = np.array([[3.0 * np.sin(0.5 * k), STEP_MM * k, 0.0] for k in range(17)])
"""Centres of the joints in ground."""


@dataclass
class Motion:
    """What a file of motion holds: places (F, K, 3) mm in ground, NaN where not seen."""

    names: list[str]
    places: Array
    unit: str = "mm"

    def of(self, name: str) -> Array:
        """(F, 3) of a marker, to be written into."""
        return self.places[:, self.names.index(name)]

    def exchange(self, one: str, other: str, begin: int = 0, end: int | None = None) -> None:
        """Exchange two markers from a frame on."""
        first, second = self.of(one)[begin:end].copy(), self.of(other)[begin:end].copy()
        self.of(one)[begin:end], self.of(other)[begin:end] = second, first


Spoil = Callable[[dict[str, Motion]], None]
"""What is done to the motions, by trial."""


def bodies_at(whole_deg: tuple[float, float, float]) -> tuple[Rotation, Array]:
    """Turns of all bodies in ground and their origins (18, 3) mm, T1 turned so far."""
    share = Rotation.from_euler("ZXY", np.array(whole_deg) / 17.0, degrees=True)
    turns, places = [Rotation.identity()], [PLACES_MM[0]]
    for k in range(17):
        below = JOINT_TURNS[k - 1] if k else Rotation.identity()
        start = PLACES_MM[k - 1] if k else PLACES_MM[0]
        rest = below.inv() * JOINT_TURNS[k]
        places.append(places[-1] + turns[-1].apply(below.inv().apply(PLACES_MM[k] - start)))
        turns.append(turns[-1] * rest * share)
    return Rotation.concatenate(turns), np.array(places)


def marker_places(whole_deg: tuple[float, float, float]) -> Array:
    """(K, 3) mm in ground."""
    turns, places = bodies_at(whole_deg)
    rows = [(BODIES.index(body), np.array(at)) for body, at, _ in MARKERS.values()]
    return np.array([places[k] + turns[k].apply(at) for k, at in rows])


def motions() -> dict[str, Motion]:
    """Trials by their names, each to be written into: a cosine to the end of the motion."""
    return {trial: Motion(list(MARKERS), _places(trial).copy()) for trial in FRAMES}


@cache
def _places(trial: str) -> Array:
    """(F, K, 3) mm of all markers in ground."""
    whole = np.array(WHOLE_DEG.get(trial, (0.0, 0.0, 0.0)))
    shares = (1.0 - np.cos(np.linspace(0.0, np.pi, FRAMES[trial]))) / 2.0
    return np.array([marker_places(tuple((share * whole).tolist())) for share in shares])


def trc(motion: Motion) -> str:
    """As a laboratory with z up and y to the left writes it."""
    count, frames = len(motion.names), len(motion.places)
    lines = [
        "PathFileType\t4\t(X/Y/Z)\tm.trc",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits",
        f"{RATE:g}\t{RATE:g}\t{frames}\t{count}\t{motion.unit}",
        "Frame#\tTime\t" + "\t\t\t".join(motion.names),
        "\t\t" + "\t".join(f"X{k}\tY{k}\tZ{k}" for k in range(1, count + 1)),
        "",
    ]
    for k, frame in enumerate(motion.places):
        cells = [str(k + 1), f"{k / RATE:.4f}"]
        for x, y, z in frame:
            cells += ["", "", ""] if np.isnan(x) else [f"{x:.4f}", f"{-z:.4f}", f"{y:.4f}"]
        lines.append("\t".join(cells))
    return "\n".join(lines) + "\n"


def tables() -> Files:
    """The files of the cohort but those of motion; a's trials are in lines 2 to 4."""
    joints = [f"{upper}{lower}" for lower, upper in pairwise(BODIES)]
    place = "x_mm,y_mm,z_mm"
    joint_rows = [
        f"a,{joint},{x:.4f},{y:.4f},{z:.4f},{tilt:.6f},0,0"
        for joint, (x, y, z), tilt in zip(joints, PLACES_MM, TILT_DEG, strict=True)
    ]
    body_rows = [
        f"a,{body},{KG[body == 'S1']},30,{STEP_MM * (k - 0.5):.3f},0,.01,.012,.006,0,0,0"
        for k, body in enumerate(BODIES)
    ]
    marker_rows = [
        f"a,{name},{body},{x:g},{y:g},{z:g},,{cluster}"
        for name, (body, (x, y, z), cluster) in MARKERS.items()
    ]
    trial_rows = [f"a,{trial},{trial},{trial}.trc,,,x z -y,hanging," for trial in FRAMES]
    rows = {
        "specimens": ["specimen", "a"],
        "subjects": ["specimen,sex,age_years,height_cm,mass_kg", "a,male,40,175,76"],
        "joints": [f"specimen,joint,{place},{TURNS}", *joint_rows],
        "bodies": [f"specimen,vertebra,mass_kg,com_x_mm,com_y_mm,com_z_mm,{SIX}", *body_rows],
        "marker_set": [f"specimen,marker,vertebra,{place},weight,cluster", *marker_rows],
        "trials": ["specimen,trial,kind,file,start_s,end_s,axes,arms,static", *trial_rows],
    }
    header = f"cohort: {NAME}\ntitle: one person\nsource: written for the tests\n"
    return {
        "cohort.yaml": f"{header}vertebrae: [{', '.join(BODIES)}]\ngravity: true\n",
        **{f"{stem}.csv": "\n".join(lines) + "\n" for stem, lines in rows.items()},
    }


def write(folder: Path, *changes: Change, spoilt: tuple[Spoil, ...] = ()) -> Path:
    """Write the cohort, its tables changed and its motions spoilt; return its folder."""
    files, recorded = tables(), motions()
    for spoil in spoilt:
        spoil(recorded)
    files |= {f"{trial}.trc": trc(motion) for trial, motion in recorded.items()}
    for change in changes:
        change(files)
    (folder / NAME).mkdir()
    for name, content in files.items():
        assert isinstance(content, str)
        (folder / NAME / name).write_text(content)
    return folder / NAME


def two_persons(files: Files) -> None:
    """Whoever a is, b is too, with files of motion of their own."""
    for name in [name for name in files if name.endswith(".csv")]:
        header, *rows = str(files[name]).splitlines()
        again = ["b" + row.removeprefix("a") for row in rows]
        if name == "trials.csv":
            again = [
                row.replace(f",{trial}.trc", f",b_{trial}.trc")
                for row, trial in zip(again, FRAMES, strict=True)
            ]
        files[name] = "\n".join([header, *rows, *again]) + "\n"
    for trial in FRAMES:
        files[f"b_{trial}.trc"] = files[f"{trial}.trc"]


def known_truth(files: Files) -> None:
    """Where L5 to T2 are at the first frame of stance and at the last of flexion."""
    header = f"specimen,trial,time_s,vertebra,x_mm,y_mm,z_mm,{TURNS}"
    rows = [header]
    for trial, frame, whole in (
        ("stance", 0, (0.0, 0.0, 0.0)),
        ("flexion_extension", FRAMES["flexion_extension"] - 1, WHOLE_DEG["flexion_extension"]),
    ):
        turns, places = bodies_at(whole)
        angles = turns.as_euler("ZXY", degrees=True)
        for k in range(1, 17):
            at = ",".join(f"{value:.4f}" for value in (places[k] + places[k + 1]) / 2.0)
            turned = ",".join(f"{value:.6f}" for value in angles[k])
            rows.append(f"a,{trial},{frame / RATE:.4f},{BODIES[k]},{at},{turned}")
    files["truth_centres.csv"] = "\n".join(rows) + "\n"


def told_smaller(share: float) -> Change:
    """The files tell skeleton and markers so many times as large; plates of clusters stay."""

    def smaller(name: str) -> Array:
        _, at, cluster = MARKERS[name]
        plate = [np.array(p) for _, p, c in MARKERS.values() if c and c == cluster]
        offset = np.array(at) - np.mean(plate, axis=0) if plate else np.zeros(3)
        return share * (np.array(at) - offset) + offset

    def change(files: Files) -> None:
        rows = [row.split(",") for row in str(files["joints.csv"]).splitlines()]
        for row in rows[1:]:
            row[2:5] = [f"{share * float(value):.6f}" for value in row[2:5]]
        files["joints.csv"] = "\n".join(map(",".join, rows)) + "\n"
        rows = [row.split(",") for row in str(files["marker_set.csv"]).splitlines()]
        for row in rows[1:]:
            row[3:6] = [f"{value:.6f}" for value in smaller(row[1])]
        files["marker_set.csv"] = "\n".join(map(",".join, rows)) + "\n"

    return change


def lost(marker: str, trial: str) -> Spoil:
    """A marker that a file of motion does not have."""

    def spoil(recorded: dict[str, Motion]) -> None:
        motion = recorded[trial]
        kept = [name != marker for name in motion.names]
        recorded[trial] = Motion([n for n in motion.names if n != marker], motion.places[:, kept])

    return spoil


def project(
    root: Path, study: str, *changes: Change, spoilt: tuple[Spoil, ...] = (), name: str = "small"
) -> None:
    """A study of the cohort; study : lines added to its file."""
    (root / "config/studies").mkdir(parents=True, exist_ok=True)
    (root / "config/cohorts").mkdir(parents=True, exist_ok=True)
    write(root / "config/cohorts", *changes, spoilt=spoilt)
    header = f"study: {name}\nkind: tracking\ncohort: {NAME}\n"
    (root / f"config/studies/{name}.yaml").write_text(header + study)
    (root / "config/config.yaml").write_text(f"studies: [{name}]\n")
