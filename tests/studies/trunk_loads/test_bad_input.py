"""Whatever is wrong with subjects, tasks and muscles is told with file, row, found and remedy."""

import re
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from cohort_cases import Change, Files, add, both, cell, line, swap, text, without
from installed import need_male

from spinepipe import cohort as cohorts
from spinepipe.documents.form import InputColumn, TableForm
from spinepipe.documents.yaml_text import YamlDocument
from spinepipe.muscles import myo_sim
from spinepipe.muscles.trunk import LEVELS
from spinepipe.problems import InputError, InputProblem
from spinepipe.studies.subjects import SUBJECTS
from spinepipe.studies.trunk_loads.checks import check_source, check_trunk, muscle_problems
from spinepipe.studies.trunk_loads.forms import GEOMETRY_FORMS, TASKS
from spinepipe.studies.trunk_loads.settings import TrunkLoads

YAML, SUBJECT, TASK = "cohort.yaml", "subjects.csv", "tasks.csv"
POINTS, MUSCLES, SCALING = "muscles.csv", "muscle_parameters.csv", "muscle_regressions.csv"
NAME = "small"
DOCUMENT = YamlDocument("s.yaml", {}, {})

TASK_HEADER = (
    "task,number,counted_from,trunk_extension_deg,trunk_right_bending_deg,pelvis_extension_deg,"
    "pelvis_right_bending_deg,T11_extension_deg,T12_extension_deg,L1_extension_deg,"
    "L2_extension_deg,L3_extension_deg,L4_extension_deg,L5_extension_deg,S1_extension_deg,"
    "hand_load_kg,hands_anterior_mm,hands_superior_mm,hands_right_mm,holding,push_anterior_n,"
    "push_extension_nm,applied_at,applied_as,intra_abdominal_pressure_kpa,largest_stress_mpa,tone,"
    "tone_percent"
)

VALID: Files = {
    YAML: "cohort: small\ntitle: two persons\nsource: written for the tests\n"
    "vertebrae: [S1, L5, L4, L3, L2, L1, T12, T11]\ngravity: false\n",
    "specimens.csv": "specimen\na\nb\n",
    SUBJECT: "specimen,sex,age_years,height_cm,mass_kg\na,male,45,173.9,72\nb,female,45,163,60\n",
    TASK: f"{TASK_HEADER}\n"
    "standing,1,,0,,,,,,,,,,,,,,,,,,,,,,,,\n"
    "bend,4,,-50,,,,,,,,,,,,,,,,,,,,,,,,\n"
    "lift,3,source,-2,,4.9,,-2,4,10.9,15.8,14.5,9.9,4.9,4.9,19.8,580,300,0,both,,,,,,1.0,stated,2\n"
    "pull,10,source,9,,16,,,,,,,,,,,,,,,,-242,T8,force,10,1.0,,\n",
    POINTS: "muscle,point,body,x_mm,y_mm,z_mm\n"
    "LD_r,1,S1,-60,0,40\nLD_r,2,T7,-50,300,10\n"
    "LD_l,1,S1,-60,0,-40\nLD_l,2,T7,-50,300,-10\n"
    "LTpT_T12_l,1,S1,-50,0,-20\nLTpT_T12_l,2,T12,-50,200,-30\n",
    MUSCLES: "muscle,group,side,pcsa_mm2,max_isometric_force_n\n"
    "LD_r,latissimus,right,100,\nLD_l,latissimus,left,100,\nLTpT_T12_l,longissimus,left,,60\n",
    SCALING: "muscle,level,factor\nlatissimus,L3L4,1.0\nlongissimus,T12,1.1\n",
}
"""Two persons, four tasks, three muscles; tasks begin in line 2."""


def _key(name: str) -> InputColumn:
    return InputColumn(name, "text", name, key=True)


FORMS = (
    *(SUBJECTS, TASKS, *GEOMETRY_FORMS),
    TableForm(
        "muscle_regressions",
        "muscle x level",
        (_key("muscle"), _key("level"), InputColumn("factor", "number", "factor", nullable=True)),
    ),
)
"""The last stands for any table with levels, whatever else its columns be."""


MALE_STRESS_MPA = 1.0
"""Force over cross-section; what it is does not count here, only that it is given."""


def told(folder: Path, *changes: Change, **asked: object) -> list[InputProblem]:
    """What is said of the cohort, changed, by the reader or else by the checks of the kind."""
    try:
        cohort = small(folder, *changes)
    except InputError as error:
        return list(error.problems)
    return list(check_trunk(DOCUMENT, study(**asked), cohort))


def small(folder: Path, *changes: Change) -> cohorts.Cohort:
    """The small cohort, changed, where it can be read."""
    files = dict(VALID)
    for change in changes:
        change(files)
    (folder / NAME).mkdir()
    for name, content in files.items():
        assert isinstance(content, str)
        (folder / NAME / name).write_text(content)
    return cohorts.read(folder / NAME, FORMS)


def study(**asked: object) -> TrunkLoads:
    """A study of the small cohort."""
    return TrunkLoads.model_validate({"study": "s", "kind": "trunk_loads", "cohort": NAME, **asked})


@dataclass(frozen=True)
class Case:
    """One fault, where it is told, what of it, and a piece of the remedy."""

    about: str
    change: Change
    file: str
    row: int | None
    column: str | None
    found: str
    remedy: str


def task(column: str, new: str, row: int = 2) -> Change:
    """One cell of tasks."""
    return cell(TASK, row, column, new)


def person(column: str, new: str) -> Change:
    """One cell of the first subject."""
    return cell(SUBJECT, 2, column, new)


def hands(*mm: str) -> Change:
    """Where the hands of the task bend are."""
    names = ("hands_anterior_mm", "hands_superior_mm", "hands_right_mm")
    return both(*(task(name, new, 3) for name, new in zip(names, mm, strict=True)))


STRESS, PRESSURE = "largest_stress_mpa", "intra_abdominal_pressure_kpa"
TRUNK, PELVIS = "trunk_extension_deg", "pelvis_extension_deg"
BENT, PELVIS_BENT = "trunk_right_bending_deg", "pelvis_right_bending_deg"
STANDING_AGAIN = "upright,1,,0,,,,,,,,,,,,,,,,,,,,,,,,"
HEADER = "muscle,point,body,x_mm,y_mm,z_mm\n"
MIRRORED = both(
    swap(
        POINTS, "-50,0,-20\nLTpT_T12_l,2,T12,-50,200,-30", "-50,0,20\nLTpT_T12_l,2,T12,-50,200,30"
    ),
    swap(POINTS, "-60,0,-40\nLD_l,2,T7,-50,300,-10", "-60,0,40\nLD_l,2,T7,-50,300,10"),
)
ONE_MIRRORED = swap(
    POINTS, "-50,0,-20\nLTpT_T12_l,2,T12,-50,200,-30", "-50,0,20\nLTpT_T12_l,2,T12,-50,200,30"
)
ALL_MIRRORED = text(
    POINTS,
    f"{HEADER}LD_r,1,S1,0,0,-4\nLD_r,2,T7,0,0,-1\nLD_l,1,S1,0,0,4\nLD_l,2,T7,0,0,1\n"
    "LTpT_T12_l,1,S1,0,0,2\nLTpT_T12_l,2,T12,0,0,3\n",
)
FRAMES = "body_frames.csv"
IN_FRAMES = text(
    FRAMES,
    "specimen,body,carried_by,x_mm,y_mm,z_mm,extension_deg,right_bending_deg,left_rotation_deg\n"
    "a,S1,S1,0,0,0,0,0,0\na,T7,T7,0,0,0,0,0,0\na,T12,T12,0,200,0,0,0,0\n",
)
"""The bodies of the muscles, where points are told in their frames."""


def framed(*changes: Change) -> Change:
    """With frames, changed."""
    return both(IN_FRAMES, *changes)


# One fault a line, however long: this is a table to look things up in.
# fmt: off
SUBJECT_CASES = [
    Case("height in m", person("height_cm", "1.74"), SUBJECT, 2, "height_cm", "a is 1.74 cm tall", "in m? write 174"),
    Case("height in mm", person("height_cm", "1739"), SUBJECT, 2, "height_cm", "1739 cm", "in mm? write 173.9"),
    Case("weight in N", person("mass_kg", "706"), SUBJECT, 2, "mass_kg", "a weighs 706 kg", "weight in N? write 72.0"),
    Case("BMI 12", person("mass_kg", "36.3"), SUBJECT, 2, "mass_kg", "BMI of 12.0", "correct height or mass"),
    Case("BMI 60", person("mass_kg", "181.4"), SUBJECT, 2, "mass_kg", "BMI of 60.0", "correct height or mass"),
    Case("unknown sex", person("sex", "Femal"), SUBJECT, 2, "sex", "'Femal'", "did you mean 'female'"),
    Case("sex by letter", person("sex", "m"), SUBJECT, 2, "sex", "'m'", "did you mean 'male'"),
    Case("subject missing", line(SUBJECT, 3, None), SUBJECT, None, "specimen", "no row of 'b'", "add sex, age"),
    Case("subject twice", add(SUBJECT, "a,male,45,174,72"), SUBJECT, 4, None, "again a", "the other is line 2"),
    Case("unknown subject", add(SUBJECT, "c,male,45,174,72"), SUBJECT, 4, "specimen", "'c'", "specimens.csv"),
    Case("no tasks", without(TASK), "s.yaml", None, "cohort", "without tasks.csv", "add tasks.csv"),
]

POSTURE_CASES = [
    Case("no posture", task(TRUNK, ""), TASK, 2, None, "task standing: no posture", "0 for upright"),
    Case("flexion positive", task(TRUNK, "50", 3), TASK, 3, TRUNK, "50 backwards", "write -50: extension is positive"),
    Case("backwards, pelvis unknown", task(TRUNK, "20", 3), TASK, 3, PELVIS, "20 deg backwards", "write the pelvis' rotation"),
    Case("farther than measured", task(TRUNK, "-125", 3), TASK, 3, PELVIS, "125 deg forwards", "write the pelvis' rotation"),
    Case("pelvis alone", task(PELVIS_BENT, "2", 3), TASK, 3, BENT, "nothing is said of the trunk", "0 where it stays"),
    Case("a body left out", task("L3_extension_deg", "", 4), TASK, 4, "L3_extension_deg", "no rotation of L3", "fill or empty"),
    Case("rotations do not sum", task(TRUNK, "-20", 4), TASK, 4, TRUNK, "-20, while the bodies come to -2 at T11", "leave trunk_extension_deg empty"),
    Case("another pelvis", task(PELVIS, "9", 4), TASK, 4, PELVIS, "9, while the bodies come to 4.9 at S1", "correct the rotations"),
    Case("another origin", task("counted_from", "uprigth"), TASK, 2, "counted_from", "'uprigth'", "did you mean 'upright'"),
    Case("number 13", task("number", "13"), TASK, 2, "number", "'13'", "correct it"),
    Case("task twice", add(TASK, VALID[TASK].splitlines()[1]), TASK, 6, None, "again standing", "the other is line 2"),
    Case("same under another name", add(TASK, STANDING_AGAIN), TASK, 6, None, "task upright: the same as task standing", "delete or correct one"),
    Case("name of no file", task("task", "stand/ing"), TASK, 2, "task", "stand/ing", "rename"),
]

HANDS_CASES = [
    Case("load in N", task("hand_load_kg", "194", 4), TASK, 4, "hand_load_kg", "194 kg", "in N? write 19.8"),
    Case("hands in m", hands("0.37", "0.3", "0"), TASK, 3, "hands_anterior_mm", "0.37 mm from L5S1", "in m? multiply by 1000"),
    Case("half a place", hands("370", "", "0"), TASK, 3, "hands_superior_mm", "no hands_superior_mm", "hands hang"),
    Case("out of reach", task("hands_anterior_mm", "1200", 4), TASK, 4, "hands_anterior_mm", "of the tallest, 1.739 m", "centre of L5S1"),
    Case("third hand", task("holding", "rigth", 4), TASK, 4, "holding", "'rigth'", "did you mean 'right'"),
]

EXERTION_CASES = [
    Case("unknown vertebra", task("applied_at", "T13", 5), TASK, 5, "applied_at", "unknown vertebra 'T13'", "did you mean"),
    Case("pushed in the loins", task("applied_at", "L3", 5), TASK, 5, "applied_at", "unknown vertebra 'L3'", "thorax"),
    Case("pushed nowhere", task("applied_at", "", 5), TASK, 5, "applied_at", "push_extension_nm and no vertebra", "write the vertebra"),
    Case("force without moment", both(task("push_extension_nm", "", 5), task("push_anterior_n", "50", 5)), TASK, 5, "applied_as", "no moment", "write the moment"),
    Case("negative pressure", task(PRESSURE, "-10", 5), TASK, 5, PRESSURE, "'-10'", "check its unit, its sign"),
    Case("pressure in Pa", task(PRESSURE, "10000", 5), TASK, 5, PRESSURE, "'10000'", "check its unit"),
    Case("stress in N/cm2", task(STRESS, "60", 5), TASK, 5, STRESS, "60 MPa", "in N/cm2? write 0.6"),
    Case("no stress", task(STRESS, "0", 5), TASK, 5, STRESS, "0 MPa", "leave it empty for 0.6"),
    Case("percentage without tone", task("tone_percent", "5"), TASK, 2, "tone_percent", "5 % and tone none", "write stated"),
    Case("tone without percentage", task("tone_percent", "", 4), TASK, 4, "tone_percent", "no percentage", "write the least"),
    Case("unknown tone", task("tone", "stabel"), TASK, 2, "tone", "'stabel'", "did you mean 'stable'"),
]

MUSCLE_CASES = [
    Case("one point", line(POINTS, 7, None), POINTS, 6, "muscle", "LTpT_T12_l has one point", "add its other end"),
    Case("unknown body", cell(POINTS, 3, "body", "humerus"), POINTS, 3, "body", "unknown body 'humerus'", "belong to T11"),
    Case("a body without a frame", framed(line(FRAMES, 4, None)), POINTS, 7, "body", "unknown body 'T12'", "add its frame"),
    Case("of somebody whose muscles are not taken", framed(add(FRAMES, "b,S1,s1,0,0,0,0,0,0")), FRAMES, 5, "carried_by", "unknown vertebra 's1'", "move with a vertebra"),
    Case("rib on nothing", framed(cell(FRAMES, 4, "carried_by", "sternum")), FRAMES, 4, "carried_by", "unknown vertebra 'sternum'", "move with a vertebra"),
    Case("mirrored twice", MIRRORED, POINTS, 4, "z_mm", "2 of 2 muscles that are left lie on the other side, LD_l", "mirrored twice?"),
    Case("all mirrored", ALL_MIRRORED, POINTS, None, "z_mm", "most muscles on the other side", "change the sign of z"),
    Case("PCSA 0", cell(MUSCLES, 2, "pcsa_mm2", "0"), MUSCLES, 2, "pcsa_mm2", "'0'", "delete the muscle"),
    Case("force 0", cell(MUSCLES, 4, "max_isometric_force_n", "0"), MUSCLES, 4, "max_isometric_force_n", "'0'", "delete the muscle"),
    Case("no size", cell(MUSCLES, 2, "pcsa_mm2", ""), MUSCLES, 2, "pcsa_mm2", "neither of LD_r", "fill one"),
    Case("no side", cell(MUSCLES, 2, "side", "R"), MUSCLES, 2, "side", "'R'", "did you mean 'right'"),
    Case("points alone", line(MUSCLES, 4, None), POINTS, 6, "muscle", "unknown muscle 'LTpT_T12_l'", "add it to muscle_parameters.csv"),
    Case("parameters alone", add(MUSCLES, "psoas_r,psoas,right,100,"), MUSCLES, 5, "muscle", "unknown muscle 'psoas_r'", "add it to muscles.csv"),
    Case("unknown level", cell(SCALING, 2, "level", "L4L3"), SCALING, 2, "level", "unknown level 'L4L3'", "did you mean"),
]
# fmt: on

CASES = [*SUBJECT_CASES, *POSTURE_CASES, *HANDS_CASES, *EXERTION_CASES, *MUSCLE_CASES]


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.about.replace(" ", "-"))
def test_one_fault_is_told_once_with_place_and_remedy(case: Case, tmp_path: Path) -> None:
    problem, *others = told(tmp_path, case.change)
    assert all(other.found == problem.found for other in others)  # a muscle has several points
    file = case.file if case.file == "s.yaml" else f"{NAME}/{case.file}"
    assert (problem.file, problem.row, problem.column) == (file, case.row, case.column)
    assert case.found in problem.found
    assert case.remedy in problem.remedy
    assert problem.allowed


def test_a_sound_cohort_is_not_blamed(tmp_path: Path) -> None:
    assert told(tmp_path) == []


def test_bodies_of_frames_and_the_sheath_are_known(tmp_path: Path) -> None:
    rib = framed(
        cell(FRAMES, 4, "body", "rib12_L"),
        cell(POINTS, 7, "body", "rib12_L"),
        cell(POINTS, 3, "body", "Abdomen"),
        cell(FRAMES, 3, "body", "Abdomen"),
        cell(POINTS, 5, "body", "Abdomen"),
    )
    assert told(tmp_path, rib) == []
    (tmp_path / "unframed").mkdir()
    pelvis = both(cell(POINTS, 2, "body", "pelvis"), cell(POINTS, 3, "body", "Abdomen"))
    assert told(tmp_path / "unframed", pelvis) == []


def test_a_vertebra_in_other_letters_is_none(tmp_path: Path) -> None:
    further = line(FRAMES, 4, "a,t12,T12,0,200,0,0,0,0\na,T12,T12,0,200,0,0,0,0")
    (problem,) = told(tmp_path, framed(further))
    assert (problem.row, problem.column, problem.found) == (4, "body", "unknown body 't12'")
    assert problem.remedy == "write 'T12'"


def test_one_muscle_on_the_other_side_is_left_to_be_mirrored(tmp_path: Path) -> None:
    assert told(tmp_path, ONE_MIRRORED) == []


def test_sides_are_judged_in_ground(tmp_path: Path) -> None:
    """Frames that lie 100 mm to the left: points right of their origins still lie to the left."""
    left = "a,T7,T7,0,0,-100,0,0,0\na,T12,T12,0,0,-100,0,0,0\n"
    moved = swap(FRAMES, "a,T7,T7,0,0,0,0,0,0\na,T12,T12,0,200,0,0,0,0\n", left)
    own = both(
        swap(POINTS, "T7,-50,300,-10", "T7,-50,300,70"),
        swap(POINTS, "T7,-50,300,10", "T7,-50,300,170"),
        swap(POINTS, "T12,-50,200,-30", "T12,-50,200,60"),
    )
    assert told(tmp_path, framed(moved, own)) == []
    (tmp_path / "ground").mkdir()
    (problem,) = told(tmp_path / "ground", own)
    assert "left lie on the other side" in problem.found


def test_muscles_need_not_come_along(tmp_path: Path) -> None:
    assert told(tmp_path, without(POINTS), without(MUSCLES), without(SCALING)) == []


def test_all_faults_are_told_at_once(tmp_path: Path) -> None:
    found = told(
        tmp_path,
        person("height_cm", "1.74"),
        task("hand_load_kg", "194", 4),
        both(cell(POINTS, 2, "body", "T99"), cell(SCALING, 2, "level", "L4L3")),
    )
    files = [problem.file.partition("/")[2] for problem in found]
    assert files == [SUBJECT, TASK, POINTS, SCALING]


def test_all_that_forms_do_not_allow_is_told_at_once(tmp_path: Path) -> None:
    found = told(
        tmp_path,
        person("sex", "man"),
        both(task("holding", "three", 4), task("applied_at", "L3", 4)),
        both(cell(MUSCLES, 2, "pcsa_mm2", "0"), cell(MUSCLES, 3, "side", "up")),
    )
    places = {(p.file.partition("/")[2], p.row, p.column) for p in found}
    assert places == {
        (SUBJECT, 2, "sex"),
        (TASK, 4, "holding"),
        (TASK, 4, "applied_at"),
        (MUSCLES, 2, "pcsa_mm2"),
        (MUSCLES, 3, "side"),
    }


def test_an_impossible_height_leaves_no_judgement_of_reach(tmp_path: Path) -> None:
    far = task("hands_anterior_mm", "1200", 4)
    found = told(tmp_path, far, person("height_cm", "1.74"), cell(SUBJECT, 3, "height_cm", "1.6"))
    assert {problem.column for problem in found} == {"height_cm"}


def test_reach_moves_with_the_trunk(tmp_path: Path) -> None:
    """Hands 900 mm ahead and 200 mm below L5S1 are too far from upright shoulders; bent, not."""
    place = hands("900", "-200", "0")
    assert told(tmp_path, place) == []
    (tmp_path / "upright").mkdir()
    (problem,) = told(tmp_path / "upright", place, task(TRUNK, "0", 3))
    assert problem.column == "hands_anterior_mm"
    # shoulders 0.27 x 1.739 m above L5S1
    beyond = np.hypot(900.0, -200.0 - 270.0 * 1.739) - 900.0
    assert f"hands {beyond:.0f} mm beyond the reach" in problem.found
    assert f"bring them {beyond:.0f} mm nearer" in problem.remedy


def test_hands_too_far_say_which_posture_would_do(tmp_path: Path) -> None:
    place = hands("900", "-200", "0")
    (problem,) = told(tmp_path, place, task(TRUNK, "0", 3))
    (bent,) = re.findall(rf"write {TRUNK} (-\d+), or bring them", problem.remedy)
    for name, angle, fits in (("bent", int(bent), True), ("less", int(bent) + 1, False)):
        (tmp_path / name).mkdir()
        assert (told(tmp_path / name, place, task(TRUNK, str(angle), 3)) == []) == fits
    (tmp_path / "never").mkdir()
    (problem,) = told(tmp_path / "never", hands("1500", "300", "0"), task(TRUNK, "0", 3))
    assert problem.remedy.startswith("bring them"), "no posture would do"


def test_the_last_measured_bend_depends_on_what_the_angle_means(tmp_path: Path) -> None:
    """T11 turns by 113.2 of the 121 deg that the thorax does (Tafazzol 2014)."""
    bend = task(TRUNK, "-120", 3)
    assert told(tmp_path, bend, trunk_angle="rotation_of_t11")
    (tmp_path / "thorax").mkdir()
    assert told(tmp_path / "thorax", bend, trunk_angle="measured_at_thorax") == []


def test_names_in_the_study_are_looked_up(tmp_path: Path) -> None:
    found = told(
        tmp_path,
        drawn_tasks=["bent"],
        uncertain={"specimens": ["c"], "tasks": ["standing"]},
        volunteer={"specimen": "aa"},
    )
    keys = ["drawn_tasks.0", "uncertain.specimens.0", "volunteer.specimen"]
    assert [problem.column for problem in found] == keys
    assert "did you mean 'bend'" in found[0].remedy


def test_geometry_of_the_cohort_must_be_there(tmp_path: Path) -> None:
    found = told(tmp_path, without(POINTS), without(MUSCLES), geometry="cohort")
    assert {problem.column for problem in found} == {"geometry"}
    files = (POINTS, MUSCLES, "joints.csv")
    assert [problem.allowed for problem in found] == [f"a cohort with {file}" for file in files]
    (tmp_path / "joints").mkdir()
    (alone,) = told(tmp_path / "joints", geometry="cohort")
    assert "no joints.csv" in alone.found
    assert "geometry: myo_sim" in alone.remedy


def test_a_table_of_regressions_is_read(tmp_path: Path) -> None:
    (absent,) = told(tmp_path, regressions="mine.csv")
    assert (absent.file, absent.column) == ("s.yaml", "regressions")
    assert "no file of" in absent.found
    (tmp_path / "bad").mkdir()
    bad = told(tmp_path / "bad", text("mine.csv", "sex,age\n"), regressions="mine.csv")
    assert {(problem.file, problem.row) for problem in bad} == {(f"{NAME}/mine.csv", 1)}


@pytest.mark.parametrize("installed", [None, "0.1.0"])
def test_a_package_that_is_not_there_is_named_with_its_remedy(
    installed: str | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cohort = small(tmp_path)

    def distribution(name: str) -> SimpleNamespace:
        if installed is None:
            raise PackageNotFoundError(name)
        return SimpleNamespace(version=installed)

    monkeypatch.setattr(myo_sim, "distribution", distribution)
    (problem,) = check_source(DOCUMENT, study(), cohort, tmp_path)
    assert (problem.file, problem.column) == ("s.yaml", "geometry")
    assert (installed or "not installed") in problem.found
    assert f"myo-sim=={myo_sim.VERSION}" in problem.remedy
    assert myo_sim.VERSION in problem.allowed


def joints(ahead_of_b_mm: int = 0) -> str:
    """Joints of half a spine of both persons, 40 mm apart."""
    header = "specimen,joint,x_mm,y_mm,z_mm,extension_deg,right_bending_deg,left_rotation_deg\n"
    return header + "".join(
        f"{who},{level},{ahead},{40 * k},0,0,0,0\n"
        for who, ahead in (("a", 0), ("b", ahead_of_b_mm))
        for k, level in enumerate(LEVELS)
    )


def test_muscles_that_make_no_trunk_are_refused_at_the_start(tmp_path: Path) -> None:
    """Joints of half a spine: each file is sound, and no trunk comes of them."""
    cohort = small(tmp_path, text("joints.csv", joints()))
    asked = study(geometry="cohort")
    assert list(check_trunk(DOCUMENT, asked, cohort)) == []
    (problem,) = check_source(DOCUMENT, asked, cohort, tmp_path)
    assert "T10T11" in problem.found
    assert NAME in problem.remedy


def test_one_trunk_is_scaled_to_all(tmp_path: Path) -> None:
    moved = text("joints.csv", joints(ahead_of_b_mm=5))
    (problem,) = told(tmp_path, moved, geometry="cohort")
    assert (problem.file, problem.row, problem.column) == (f"{NAME}/joints.csv", 9, "specimen")
    assert "joints of b that are not those of a" in problem.found
    assert "joints of a" in problem.remedy


def test_the_generic_male_is_sound() -> None:
    """Ribs, pelvis, rectus sheath, and one left fascicle that lies right, as published."""
    cohort = cohorts.read(need_male(), FORMS)
    assert list(muscle_problems(cohort)) == []
    asked = study(geometry="cohort", source_stress_mpa=MALE_STRESS_MPA)
    assert list(check_source(DOCUMENT, asked, cohort, cohort.folder)) == []
