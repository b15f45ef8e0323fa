"""A phantom as a cohort folder, and its truth beside it."""

import csv
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from . import loads, measure
from .anatomy import DONORS, JOINTS, VERTEBRAE
from .cohort import Phantom
from .truth import STIFFNESS_COLUMNS

LANDMARK_SD_MM = 1.0
TOP = VERTEBRAE[-1]

HEADERS = {
    "specimens.csv": "specimen,sex,age_years,height_m,mass_kg",
    "landmarks.csv": "specimen,vertebra,landmark,x_mm,y_mm,z_mm,sd_mm",
    "joints.csv": "specimen,joint,x_mm,y_mm,z_mm,extension_deg,right_bending_deg,left_rotation_deg",
    "bodies.csv": "specimen,vertebra,mass_kg,com_x_mm,com_y_mm,com_z_mm,"
    "ixx_kg_m2,iyy_kg_m2,izz_kg_m2,ixy_kg_m2,ixz_kg_m2,iyz_kg_m2",
    "loads.csv": "specimen,test,cycle,step,vertebra,fx_n,fy_n,fz_n,mx_nm,my_nm,mz_nm",
    "motion.csv": "specimen,test,cycle,step,joint,"
    "extension_deg,right_bending_deg,left_rotation_deg,anterior_mm,superior_mm,right_mm",
    "truth.csv": "specimen,joint," + ",".join(STIFFNESS_COLUMNS),
}

COHORT_YAML = """\
cohort: {name}
title: Six made-up T12-S1 specimens in pure moments, whose true stiffness is known
source: >-
  No measurement: made by tests/generators/t12s1_phantom.py, which shares no code with spinepipe.
  Published: donors, peak moment, spread of rotational stiffness and translational stiffness
  (Gould et al. 2024, Front. Bioeng. Biotechnol., doi 10.3389/fbioe.2024.1372088, Tables 1-3);
  vertebral dimensions (Panjabi et al. 1991, 1992; Zindrick et al. 1987), disc heights (Shukri
  et al. 2013, doi 10.17656/jsmc.10028), lordosis (doi 10.1038/s41598-022-21840-x, Table 2).
  Assumed: masses with adjacent soft tissue, 1 kg pot on T12, asymmetry, differences between
  levels, coupled moments. True joint law: {law}; seed {seed}; joint centres stated {centres}.
  Normal noise on every reading before zeroing: {rotation_sd} deg, {translation_sd} mm. truth.csv
  holds the true stiffness; no study reads it.
  Reasons and limits are in docs/decisions/0006-t12s1-phantom.md.
made_up: true
vertebrae: [{vertebrae}]
gravity: true
zeroed_at_step_0: {zeroed}
measurement_sd:
  rotation_deg: {rotation_sd}
  translation_mm: {translation_sd}
"""


def write(phantom: Phantom, folder: str | Path) -> None:
    """Write cohort.yaml, the CSV files and truth.csv into a folder, which is made if need be.

    With a frame error the folder has joints.csv and no landmarks.csv: landmarks cannot state wrong
    centres and true orientations, and true ones would give the truth away.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "cohort.yaml").write_text(_yaml(phantom, folder.resolve().name), encoding="utf-8")
    left_out = "landmarks.csv" if phantom.frame_error_mm else "joints.csv"
    for name, rows in ROWS.items():
        if name != left_out:
            _write_csv(folder / name, rows(phantom))


def _yaml(phantom, name):
    error = phantom.frame_error_mm
    return COHORT_YAML.format(
        name=name,
        law=f"{phantom.law}, joints bridged" if phantom.bridged else phantom.law,
        seed=phantom.seed,
        centres=f"with an SD of {error:g} mm per axis" if error else "truly",
        vertebrae=", ".join(VERTEBRAE),
        zeroed=str(phantom.zeroed).lower(),
        rotation_sd=measure.ROTATION_SD_DEG,
        translation_sd=measure.TRANSLATION_SD_MM,
    )


def _write_csv(path, rows):
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(HEADERS[path.name].split(","))
        writer.writerows(rows)


def _specimens(phantom):
    for donor in DONORS:
        yield [donor.name, donor.sex, donor.age_years, donor.height_m, donor.mass_kg]


def _landmarks(phantom):
    for donor, specimen in zip(DONORS, phantom.specimens, strict=True):
        for vertebra, marks in specimen.landmarks_mm.items():
            for name, point in marks.items():
                yield [donor.name, vertebra, name, *_fixed(point, 6), LANDMARK_SD_MM]


def _joints(phantom):
    for index, (donor, specimen) in enumerate(zip(DONORS, phantom.specimens, strict=True)):
        angles = Rotation.from_matrix(specimen.rotations).as_euler("ZXY", degrees=True)
        for joint, origin, zxy in zip(JOINTS, phantom.stated_origins[index], angles, strict=True):
            yield [donor.name, joint, *_fixed(1000.0 * origin, 6), *_fixed(zxy, 10)]


def _bodies(phantom):
    for donor, specimen in zip(DONORS, phantom.specimens, strict=True):
        bodies = (specimen.masses, specimen.centres, specimen.inertias)
        for name, mass, centre, inertia in zip(VERTEBRAE[1:], *bodies, strict=True):
            six = [*np.diag(inertia), inertia[0, 1], inertia[0, 2], inertia[1, 2]]
            cells = [f"{cell:.6e}" for cell in six]
            yield [donor.name, name, f"{mass:.6f}", *_fixed(1000.0 * centre, 6), *cells]


def _loads(phantom):
    for number, test, cycle, step in np.ndindex(phantom.moments.shape[:-1]):
        key = _key(number, test, cycle, step)
        moment = phantom.moments[number, test, cycle, step]
        yield [*key, TOP, 0, 0, 0, *_fixed(moment, 6)]


def _motion(phantom):
    for number, test, cycle, step, joint in np.ndindex(phantom.measured.shape[:-1]):
        key = _key(number, test, cycle, step)
        reading = phantom.measured[number, test, cycle, step, joint]
        yield [*key, JOINTS[joint], *_fixed(np.roll(reading, 3), 4)]


def _truth(phantom):
    for number, joint in np.ndindex(phantom.stiffness.shape[:-1]):
        values = _fixed(phantom.stiffness[number, joint], 4)
        yield [DONORS[number].name, JOINTS[joint], *values]


def _key(number, test, cycle, step):
    return [DONORS[number].name, list(loads.TESTS)[test], cycle + 1, step]


def _fixed(values, digits):
    """Cells with so many decimals, without negative zero."""
    return [f"{value:.{digits}f}" for value in np.round(values, digits) + 0.0]


ROWS = {
    "specimens.csv": _specimens,
    "landmarks.csv": _landmarks,
    "joints.csv": _joints,
    "bodies.csv": _bodies,
    "loads.csv": _loads,
    "motion.csv": _motion,
    "truth.csv": _truth,
}
