"""Every malformed cohort is refused with file, row, column and a sentence that helps.

Catches a malformed cohort that is accepted, or a message that names another place.
"""

from pathlib import Path

import pytest
from cohort_cases import (
    NAME,
    Case,
    add,
    both,
    cell,
    joints,
    landmarks,
    line,
    swap,
    text,
    without,
    write,
)
from sweeps import sweep

from spinepipe import cohort
from spinepipe.problems import InputError, InputProblem

YAML, SPECIMENS, LANDMARKS = "cohort.yaml", "specimens.csv", "landmarks.csv"
JOINTS, BODIES, LOADS, MOTION = "joints.csv", "bodies.csv", "loads.csv", "motion.csv"

MANY = "vertebrae: [S1, L5, L4, L3, L2, " + ", ".join(f"V{i}" for i in range(17)) + "]"
IXX, COM_X = "ixx_kg_m2", "com_x_mm"
BODIES_HEADER = "specimen,vertebra,mass_kg,com_x_mm,com_y_mm,com_z_mm\n"
L3_OF_A = "a,L3,0.06,0,23,0"
UTF16 = landmarks().encode("utf-16")


def loads(*keys: str) -> str:
    """Rows of loads.csv with nothing but their keys: specimen, test, cycle, step."""
    header = "specimen,test,cycle,step,vertebra,fx_n,fy_n,fz_n,mx_nm,my_nm,mz_nm\n"
    return header + "".join(f"{key},L2,0,0,0,0,0,0\n" for key in keys)


def metres(content: str) -> str:
    """Landmarks whose millimetre columns hold metres."""
    header, *rows = content.splitlines()
    for index, row in enumerate(rows):
        cells = row.split(",")
        rows[index] = ",".join([*cells[:3], *(str(float(c) / 1000) for c in cells[3:6]), cells[6]])
    return "\n".join([header, *rows]) + "\n"


# One fault a line, however long: this is a table to look things up in.
# fmt: off
COHORT_YAML_CASES = [
    Case("no cohort.yaml", without(YAML), YAML, None, None, "no such file"),
    Case("empty", text(YAML, ""), YAML, None, None, "an empty file"),
    Case("no keys", text(YAML, "- a\n"), YAML, None, None, "no keys"),
    Case("broken YAML", swap(YAML, "[L4, L3, L2]", "[L4, L3"), YAML, 4, None, "no YAML"),
    Case("repeated key", add(YAML, "gravity: false"), YAML, 10, "gravity", "twice"),
    Case("nested twice", add(YAML, "  rotation_deg: 1"), YAML, 10, "measurement_sd.rotation_deg", "twice"),
    Case("unknown key", add(YAML, "gravty: 1"), YAML, 10, "gravty", "did you mean 'gravity'"),
    Case("missing key", line(YAML, 5, None), YAML, None, "gravity", "add `gravity:`"),
    Case("wrong type", line(YAML, 5, "gravity: 9.81"), YAML, 5, "gravity", "9.81"),
    Case("other name", line(YAML, 1, "cohort: big"), YAML, 1, "cohort", "the folder's name, 'small'"),
    Case("bad name", line(YAML, 1, "cohort: Small!"), YAML, 1, "cohort", "a name of a-z, 0-9, _", 2),
    Case("no title", line(YAML, 2, "title: ''"), YAML, 2, "title", "at least 1 character"),
    Case("SD of zero", swap(YAML, "deg: 0.1", "deg: 0"), YAML, 8, "measurement_sd.rotation_deg", "greater than 0"),
    Case("half an SD", line(YAML, 9, None), YAML, 7, "measurement_sd.translation_mm", "missing"),
    Case("number as vertebra", swap(YAML, "L4, L3", "4, L3"), YAML, 4, "vertebrae.0", "string"),
    Case("too many joints", line(YAML, 4, MANY), YAML, 4, "vertebrae", "21 joints; allowed: at most 20"),
    Case("one vertebra", line(YAML, 4, "vertebrae: [L4]"), YAML, 4, "vertebrae", "1 vertebra; allowed: at least 2"),
    Case("vertebra twice", line(YAML, 4, "vertebrae: [L4, L3, L3, L2]"), YAML, 4, "vertebrae", "'L3' twice"),
    Case("cranial first", line(YAML, 4, "vertebrae: [L2, L3, L4]"), YAML, 4, "vertebrae", "turn the list round", 2),
]

FILE_CASES = [
    Case("no specimens", without(SPECIMENS), SPECIMENS, None, None, "no such file"),
    Case("empty file", text(LOADS, ""), LOADS, None, None, "an empty file"),
    Case("only a header", text(BODIES, BODIES_HEADER), BODIES, 1, None, "a header and no rows"),
    Case("no rows", text(SPECIMENS, "specimen\n"), SPECIMENS, 1, None, "no rows"),
    Case("Latin-1", text(SPECIMENS, "specimen,note\na,\nb,M\xfcller\n".encode("latin-1")), SPECIMENS, 3, None, "UTF-8"),
    Case("UTF-16", text(LANDMARKS, UTF16), LANDMARKS, 1, None, "UTF-8"),
    Case("semicolons", text(SPECIMENS, "specimen;sex\na;\nb;\n"), SPECIMENS, 1, None, "semicolons"),
    Case("stray quote", swap(SPECIMENS, "CT 2", '"CT 2'), SPECIMENS, 3, None, "stray quote"),
    Case("column twice", swap(LANDMARKS, "y_mm", "x_mm"), LANDMARKS, 1, "x_mm", "same column name twice"),
    Case("nameless column", swap(SPECIMENS, "scanner", ""), SPECIMENS, 1, None, "without a name"),
    Case("unknown column", swap(LANDMARKS, "sd_mm", "sd_m"), LANDMARKS, 1, "sd_m", "did you mean 'sd_mm'"),
    Case("missing column", swap(LOADS, "mz_nm,", "mz,"), LOADS, 1, "mz_nm", "add the column", 2),
    Case("too many cells", line(LANDMARKS, 3, "a,L4,inferior_endplate_centre,0,-26,0,1,5"), LANDMARKS, 3, None, "decimal comma"),
    Case("too few cells", line(MOTION, 4, "a,flexion,1,L3L4,-1,0.1"), MOTION, 4, None, "6 cells; allowed: 7"),
]

CELL_CASES = [
    Case("text for a number", cell(LANDMARKS, 4, "x_mm", "abc"), LANDMARKS, 4, "x_mm", "'abc'"),
    Case("decimal comma", cell(LANDMARKS, 4, "x_mm", '"-20,5"'), LANDMARKS, 4, "x_mm", "write a decimal point"),
    Case("NaN", cell(LANDMARKS, 4, "z_mm", "nan"), LANDMARKS, 4, "z_mm", "finite number"),
    Case("infinity", cell(MOTION, 5, "extension_deg", "inf"), MOTION, 5, "extension_deg", "finite"),
    Case("overflow", cell(LOADS, 3, "fy_n", "1e999"), LOADS, 3, "fy_n", "finite"),
    Case("thousands mark", cell(LOADS, 3, "fy_n", "-1_000"), LOADS, 3, "fy_n", "'-1_000'"),
    Case("unit in the cell", cell(BODIES, 2, "mass_kg", "60 g"), BODIES, 2, "mass_kg", "'60 g'"),
    Case("empty required", cell(LANDMARKS, 4, "y_mm", ""), LANDMARKS, 4, "y_mm", "an empty cell"),
    Case("empty name", cell(MOTION, 7, "joint", ""), MOTION, 7, "joint", "an empty cell", 1),
    Case("broken step", cell(LOADS, 3, "step", "0.5"), LOADS, 3, "step", "a whole number"),
    Case("negative step", cell(MOTION, 2, "step", "-1"), MOTION, 2, "step", "at least 0"),
    Case("cycle 0", text(LOADS, loads("*,flexion,,0", "*,flexion,,1", "*,flexion,0,2")), LOADS, 4, "cycle", "at least 1"),
    Case("negative SD", cell(LANDMARKS, 2, "sd_mm", "-1"), LANDMARKS, 2, "sd_mm", "at least 0"),
    Case("height in cm", cell(SPECIMENS, 2, "height_m", "162"), SPECIMENS, 2, "height_m", "at most 2.8"),
    Case("moment in N mm", cell(LOADS, 4, "mz_nm", "-7500"), LOADS, 4, "mz_nm", "at most 500"),
    Case("turned over", cell(MOTION, 6, "extension_deg", "-90"), MOTION, 6, "extension_deg", "above -90 and below 90"),
    Case("massless", cell(BODIES, 3, "mass_kg", "0"), BODIES, 3, "mass_kg", "above 0"),
    Case("negative mass", cell(BODIES, 3, "mass_kg", "-0.06"), BODIES, 3, "mass_kg", "above 0"),
]

NAME_CASES = [
    Case("unknown specimen", cell(MOTION, 2, "specimen", "c"), MOTION, 2, "specimen", "unknown specimen 'c'", 2),
    Case("wildcard misplaced", cell(BODIES, 3, "specimen", "*"), BODIES, 3, "specimen", "unknown specimen '*'", 2),
    Case("no folder name", add(SPECIMENS, "b/2,,,,,"), SPECIMENS, 4, "specimen", "letter or digit first", 5),
    Case("no letter of a folder", add(SPECIMENS, "Müller,,,,,"), SPECIMENS, 4, "specimen", "'ü' (latin small letter u with diaeresis); allowed: at most 60 letters A-Z a-z", 5),
    Case("unknown vertebra", add(LANDMARKS, "a,L9,tip,0,0,0,1"), LANDMARKS, 26, "vertebra", "unknown vertebra 'L9'"),
    Case("joint upside down", cell(MOTION, 7, "joint", "L3L2"), MOTION, 7, "joint", "upper vertebra first: 'L2L3'", 2),
    Case("specimen twice", add(SPECIMENS, "a,,,,,"), SPECIMENS, 4, None, "the other is line 2"),
    Case("landmark twice", add(LANDMARKS, "a,L4,left_pedicle_base,-20,-8,-15,1"), LANDMARKS, 26, None, "one row per"),
    Case("motion twice", add(MOTION, "b,flexion,2,L2L3,1,1,1"), MOTION, 14, None, "the other is line 13"),
    Case("body twice", add(BODIES, "b,L2,1,0,59,0,,,,,,"), BODIES, 6, None, "the other is line 5"),
]

BODY_CASES = [
    Case("half an inertia", cell(BODIES, 2, "ixz_kg_m2", ""), BODIES, 2, "ixz_kg_m2", "all six or none"),
    Case("negative moment", line(BODIES, 2, f"{L3_OF_A},2e-5,3e-5,2e-5,5e-5,0,0"), BODIES, 2, IXX, "no negative principal"),
    Case("flatter than flat", line(BODIES, 2, f"{L3_OF_A},2e-5,9e-5,2e-5,0,0,0"), BODIES, 2, IXX, "sum of the other two"),
    Case("inertia in kg mm2", line(BODIES, 2, f"{L3_OF_A},20,30,20,0,0,0"), BODIES, 2, IXX, "radius of gyration"),
    Case("weight without bodies", without(BODIES), BODIES, None, None, "gravity: false"),
    Case("body missing", line(BODIES, 5, None), BODIES, None, None, "specimen 'b', vertebra 'L2'"),
    Case("centre in metres", both(cell(BODIES, 2, "com_y_mm", "0.023"), cell(BODIES, 3, "com_y_mm", "0.059")), BODIES, 3, COM_X, "0.036 mm apart"),
]

GEOMETRY_CASES = [
    Case("no geometry", without(LANDMARKS), "", None, None, "neither landmarks.csv nor joints.csv"),
    Case("no endplate", line(LANDMARKS, 11, None), LANDMARKS, 10, None, "L2L3 of specimen 'a': the upper vertebra has no inferior_endplate_centre"),
    Case("no pedicles", both(line(LANDMARKS, 12, None), line(LANDMARKS, 8, None)), LANDMARKS, 9, None, "L2L3 of specimen 'a': neither vertebra"),
    Case("coincident", cell(LANDMARKS, 4, "z_mm", "15"), LANDMARKS, 6, None, "coincide"),
    Case("collinear", both(line(LANDMARKS, 12, "a,L2,left_pedicle_base,0,50,0,1"), line(LANDMARKS, 13, "a,L2,right_pedicle_base,0,60,0,1")), LANDMARKS, 10, "x_mm", "parallel"),
    Case("sides exchanged", both(cell(LANDMARKS, 4, "z_mm", "15"), cell(LANDMARKS, 5, "z_mm", "-15"), cell(LANDMARKS, 8, "z_mm", "15"), cell(LANDMARKS, 9, "z_mm", "-15")), LANDMARKS, 6, None, "exchanged", 1),
    Case("metres", text(LANDMARKS, metres(landmarks())), LANDMARKS, 6, "x_mm", "0.01 mm apart", 4),
    Case("far away", cell(LANDMARKS, 11, "x_mm", "1100"), LANDMARKS, 10, "x_mm", "0.1 mm to 1000 mm"),
    Case("no pose", both(without(LANDMARKS), text(JOINTS, joints().replace("b,L2L3,0,41,0,4,0,0\n", ""))), JOINTS, None, "joint", "L2L3 of specimen 'b'"),
    Case("joint turned over", both(text(JOINTS, joints()), cell(JOINTS, 2, "extension_deg", "90")), JOINTS, 2, "extension_deg", "below 90"),
    Case("origins coincide", both(text(JOINTS, joints()), cell(JOINTS, 3, "y_mm", "5")), JOINTS, 3, "x_mm", "origins of L3L4 and L2L3"),
]

LOAD_CASES = [
    Case("fixed vertebra", cell(LOADS, 3, "vertebra", "L4"), LOADS, 3, "vertebra", "fixed to ground"),
    Case("half a point", cell(LOADS, 3, "py_mm", ""), LOADS, 3, "py_mm", "all of px, py, pz or none"),
    Case("no centre of mass", both(line(LOADS, 3, "*,flexion,1,L2,0,-50,0,0,0,-1,,,,1"), without(BODIES), swap(YAML, "gravity: true", "gravity: false")), LOADS, 3, "px_mm", "vertebra without a body", 2),
    Case("load twice", add(LOADS, "*,flexion,2,L2,0,0,0,0,0,0,,,,2"), LOADS, 5, None, "the other is line 4"),
    Case("load and wildcard", add(LOADS, "b,flexion,2,L2,0,0,0,0,0,0,,,,"), LOADS, 5, None, "* and empty mean all"),
    Case("step gap", line(LOADS, 3, None), LOADS, 3, "step", "step 2 after step 0", 3),
    Case("no step 0", line(LOADS, 2, None), LOADS, 2, "step", "step 1 first", 3),
    Case("gap in motion", both(line(MOTION, 5, None), line(MOTION, 4, None)), MOTION, 4, "step", "step 2 after step 0", 2),
    Case("time stands still", cell(LOADS, 4, "time_s", "1"), LOADS, 4, "time_s", "times that increase"),
    Case("two times at a step", add(LOADS, "*,flexion,2,L3,0,0,0,0,0,0,,,,2.5"), LOADS, 5, "time_s", "one time per step"),
    Case("time missing", cell(LOADS, 3, "time_s", ""), LOADS, 3, "time_s", "in every row of a test"),
    Case("test without load", add(MOTION, "a,flexon,0,L3L4,1,1,1"), MOTION, 14, "test", "did you mean 'flexion'"),
    Case("step without load", add(MOTION, "a,flexion,3,L3L4,1,1,1"), MOTION, 14, "step", "step '3' of specimen 'a'"),
    Case("specimen without load", text(LOADS, loads("a,flexion,,0", "a,flexion,,1", "a,flexion,,2")), MOTION, 8, "test", "specimen 'b', which has no load"),
    Case("motion without loads", without(LOADS), MOTION, None, None, "motion without loads"),
]

# fmt: on

CASES = [
    *COHORT_YAML_CASES,
    *FILE_CASES,
    *CELL_CASES,
    *NAME_CASES,
    *BODY_CASES,
    *GEOMETRY_CASES,
    *LOAD_CASES,
]


def problems_of(folder: Path) -> tuple[InputProblem, ...]:
    """What reading the folder complains about."""
    with pytest.raises(InputError) as caught:
        cohort.read(folder)
    return caught.value.problems


@sweep("case", CASES, lambda case: case.about.replace(" ", "-"))
def test_fault_is_located_and_explained(case: Case, tmp_path: Path) -> None:
    problems = problems_of(write(tmp_path / NAME, case.change))
    listing = "\n".join(map(str, problems))
    file = f"{NAME}/{case.file}" if case.file else NAME
    here = [p for p in problems if (p.file, p.row, p.column) == (file, case.row, case.column)]
    assert any(case.says in str(problem) for problem in here), listing
    assert len(problems) == case.count, listing


def test_every_problem_of_every_file_comes_in_one_error(tmp_path: Path) -> None:
    folder = write(
        tmp_path / NAME,
        add(YAML, "colour: red"),
        cell(SPECIMENS, 2, "age_years", "old"),
        cell(LANDMARKS, 2, "sd_mm", "-1"),
        cell(BODIES, 2, "mass_kg", "-1"),
        cell(LOADS, 3, "vertebra", "L4"),
        cell(MOTION, 3, "extension_deg", "120"),
        cell(MOTION, 9, "anterior_mm", "x"),
    )
    with pytest.raises(InputError) as caught:
        cohort.read(folder)
    problems = caught.value.problems
    assert [problem.file.partition("/")[2] for problem in problems] == [
        YAML,
        SPECIMENS,
        LANDMARKS,
        BODIES,
        MOTION,
        MOTION,
        LOADS,
    ]
    text_ = str(caught.value)
    assert text_.startswith("7 problems in the input:")
    assert len(text_.splitlines()) == 8


def test_absent_folder_is_named(tmp_path: Path) -> None:
    (problem,) = problems_of(tmp_path / "nowhere")
    assert "nowhere" in problem.file
    assert problem.found == "no such folder"
