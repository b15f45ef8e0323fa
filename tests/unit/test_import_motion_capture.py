"""`spinepipe import` of markers with force plates, a box and moments: made up ones, and real lifts.

The made-up laboratory has its own axes, units and clock; what is true on ground axes is known. Of
the measured lifts (config/cohorts/stoop_lift) weight, the box and the two ways to the moment at
L5S1 are held against each other: none of them shares a number with the others.

Catches a table turned, scaled or shifted otherwise than its markers, and a cohort that is no longer
what its files make.
"""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from ezc3d import c3d
from sweeps import sweep

from spinepipe import cohort as cohorts
from spinepipe.imports.imported import write
from spinepipe.imports.judge import write_judged
from spinepipe.imports.registry import read
from spinepipe.motion.reading import read_motion
from spinepipe.problems import InputError
from spinepipe.studies.registry import every_form

ROOT = Path(__file__).resolve().parents[2]
LIFTS = ROOT / "config" / "cohorts" / "stoop_lift"
EXAMPLE = ROOT / "docs" / "examples" / "stoop_lift" / "lifts.yaml"
TRIALS = ("lift1", "lift2", "lift3")
WEIGHT_N = 81.68 * 9.81
BOX_N = 15.0 * 9.81

# A laboratory whose y points backwards, whose x points to the left and whose z points up.
AXES = "-y z -x"
TIME_S = np.arange(5) / 50.0
FORCE = np.stack([10.0 + TIME_S, 700.0 + 5.0 * TIME_S, -3.0 * TIME_S])
"""On the person: forwards, up, right, N."""
POINT_MM = np.stack([200.0 * TIME_S, 0.0 * TIME_S, 50.0 + TIME_S])
MOMENT_NM = np.stack([1.0 * TIME_S, 2.0 + TIME_S, 90.0 - TIME_S])
"""On the upper vertebra about forwards, up, right."""


def on_laboratory(ours: np.ndarray) -> np.ndarray:
    forwards, up, right = ours
    return np.stack([-right, -forwards, up])


def table(path: Path, head: str, *columns: np.ndarray) -> None:
    rows = [";".join(f"{one:.9g}" for one in row) for row in np.vstack(columns).T]
    path.write_text("\n".join([head, *rows, ""]) if head else "\n".join([*rows, ""]))


def laboratory(folder: Path) -> dict[str, object]:
    """Files of two trials, and their settings."""
    for trial in ("stand", "bend"):
        places = 0.3 + np.outer([1.0, 2.0, 3.0], TIME_S)
        columns = ",".join(["time_s", "A_x_m", "A_y_m", "A_z_m"])
        lines = [",".join(map(str, (t, *p))) for t, p in zip(TIME_S, places.T, strict=True)]
        (folder / f"{trial}.csv").write_text("\n".join([columns, *lines, ""]))
    clock = (TIME_S + 7.0) * 1000.0
    plate = -on_laboratory(FORCE) / 1000.0, on_laboratory(POINT_MM) / 10.0
    table(folder / "plates_stand.txt", "a header", clock, *plate)
    table(folder / "plates_bend.txt", "a header", clock, *plate)
    table(folder / "moments_bend.txt", "", clock, -on_laboratory(MOMENT_NM) * 1000.0)
    return {
        "kind": "motion_capture",
        "cohort": "lab",
        "title": "made up",
        "source": "no measurement.",
        "axes": AXES,
        "persons": [
            {
                **{"specimen": "p1", "sex": "female", "age_years": 30.0},
                **{"height_m": 1.7, "mass_kg": 700.0 / 9.81},
            }
        ],
        "trials": [
            {
                **{"specimen": "p1", "trial": trial, "kind": kind, "file": f"{trial}.csv"},
                **{"arms": "hanging", "shift_s": -7.0},
            }
            for trial, kind in (("stand", "stance"), ("bend", "flexion_extension"))
        ],
        "tables": [
            {
                **{"table": "force_plates", "file": "plates_{trial}.txt", "first_line": 2},
                **{"acts_on": "plate"},
                "columns": ["time_ms", *(f"f{a}_kn" for a in "xyz"), *(f"{a}_cm" for a in "xyz")],
            },
            {
                **{"table": "measured_moments", "file": "moments_{trial}.txt", "joint": "L5S1"},
                **{"acts_on": "lower", "method": "feet"},
                "columns": ["time_ms", "mx_nmm", "my_nmm", "mz_nmm"],
            },
        ],
    }


def made(folder: Path, document: dict[str, object]) -> Path:
    path = folder / "lab.yaml"
    path.write_text(yaml.safe_dump(document, sort_keys=False))
    return path


def test_tables_are_on_ground_axes_and_on_the_clock_of_markers(tmp_path: Path) -> None:
    imported = read(made(tmp_path, laboratory(tmp_path)))
    write(imported, tmp_path / "lab", replace=False)
    cohort = cohorts.read(tmp_path / "lab", every_form())
    assert cohort.further["trials"]["axes"].tolist() == [AXES] * 2
    assert "measured_moments: no moments_{trial}.txt of stand." in imported.sentences
    plates = pd.read_csv(tmp_path / "lab" / "force_plates.csv")
    found = plates[plates["trial"] == "bend"]
    assert found["time_s"].to_numpy() == pytest.approx(TIME_S, abs=1e-6)
    assert np.allclose(found[["fx_n", "fy_n", "fz_n"]].T, FORCE, rtol=0.0, atol=1e-4)
    assert np.allclose(found[["x_mm", "y_mm", "z_mm"]].T, POINT_MM, rtol=0.0, atol=1e-4)
    moments = pd.read_csv(tmp_path / "lab" / "measured_moments.csv")
    assert set(moments["trial"] + moments["joint"] + moments["method"]) == {"bendL5S1feet"}
    assert np.allclose(moments[["mx_nm", "my_nm", "mz_nm"]].T, MOMENT_NM, rtol=0.0, atol=1e-4)
    motion = read_motion(tmp_path / "lab" / "bend.csv", AXES)
    assert motion.places[-1, 0] == pytest.approx([-0.46, 0.54, -0.38], abs=1e-9)


@sweep(
    "key, value, told",
    [
        (("trials", 0, "shift_s"), 0.0, "write `shift_s: -7`"),
        (("tables", 0, "acts_on"), "person", "correct `acts_on`"),
        (("tables", 0, "acts_on"), "upper", "one of person, plate"),
        (("tables", 0, "columns"), ["time_ms", "fx_n", "fy_n", "fz_n", "-", "-", "-"], "in kN?"),
        (("tables", 0, "columns"), ["time_ms", "fx_n"], "found 7 cells; allowed: 2 cells"),
        (("tables", 1, "columns"), ["time_ms", "mx_nm", "my_nm", "fz_n"], "'fz_n'"),
        (("tables", 1, "columns"), ["time_ms", "mx_nm", "my_nm", "mx_nmm"], "'mx_nmm', which is t"),
        (("tables", 1, "columns"), ["time_s", "mx_nm", "my_nm", "mz_nm"], "is its time in ms?"),
        (("tables", 0, "first_line"), 1, "plates_stand.txt, line 1: found 2 cells"),
        (("tables", 1, "file"), "moment_{trial}.txt", "no file 'moment_{trial}.txt' of any trial"),
        (("axes",), "z y -x", "correct `axes`"),
        (("axes",), "x y -z", "one sign is wrong"),
        (("persons", 0, "height_m"), 170.0, "persons.0.height_m"),
        (("trials", 1, "trial"), "stand", "lab.yaml, line"),
        (("trials", 1, "file"), "bent.csv", "bent.csv: found no such file"),
        (("trials", 1, "start_s"), 3.0, "no frame from 3 s"),
        (("copied",), ["trials.csv", "marker_set.csv"], "'marker_set.csv'"),
    ],
)
def test_what_cannot_be_right_is_told_before_anything_is_written(
    tmp_path: Path, key: tuple[str | int, ...], value: object, told: str
) -> None:
    document = laboratory(tmp_path)
    at: object = document
    for one in key[:-1]:
        at = at[one]  # type: ignore[index]
    at[key[-1]] = value  # type: ignore[index]
    with pytest.raises(InputError) as error:
        write_judged(read(made(tmp_path, document)), tmp_path / "judged" / "lab", False)
    assert told in str(error.value)


@sweep(
    "row, cell, value, told",
    [
        (1, 3, "", "correct `acts_on`"),
        (2, 0, "nan", "line 3, time_ms: found nothing"),
        (3, 0, "7000", "line 4, time_ms: found 7 s after 7.02 s"),
    ],
)
def test_one_cell_switches_no_check_off(
    tmp_path: Path, row: int, cell: int, value: str, told: str
) -> None:
    document = laboratory(tmp_path)
    document["tables"][0]["acts_on"] = "person"  # type: ignore[index]
    file = tmp_path / "plates_stand.txt"
    rows = [line.split(";") for line in file.read_text().splitlines()]
    rows[row][cell] = value
    file.write_text("\n".join(map(";".join, rows)) + "\n")
    with pytest.raises(InputError) as error:
        read(made(tmp_path, document))
    assert told in str(error.value)


def test_plates_of_a_c3d_are_those_that_were_written(tmp_path: Path) -> None:
    """z is up and y to the left; a plate of type 2 with the axes of the laboratory."""
    force, at, free_nm = np.array([20.0, -30.0, 600.0]), np.array([0.04, -0.07, 0.0]), 3.0
    moment_nm = np.cross(at, force) + np.array([0.0, 0.0, free_nm])
    half, middle = 0.25, np.array([0.5, 0.2, 0.0])
    corners = [middle + half * np.array([x, y, 0]) for x, y in ((1, 1), (-1, 1), (-1, -1), (1, -1))]
    content = c3d()
    point, analog = (content["parameters"][group] for group in ("POINT", "ANALOG"))
    point["RATE"]["value"], point["LABELS"]["value"] = [50.0], ["A"]
    point["UNITS"]["value"] = ["mm"]
    content["data"]["points"] = np.full((4, 1, 5), 100.0)
    analog["RATE"]["value"], analog["LABELS"]["value"] = [100.0], [f"c{k}" for k in range(6)]
    analog["UNITS"]["value"] = ["N"] * 3 + ["Nmm"] * 3
    values = np.concatenate([force, 1000.0 * moment_nm])
    content["data"]["analogs"] = np.repeat(values[None, :, None], 10, axis=2)
    for name, value in (
        ("USED", [1]),
        ("TYPE", [2]),
        ("ZERO", [0, 0]),
        ("CORNERS", 1000.0 * np.array(corners).T.reshape(3, 4, 1)),
        ("ORIGIN", np.zeros((3, 1))),
        ("CHANNEL", np.arange(1.0, 7.0).reshape(6, 1)),
    ):
        content.add_parameter("FORCE_PLATFORM", name, value)
    content.write(str(tmp_path / "bend.c3d"))
    document = laboratory(tmp_path)
    trials, tables = document["trials"], document["tables"]
    assert isinstance(trials, list)
    assert isinstance(tables, list)
    plates = {"table": "force_plates", "file": "{trial}.c3d", "acts_on": "person"}
    document |= {"trials": [trials[1] | {"file": "bend.c3d"}], "tables": [plates], "axes": "x z -y"}
    write(read(made(tmp_path, document)), tmp_path / "lab", replace=False)
    found = pd.read_csv(tmp_path / "lab" / "force_plates.csv")
    assert found["time_s"].to_numpy() == pytest.approx(np.arange(10) / 100.0)
    forwards, left, up = force
    told = [forwards, up, -left, 0.0, free_nm, 0.0, *(1000.0 * np.array([0.54, 0.0, -0.13]))]
    columns = [f"f{a}_n" for a in "xyz"] + [f"m{a}_nm" for a in "xyz"] + [f"{a}_mm" for a in "xyz"]
    assert found[columns].to_numpy() == pytest.approx(np.tile(told, (10, 1)), abs=1e-3)


def test_recordings_with_one_name_and_with_that_of_a_table_are_told_apart(tmp_path: Path) -> None:
    document = laboratory(tmp_path)
    for trial, name in (("stand", "a/motion.csv"), ("bend", "b/walk.csv")):
        (tmp_path / name).parent.mkdir()
        (tmp_path / f"{trial}.csv").rename(tmp_path / name)
    trials = document["trials"]
    assert isinstance(trials, list)
    (tmp_path / "marker_set.csv").write_text(
        "specimen,marker,vertebra,x_mm,y_mm,z_mm\n"
        + "".join(f"p1,{name},S1,{x},0,0\n" for name, x in (("A", -80), ("B", -90), ("C", -100)))
    )
    document |= {"copied": ["marker_set.csv"]}
    trials[0]["file"], trials[1]["file"] = "a/motion.csv", "b/walk.csv"
    trials.append(trials[1] | {"trial": "again", "start_s": 0.04})
    write(read(made(tmp_path, document)), tmp_path / "lab", replace=False)
    further = cohorts.read(tmp_path / "lab", every_form()).further
    assert further["trials"]["file"].tolist() == ["p1_stand.csv", "p1_bend.csv", "p1_again.csv"]
    assert len(further["marker_set"]) == 3


def test_measured_lifts_are_what_their_files_make(tmp_path: Path) -> None:
    write(read(EXAMPLE), tmp_path / "stoop_lift", replace=False)
    again = {path.name: path.read_bytes() for path in (tmp_path / "stoop_lift").iterdir()}
    assert again == {path.name: path.read_bytes() for path in LIFTS.iterdir()}
    cohort = cohorts.read(LIFTS, every_form())
    assert cohort.further["trials"]["trial"].tolist() == ["stance", *TRIALS]


def measured(name: str, trial: str, **where: object) -> pd.DataFrame:
    rows = pd.read_csv(LIFTS / f"{name}.csv")
    for column, value in {"trial": trial, **where}.items():
        rows = rows[rows[column] == value]
    return rows.reset_index(drop=True)


def test_plates_bear_the_weight_of_who_stands_on_them() -> None:
    plates = measured("force_plates", "stance").groupby("time_s")["fy_n"].sum()
    assert len(plates) == 101
    assert plates.mean() == pytest.approx(WEIGHT_N, rel=0.02)
    markers = read_motion(LIFTS / "stance.c3d", "x z -y")
    place = dict(zip(markers.names, markers.places.mean(axis=0), strict=True))
    # one foot on each plate, each force under its own foot (m)
    for plate, side in ((1, "L"), (2, "R")):
        point = measured("force_plates", "stance", plate=plate)[["x_mm", "z_mm"]].mean() / 1000.0
        heel, toe = place[f"{side}HEE"], place[f"{side}TOE"]
        assert heel[0] < point["x_mm"] < toe[0]
        assert abs(point["z_mm"] - 0.5 * (heel[2] + toe[2])) < 0.05


@sweep("trial", TRIALS)
def test_a_box_of_15_kg_goes_from_the_plate_to_the_feet(trial: str) -> None:
    box = measured("box", trial)
    assert box["y_mm"].iloc[0] == pytest.approx(118.0, abs=1.0)
    assert box["y_mm"].max() == pytest.approx(660.0, abs=20.0)
    lifted = int(np.argmax(box["y_mm"] > box["y_mm"].iloc[0] + 20.0))
    plate = {k: measured("force_plates", trial, plate=k) for k in (1, 2)}
    # the plate under the box was zeroed with it, so that it reads minus its weight afterwards
    assert plate[1]["fy_n"][:20].abs().max() < 5.0
    assert plate[1]["fy_n"][lifted + 10 :].mean() == pytest.approx(-BOX_N, rel=0.02)
    assert plate[2]["fy_n"][lifted:].mean() == pytest.approx(WEIGHT_N + BOX_N, rel=0.03)
    # it keeps its distance to the hands: one clock, one set of axes
    markers = read_motion(LIFTS / f"{trial}.c3d", "x z -y")
    at = [markers.names.index(name) for name in ("RFIN", "LFIN")]
    hands = 1000.0 * markers.places[:, at].mean(axis=1)
    apart = box[["x_mm", "y_mm"]].to_numpy() - hands[:, :2]
    assert np.all(apart[lifted + 5 :].std(axis=0) < 5.0)
    assert box["z_mm"].isna().all()


@sweep("trial", TRIALS)
def test_moments_from_feet_and_from_hands_agree_once_the_box_is_lifted(trial: str) -> None:
    box = measured("box", trial)
    lifted = int(np.argmax(box["y_mm"] > box["y_mm"].iloc[0] + 20.0)) + 5
    of = ["mx_nm", "my_nm", "mz_nm"]
    feet, hands = (
        measured("measured_moments", trial, method=f"from_{end}")[of].to_numpy()
        for end in ("feet", "hands")
    )
    # muscles of the back extend the trunk on the pelvis: positive about the axis to the right
    assert feet[:, 2].max() == pytest.approx(209.0, abs=2.0)
    apart = np.sqrt(np.mean((feet - hands)[lifted:] ** 2, axis=0))
    assert np.all(apart < 0.03 * feet[:, 2].max())
    # before, the moment from the hands is too large by the box in front
    assert (hands - feet)[:20, 2].mean() > 30.0
