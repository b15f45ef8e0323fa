"""Whatever is wrong with tracked persons is told with file, row or marker, found and remedy."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cohort_cases import Change, Files, add, both, cell, line, swap, text, without
from pydantic import ValidationError
from tracked_cohort import NAME, RATE, Motion, Spoil, write

from spinepipe import cohort as cohorts
from spinepipe.documents.yaml_text import YamlDocument
from spinepipe.problems import InputError, InputProblem
from spinepipe.studies.subjects import SUBJECTS
from spinepipe.studies.tracking import examine
from spinepipe.studies.tracking.checks import check_recordings, check_tracking
from spinepipe.studies.tracking.examine import repairs_of, warnings_of
from spinepipe.studies.tracking.persons import person_of
from spinepipe.studies.tracking.settings import Tracking
from spinepipe.studies.tracking.trials import FORMS

DOCUMENT = YamlDocument("s.yaml", {}, {})
TRIALS, MARKERS, PEOPLE = "trials.csv", "marker_set.csv", "subjects.csv"
STANCE, FLEXION, BENDING = 2, 3, 4
"""Lines of the trials."""

PASSIVE = "joint,coordinate,side,a,b,lower,upper,source\n"
RATIOS = "set,joint,coordinate,ratio,source\n"
BOUNDS = "joint,coordinate,low,high,source\n"
TRUTH = (
    "specimen,trial,time_s,vertebra,x_mm,y_mm,z_mm,extension_deg,right_bending_deg,"
    "left_rotation_deg\n"
)


def asked(**settings: object) -> Tracking:
    """A study that asks for approaches that all can be done."""
    plain = {"approaches": ["ik", "ik_constrained_christophy_2012", "optk_from_both"]}
    given = {"study": "s", "kind": "tracking", "cohort": NAME, **plain, **settings}
    return Tracking.model_validate(given, strict=False)


def told(
    folder: Path, *changes: Change, spoilt: tuple[Spoil, ...] = (), **settings: object
) -> list[InputProblem]:
    """What is said by the reader, or else by the checks of tables and of files of motion."""
    try:
        cohort = cohorts.read(write(folder, *changes, spoilt=spoilt), (SUBJECTS, *FORMS))
    except InputError as error:
        return list(error.problems)
    study = asked(**settings)
    return [
        *check_tracking(DOCUMENT, study, cohort),
        *check_recordings(DOCUMENT, study, cohort, folder),
    ]


def test_a_sound_cohort_has_no_problem(tmp_path: Path) -> None:
    assert told(tmp_path) == []


def trial(column: str, new: str, row: int = FLEXION) -> Change:
    return cell(TRIALS, row, column, new)


# about, change, file, row and column where it is told, what of it, and a piece of the remedy
TABLES: list[tuple[str, Change, str, int | None, str | None, str, str]] = [
    ("no trials", without(TRIALS), "s.yaml", None, "cohort", "without trials.csv", "add"),
    ("no set", without(MARKERS), "s.yaml", None, "cohort", "without marker_set.csv", "add"),
    ("nobody", without(PEOPLE), "s.yaml", None, "cohort", "without subjects.csv", "add"),
    (
        "short chain",
        both(
            swap("cohort.yaml", ", T1]", "]"),
            line("joints.csv", 18, None),
            line("bodies.csv", 19, None),
            *(line(MARKERS, 2, None) for _ in range(3)),
        ),
        *("cohort.yaml", None, "vertebrae", "S1 to T2, 17 in all", "list them all"),
    ),
    ("kind", trial("kind", "flexion"), TRIALS, 3, "kind", "'flexion'", "flexion_extension"),
    ("arms", trial("arms", "behind"), TRIALS, 3, "arms", "'behind'", "behind_head"),
    ("static", trial("static", "true"), TRIALS, 3, "static", "'true'", "write one"),
    ("axes", trial("axes", "x z z"), TRIALS, 3, "axes", "x, y and z once", "each axis once"),
    ("left hand", trial("axes", "x z y"), TRIALS, 3, "axes", "makes left of right", "minus"),
    ("file", trial("file", "m.mot"), TRIALS, 3, "file", "'m.mot'", "export"),
    (
        "crop",
        both(trial("start_s", "2"), trial("end_s", "1")),
        *(TRIALS, 3, "start_s", "2 s, and end_s 1 s", "correct"),
    ),
    ("no stance", line(TRIALS, STANCE, None), TRIALS, None, "kind", "no static", "add it"),
    (
        "two statics",
        both(trial("static", "yes", STANCE), trial("static", "yes", FLEXION)),
        *(TRIALS, 3, "static", "a second static trial of 'a'", "one of them"),
    ),
    ("mass", cell(PEOPLE, 2, "mass_kg", "745"), PEOPLE, 2, "mass_kg", "745 kg", "in N?"),
    ("nought", cell(PEOPLE, 2, "mass_kg", "0"), PEOPLE, 2, "mass_kg", "0", ""),
    ("height", cell(PEOPLE, 2, "height_cm", "1.75"), PEOPLE, 2, "height_cm", "1.75", "175"),
    ("no mass", cell("bodies.csv", 5, "mass_kg", "0"), "bodies.csv", 5, "mass_kg", "0", ""),
    (
        "head on T1",
        cell("bodies.csv", 19, "mass_kg", "16"),
        *("bodies.csv", None, "mass_kg", "48.4 kg of 'a' in all, 64%", "correct"),
    ),
    (
        "placeless",
        cell(MARKERS, 2, "vertebra", "C7"),
        *(MARKERS, 2, "vertebra", "unknown vertebra 'C7'", ""),
    ),
    (
        "no pelvis",
        both(*(cell(MARKERS, row, "vertebra", "L5") for row in (24, 25, 26))),
        *(MARKERS, None, "vertebra", "2 markers of 'a' on S1", "add"),
    ),
    (
        "twice",
        add(MARKERS, "a,T1_a,T1,0,0,0,1,"),
        *(MARKERS, 29, None, "", ""),
    ),
    (
        "passive",
        text("passive.csv", f"{PASSIVE}L4L5,extension,positive,1,0.1,0.5,2,mine\n"),
        *("passive.csv", 2, "a", "a b is", "both sides"),
    ),
    (
        "side",
        text("passive.csv", f"{PASSIVE}L4L5,extension,up,1,0.1,0.5,2,mine\n"),
        *("passive.csv", 2, "side", "'up'", "name one"),
    ),
    (
        "ratios",
        text("ratios.csv", f"{RATIOS}own,L4L5,extension,0.5,mine\n"),
        *("ratios.csv", 2, "ratio", "sum to 0.5", "divide"),
    ),
    (
        "bounds",
        text("bounds.csv", f"{BOUNDS}L4L5,extension,0,0,mine\n"),
        *("bounds.csv", 2, "low", "0 to 0", "correct both"),
    ),
    (
        "status",
        text("bounds.csv", BOUNDS.replace("\n", ",status\nL4L5,extension,-5,5,mine,sure\n")),
        *("bounds.csv", 2, "status", "'sure'", "leave it empty"),
    ),
    (
        "truth",
        text("truth_centres.csv", f"{TRUTH}a,bending,0,L4,0,0,0,,,\n"),
        *("truth_centres.csv", 2, "trial", "no trial 'bending' of 'a'", "lateral_bending"),
    ),
    (
        "half a turn",
        text("truth_centres.csv", f"{TRUTH}a,stance,0,L4,0,0,0,1,,\n"),
        *("truth_centres.csv", 2, "right_bending_deg", "no right_bending_deg", "complete"),
    ),
]


@pytest.mark.parametrize("case", TABLES, ids=lambda case: case[0])
def test_faults_of_tables_are_named(case: tuple[Any, ...], tmp_path: Path) -> None:
    _, change, name, row, column, found, remedy = case
    problems = told(tmp_path, change)
    place = (name if name == "s.yaml" else f"{NAME}/{name}", row, column)
    places = [(p.file, p.row, p.column) for p in problems]
    assert place in places, problems
    told_there = problems[places.index(place)]
    assert found in told_there.found
    assert remedy in told_there.remedy


def test_ratios_that_nobody_has_are_refused_unless_the_cohort_has_them(tmp_path: Path) -> None:
    wanted = ["ik_constrained_bruno_2015"]
    (problem,) = told(tmp_path, approaches=wanted)
    assert problem.column == "approaches.0"
    assert "no ratios 'bruno_2015'" in problem.found
    assert f"{NAME}/ratios.csv" in problem.remedy
    rows = "".join(f"bruno_2015,{joint},extension,0.5,mine\n" for joint in ("L4L5", "L5S1"))
    (tmp_path / "own").mkdir()
    assert told(tmp_path / "own", text("ratios.csv", RATIOS + rows), approaches=wanted) == []


@pytest.mark.parametrize("name", ["ik_smoth", "ik_constrained_", "ik_constrained_My-set"])
def test_approaches_that_are_none_are_refused(name: str) -> None:
    with pytest.raises(ValidationError, match="ik_constrained_ and the name of a set") as error:
        asked(approaches=["ik", name])
    assert ("did you mean 'ik_smooth'" in str(error.value)) == (name == "ik_smoth")


def test_approaches_that_learn_from_trials_nobody_did_are_refused(tmp_path: Path) -> None:
    (problem,) = told(tmp_path, line(TRIALS, BENDING, None))
    assert problem.column == "approaches.2"
    assert "no trial of lateral_bending" in problem.found


def on(trial: str, action: object) -> Spoil:
    """Do something to the motion of a trial."""

    def spoil(motions: dict[str, Motion]) -> None:
        assert callable(action)
        action(motions[trial])

    return spoil


def lost(marker: str, begin: int, end: int) -> Spoil:
    """The marker is not seen in these frames, numbers from 1, both included."""
    return on("flexion_extension", lambda m: m.of(marker)[begin - 1 : end].fill(np.nan))


def exchanged(one: str, other: str, begin: int = 0, end: int | None = None) -> Spoil:
    return on("flexion_extension", lambda m: m.exchange(one, other, begin, end))


def mirrored(motion: Motion) -> None:
    """All that is left is called right."""
    for one, other in (("LASI", "RASI"), ("LPSI", "RPSI")):
        motion.exchange(one, other)


def renamed(old: str, new: str) -> Spoil:
    def rename(motion: Motion) -> None:
        motion.names[motion.names.index(old)] = new

    return on("flexion_extension", rename)


def shifted(marker: str, mm: tuple[float, float, float], begin: int, end: int) -> Spoil:
    def shift(motion: Motion) -> None:
        motion.of(marker)[begin - 1 : end] += mm

    return on("flexion_extension", shift)


def swayed(marker: str, mm: float) -> Spoil:
    """The marker goes to and fro, a little in every frame."""

    def sway(motion: Motion) -> None:
        motion.of(marker)[:, 2] += mm * np.sin(np.arange(len(motion.places)))

    return on("flexion_extension", sway)


def held(begin: int, end: int, *markers: str) -> Spoil:
    """The last place is held, as recorders fill gaps; no marker: of all."""

    def hold(motion: Motion) -> None:
        for marker in markers or motion.names:
            motion.of(marker)[begin - 1 : end] = motion.of(marker)[begin - 1]

    return on("flexion_extension", hold)


# about, what is done, the marker that must be named, what is found, and a piece of the remedy
MOTIONS: list[tuple[str, Spoil, str | None, str] | tuple[str, Spoil, str | None, str, str]] = [
    ("gap", lost("T5", 11, 25), "T5", "frames 11 to 25 (0.500 to 1.200 s)", "fill"),
    (
        "frozen",
        held(11, 30, "T5"),
        *("T5", "stands still in frames 11 to 30 (0.500 to 1.450 s), 1.00 s, while", "empty"),
    ),
    ("twice", renamed("T12", "T9"), "T9", "more than one marker of this name", "rename"),
    ("never", lost("T9", 1, 41), "T9", "never in sight", "crop"),
    ("lacking", renamed("T12", "T12x"), "T12", "no such marker", "mean 'T12x'"),
    ("front", exchanged("LASI", "RASI"), "LASI and RASI", "swapped in frames 1 to 41"),
    ("back", exchanged("LPSI", "RPSI"), "LPSI and RPSI", "swapped in frames 1 to 41"),
    (
        "for a while",
        exchanged("LPSI", "RPSI", 9, 20),
        *("LPSI and RPSI", "swapped in frames 10 to 20", "exchange"),
    ),
    (
        "mirrored",
        on("flexion_extension", mirrored),
        *("LASI and RASI", "swapped in frames 1 to 41"),
    ),
    ("cluster", exchanged("T7_b", "T7_c"), "T7_b and T7_c", "exchanged from frame 1"),
    ("top", exchanged("L4_a", "L4_c"), "L4_a and L4_c", "exchanged from frame 1"),
    (
        "later",
        exchanged("T3_a", "T3_b", 19),
        *("T3_a and T3_b", "exchanged at frame 20 (0.950 s)", "two names"),
    ),
    ("levels", exchanged("T5", "T12"), "T5 and T12", "exchanged from frame 1"),
    ("ghost", shifted("T9", (0, 0, 900), 20, 20), "T9", "jumps 900 mm at frame 20"),
    (
        "apart",
        shifted("L2_b", (0, 0, 12), 1, 41),
        *("L2_b and L2_c", "48.7 mm apart, and 36.9 mm in the set", "cluster L2"),
    ),
    ("soft", swayed("L2_b", 4.0), "L2_b and L2_c", "an SD of 2.8 mm", "single"),
]


@pytest.mark.parametrize("case", MOTIONS, ids=lambda case: case[0])
def test_faults_of_markers_are_named(case: tuple[Any, ...], tmp_path: Path) -> None:
    _, spoil, marker, found, *remedy = case
    problems = told(tmp_path, spoilt=(spoil,))
    assert {p.file for p in problems} == {f"{NAME}/flexion_extension.trc"}
    named = [p for p in problems if p.column == marker]
    assert any(found in p.found and "".join(remedy) in p.remedy for p in named), problems


def test_what_stands_still_for_half_a_second_is_not_frozen(tmp_path: Path) -> None:
    found = told(tmp_path, spoilt=(held(11, 20),))
    assert not any("still" in problem.found for problem in found)


def test_a_cluster_that_stands_still_is_told_by_other_bodies(tmp_path: Path) -> None:
    """Also where the next marker outside is lost with it."""
    lost_ones = ("T7_a", "T7_b", "T7_c", "T9")
    found = told(tmp_path, spoilt=(held(11, 30, *lost_ones),))
    assert {one.column for one in found if "stands still" in one.found} == set(lost_ones)


def test_all_markers_together_that_stand_still_are_told_once(tmp_path: Path) -> None:
    (problem,) = told(tmp_path, spoilt=(held(11, 30),))
    assert problem.found.startswith("all markers stand still in frames 11 to 30 (0.500 to 1.450 s)")


@pytest.mark.parametrize(
    ("unit", "size", "remedy"),
    [("m", "1000 times", "in mm and says m?"), ("cm", "10 times", "in mm and says cm?")],
)
def test_a_wrong_unit_is_named_once(unit: str, size: str, remedy: str, tmp_path: Path) -> None:
    def rename(motion: Motion) -> None:
        motion.unit = unit

    (problem,) = told(tmp_path, spoilt=(on("lateral_bending", rename),))
    assert problem.file == f"{NAME}/lateral_bending.trc"
    assert size in problem.found
    assert remedy in problem.remedy


@pytest.mark.parametrize("axes", ["x y z", "-x -z -y", "z x y"])
def test_a_wrong_up_axis_is_named_with_the_right_one(axes: str, tmp_path: Path) -> None:
    (problem,) = told(tmp_path, trial("axes", axes, STANCE))
    assert (problem.file, problem.row, problem.column) == (f"{NAME}/{TRIALS}", STANCE, "axes")
    assert "'x z -y'" in problem.remedy


def test_a_motion_cut_off_is_named(tmp_path: Path) -> None:
    """A cosine of 45 deg has turned 1.7 deg after an eighth of its time."""
    (problem,) = told(tmp_path, trial("end_s", f"{5 / RATE}"))
    assert (problem.row, problem.column) == (FLEXION, "start_s")
    wanted = 45.0 * (1.0 - np.cos(np.pi / 8.0)) / 2.0
    assert f"T1 turns {wanted:.1f} deg" in problem.found


def test_bending_that_is_called_flexion_is_named(tmp_path: Path) -> None:
    (problem,) = told(tmp_path, trial("file", "lateral_bending.trc"))
    assert (problem.row, problem.column) == (FLEXION, "kind")
    assert re.search(r"lateral_bending goes through 3[345] deg", problem.found)
    assert "did you mean 'lateral_bending'?" in problem.remedy


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    (problem,) = told(tmp_path, trial("file", "no.trc"))
    assert (problem.file, problem.found) == (f"{NAME}/no.trc", "no such file")


@pytest.mark.parametrize(
    ("column", "value", "crop"),
    [("start_s", "50", "from 50 s to an end"), ("end_s", "-1e6", "from an end to -1e+06 s")],
)
def test_a_crop_without_frames_is_told_at_its_cell(
    column: str, value: str, crop: str, tmp_path: Path
) -> None:
    (problem,) = told(tmp_path, trial(column, value, BENDING))
    assert (problem.file, problem.row, problem.column) == (f"{NAME}/trials.csv", BENDING, column)
    assert problem.found == f"no frame {crop} in lateral_bending.trc"


def test_several_faults_are_told_at_once(tmp_path: Path) -> None:
    problems = told(
        tmp_path,
        trial("axes", "x y z", STANCE),
        spoilt=(
            exchanged("LASI", "RASI"),
            lost("T5", 11, 25),
            on("lateral_bending", lambda m: m.exchange("T7_b", "T7_c")),
        ),
    )
    places = {(p.file.removeprefix(f"{NAME}/"), p.column) for p in problems}
    assert places == {
        (TRIALS, "axes"),
        ("flexion_extension.trc", "LASI and RASI"),
        ("flexion_extension.trc", "T5"),
        ("lateral_bending.trc", "T7_b and T7_c"),
    }
    (folder := tmp_path / "tables").mkdir()
    problems = told(
        folder,
        both(trial("arms", "up"), trial("kind", "twist", BENDING)),
        cell(PEOPLE, 2, "sex", "man"),
    )
    assert {(p.row, p.column) for p in problems} >= {
        (FLEXION, "arms"),
        (BENDING, "kind"),
        (2, "sex"),
    }


def test_levels_without_markers_are_a_warning(tmp_path: Path) -> None:
    """T7 to T1 is six levels once T5 and T3 are gone; markers beyond the set are a remark."""
    gone = ("T5", "T3_a", "T3_b", "T3_c")

    def drop(files: Files) -> None:
        rows = str(files[MARKERS]).splitlines()
        files[MARKERS] = "\n".join(r for r in rows if r.split(",")[1] not in gone) + "\n"

    folder = write(tmp_path, drop, spoilt=(lost("T9", 5, 6),))
    cohort = cohorts.read(folder, (SUBJECTS, *FORMS))
    assert not list(check_recordings(DOCUMENT, asked(), cohort, tmp_path))
    about, gaps = warnings_of(person_of(cohort, "a", folder))
    assert about[0] == ""
    assert about[1].startswith("6 levels from T7 to T1 without a marker")
    assert gaps[0] == "flexion_extension"
    assert gaps[1].startswith("1 short gaps, most of T9")
    spare = "not in the set and ignored: T3_a, T3_b, T3_c, T5"
    assert next(iter(repairs_of(cohort, "a"))) == ("stance", spare)


def test_check_says_what_was_put_right_while_reading(tmp_path: Path) -> None:
    def miscount(files: Files) -> None:
        text = str(files["stance.trc"])
        frames = text.split("\n")[2].split("\t")[2]
        files["stance.trc"] = text.replace(f"\t{frames}\t", "\t999\t", 1)

    cohort = cohorts.read(write(tmp_path, miscount), (SUBJECTS, *FORMS))
    words, _ = examine.told(asked(), cohort, tmp_path)
    (line,) = words.split("\n")[1:]
    assert f"{NAME}/stance.trc: NumFrames says 999 frames" in line


def test_remarks_do_not_name_a_subject(tmp_path: Path) -> None:
    """Two subjects in a file keep their markers' prefixes; the page is not to show who they are."""

    def rename(files: Files) -> None:
        text = str(files["stance.trc"])
        files["stance.trc"] = text.replace("T3_a", "Anna:T3_a").replace("T3_b", "Ben:T3_a")

    folder = write(tmp_path, rename)
    cohort = cohorts.read(folder, (SUBJECTS, *FORMS))
    told = [text for _, text in repairs_of(cohort, "a")]
    assert told[0] == "not in the set and ignored: T3_a, T3_a"
    assert not [text for text in told if "Anna" in text or "Ben" in text]
