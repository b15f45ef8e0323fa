"""Write the CSV files of the cohort ``palanca_l1l4`` from published numbers.

The paper (doi 10.3389/fbioe.2024.1304334) gives joint frames, loads and motion, but no landmark.
The landmarks here are built so that the frame rule of the cohort format returns the published
frames. Reasons and limits are in docs/decisions/0001-palanca-cohort.md.
The script shares no code with spinepipe: it is one of the things spinepipe is tested against.

Usage: python tests/generators/palanca_l1l4.py [folder]
"""

import csv
import sys
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

SPECIMEN = "s01"

# Table 7, complete set, medians in mm: anterior, superior, right of the bottom pot's centre.
ORIGIN = {
    "L1L2": np.array([2.40, 95.82, 11.48]),
    "L2L3": np.array([4.88, 56.61, 7.80]),
    "L3L4": np.array([3.93, 20.61, 4.16]),
}
# Table 8, complete set, medians in deg: extension, right bending, left rotation, sign as printed.
# The end joints have one complete vertebra each, so these are the frames of L2 and of L3.
FRAME_OF_VERTEBRA = {"L2": (6.90, 1.51, 3.28), "L3": (-7.04, 6.51, 8.60)}
NEIGHBOURS = {"L2": ("L1L2", "L2L3"), "L3": ("L2L3", "L3L4")}
JOINTS = ("L1L2", "L2L3", "L3L4")

# Section 2: load, bone density, mass and height of the top pot.
FORCE_N = 54.0
POT_OFFSET_MM = 50.0
TOP_MASS_KG = 1.0
DENSITY_KG_PER_CM3 = 1.14e-3

# Not published: assumed.
DISC_HEIGHT_MM = 10.0
DISC_DEPTH_MM = 35.0
PEDICLE_SPAN_MM = 36.0
PEDICLE_BEHIND_MM = 18.0
LANDMARK_SD_MM = 1.0
VERTEBRA_VOLUME_CM3 = 50.0
VERTEBRA_DEPTH_WIDTH_HEIGHT_MM = (42.0, 56.0, 27.0)
POT_RADIUS_HEIGHT_MM = (50.0, 50.0)

LOAD_OFFSET_MM = 0.1 * DISC_DEPTH_MM

# Section 3.1; flexion and compression negative, anterior shear assumed positive.
MOTION = {"L3L4": (-1.8, 0.33, -0.25), "L2L3": (-1.4, 0.34, -0.14)}


def rotation(extension_deg, right_bending_deg, left_rotation_deg):
    """(3, 3) Rz(extension) Rx(right bending) Ry(left rotation)."""
    (cz, cx, cy) = np.cos(np.deg2rad([extension_deg, right_bending_deg, left_rotation_deg]))
    (sz, sx, sy) = np.sin(np.deg2rad([extension_deg, right_bending_deg, left_rotation_deg]))
    about_z = np.array([[cz, -sz, 0.0], [sz, cz, 0.0], [0.0, 0.0, 1.0]])
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, cx, -sx], [0.0, sx, cx]])
    about_y = np.array([[cy, 0.0, sy], [0.0, 1.0, 0.0], [-sy, 0.0, cy]])
    return about_z @ about_x @ about_y


def vertebra_frames():
    """Frames of the two vertebrae that have all landmarks."""
    return {name: rotation(*angles) for name, angles in FRAME_OF_VERTEBRA.items()}


def disc_vectors(frames):
    """Lower to upper endplate centre of each disc, mm.

    Nominally one disc height along the joint's y axis, then the smallest change (least norm over
    all three discs) that puts each vertebra's endplate line into its own y-z plane.
    """
    mean = Rotation.from_matrix(np.stack([frames["L2"], frames["L3"]])).mean().as_matrix()
    upward = {"L1L2": frames["L2"][:, 1], "L2L3": mean[:, 1], "L3L4": frames["L3"][:, 1]}
    nominal = DISC_HEIGHT_MM * np.concatenate([upward[joint] for joint in JOINTS])
    matrix = np.zeros((2, 9))
    wanted = np.zeros(2)
    for row, (name, (above, below)) in enumerate(NEIGHBOURS.items()):
        x = frames[name][:, 0]
        for joint in (above, below):
            start = 3 * JOINTS.index(joint)
            matrix[row, start : start + 3] = x / 2.0
        wanted[row] = x @ (ORIGIN[above] - ORIGIN[below])
    change = np.linalg.pinv(matrix) @ (wanted - matrix @ nominal)
    return dict(zip(JOINTS, (nominal + change).reshape(3, 3), strict=True))


def landmarks():
    """{vertebra: {landmark: (3,) mm}}, caudal to cranial."""
    frames = vertebra_frames()
    disc = disc_vectors(frames)
    points = {"L4": {"superior_endplate_centre": ORIGIN["L3L4"] - disc["L3L4"] / 2.0}}
    for name in ("L3", "L2"):
        above, below = NEIGHBOURS[name]
        superior = ORIGIN[above] - disc[above] / 2.0
        inferior = ORIGIN[below] + disc[below] / 2.0
        points[name] = {
            "superior_endplate_centre": superior,
            "inferior_endplate_centre": inferior,
            **pedicle_bases(frames[name], superior, inferior),
        }
    points["L1"] = {"inferior_endplate_centre": ORIGIN["L1L2"] + disc["L1L2"] / 2.0}
    return points


def pedicle_bases(frame, superior, inferior):
    """Left and right pedicle base, one third of the body below the superior endplate."""
    middle = superior + (inferior - superior) / 3.0 - PEDICLE_BEHIND_MM * frame[:, 0]
    half = PEDICLE_SPAN_MM / 2.0 * frame[:, 2]
    return {"left_pedicle_base": middle - half, "right_pedicle_base": middle + half}


def elliptic_cylinder(mass_kg, depth_mm, width_mm, height_mm):
    """Principal inertia (x, y, z) in kg m2 of a solid elliptic cylinder standing along y."""
    a, c, h = np.array([depth_mm / 2.0, width_mm / 2.0, height_mm]) / 1000.0
    return mass_kg * np.array([(3 * c**2 + h**2) / 12, (a**2 + c**2) / 4, (3 * a**2 + h**2) / 12])


def body_rows(points):
    """Rows of bodies.csv; L4 is fixed and needs none."""
    for name in ("L3", "L2"):
        mass = VERTEBRA_VOLUME_CM3 * DENSITY_KG_PER_CM3
        body = points[name]
        centre = (body["superior_endplate_centre"] + body["inferior_endplate_centre"]) / 2.0
        yield body_row(name, mass, centre, VERTEBRA_DEPTH_WIDTH_HEIGHT_MM)
    radius, height = POT_RADIUS_HEIGHT_MM
    centre = ORIGIN["L1L2"] + [0.0, POT_OFFSET_MM, 0.0]
    yield body_row("L1", TOP_MASS_KG, centre, (2 * radius, 2 * radius, height))


def body_row(name, mass, centre, size):
    inertia = [f"{value:.6e}" for value in elliptic_cylinder(mass, *size)]
    return [SPECIMEN, name, f"{mass:.3f}", *millimetres(centre), *inertia, "0", "0", "0"]


def load_point():
    """Ball joint, mm: in front of and in the sagittal plane of the middle disc's centre."""
    x, _, z = ORIGIN["L2L3"]
    return np.array([x + LOAD_OFFSET_MM, ORIGIN["L1L2"][1] + POT_OFFSET_MM, z])


def load_rows():
    point = millimetres(load_point())
    for step, force in ((0, "0"), (1, f"{-FORCE_N:g}")):
        yield [SPECIMEN, "flexion", step, "L1", "0", force, "0", "0", "0", "0", *point]


def motion_rows():
    """Step 0 is kept empty: the paper gives motion from it, and gravity already acts there."""
    for joint in MOTION:
        yield [SPECIMEN, "flexion", 0, joint, *[""] * 6]
    for joint, (extension, anterior, superior) in MOTION.items():
        yield [SPECIMEN, "flexion", 1, joint, extension, "", "", anterior, superior, ""]


def landmark_rows(points):
    for vertebra, marks in points.items():
        for landmark, point in marks.items():
            yield [SPECIMEN, vertebra, landmark, *millimetres(point), LANDMARK_SD_MM]


def millimetres(point):
    """Three cells with six decimals, without negative zero."""
    return [f"{value:.6f}" for value in np.round(point, 6) + 0.0]


HEADERS = {
    "specimens.csv": "specimen,sex,age_years,height_m,mass_kg",
    "landmarks.csv": "specimen,vertebra,landmark,x_mm,y_mm,z_mm,sd_mm",
    "bodies.csv": "specimen,vertebra,mass_kg,com_x_mm,com_y_mm,com_z_mm,"
    "ixx_kg_m2,iyy_kg_m2,izz_kg_m2,ixy_kg_m2,ixz_kg_m2,iyz_kg_m2",
    "loads.csv": "specimen,test,step,vertebra,fx_n,fy_n,fz_n,mx_nm,my_nm,mz_nm,px_mm,py_mm,pz_mm",
    "motion.csv": "specimen,test,step,joint,extension_deg,right_bending_deg,left_rotation_deg,"
    "anterior_mm,superior_mm,right_mm",
}


def write(folder):
    """Write the five CSV files into an existing folder."""
    points = landmarks()
    rows = {
        "specimens.csv": [[SPECIMEN, "female", "73", "", "72.6"]],
        "landmarks.csv": landmark_rows(points),
        "bodies.csv": body_rows(points),
        "loads.csv": load_rows(),
        "motion.csv": motion_rows(),
    }
    for name, header in HEADERS.items():
        with (Path(folder) / name).open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(header.split(","))
            writer.writerows(rows[name])


if __name__ == "__main__":
    default = Path(__file__).parents[2] / "config" / "cohorts" / "palanca_l1l4"
    write(sys.argv[1] if len(sys.argv) > 1 else default)
