"""`spinepipe import` of points picked in 3D Slicer.

Points of a made-up spine are known on ground axes; files have them on those of a scanner, turned by
formulas of this file.

Catches an axis or unit of Slicer read as another, a point taken for another, and points that were
never placed.
"""

import json
from collections.abc import Callable, Sequence
from pathlib import Path

import pandas as pd
import pytest
import yaml
from sweeps import sweep

from spinepipe import cohort as cohorts
from spinepipe.imports.imported import write
from spinepipe.imports.judge import write_judged
from spinepipe.imports.registry import read
from spinepipe.problems import InputError

Point = tuple[float, float, float]

OF_VERTEBRA: dict[str, Point] = {
    "superior_endplate_centre": (0.0, 12.0, 0.0),
    "inferior_endplate_centre": (2.0, -13.0, 1.0),
    "left_pedicle_base": (-18.0, 4.0, -11.0),
    "right_pedicle_base": (-18.0, 4.0, 12.0),
}
CENTRES: dict[str, Point] = {"L5": (3.0, 700.0, 5.0), "L4": (9.0, 736.0, 6.0)}
SPINE = {
    f"{vertebra}_{landmark}": tuple(a + b for a, b in zip(centre, offset, strict=True))
    for vertebra, centre in CENTRES.items()
    for landmark, offset in OF_VERTEBRA.items()
}
"""By label, mm: anterior, superior, right."""

LPS: Callable[[Sequence[float]], list[float]] = lambda p: [-p[2], -p[0], p[1]]  # noqa: E731
RAS: Callable[[Sequence[float]], list[float]] = lambda p: [p[2], p[0], p[1]]  # noqa: E731


def mrk(points: dict[str, list[float]], axes: str = "LPS", unit: object = "mm") -> str:
    control = [
        {"id": str(k), "label": label, "position": at, "positionStatus": "defined"}
        for k, (label, at) in enumerate(points.items(), start=1)
    ]
    markup = {"type": "Fiducial", "coordinateSystem": axes, "coordinateUnits": unit}
    return json.dumps({"@schema": "x", "markups": [{**markup, "controlPoints": control}]})


def fcsv(points: dict[str, list[float]], axes: str = "RAS", end: str = "") -> str:
    head = [
        "# Markups fiducial file version = 4.11",
        f"# CoordinateSystem = {axes}",
        "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID",
    ]
    rows = [
        f'{k},{a!r},{b!r},{c!r},0,0,0,1,1,1,0,{label},"of, a scan",{end}'
        for k, (label, (a, b, c)) in enumerate(points.items())
    ]
    return "\n".join([*head, *rows, ""])


def settings(folder: Path, **changes: object) -> Path:
    document = {
        "kind": "landmarks",
        "cohort": "scans",
        "title": "made up",
        "source": "no measurement.",
        "vertebrae": ["L5", "L4"],
        "files": [{"file": "a.mrk.json", "specimen": "s01"}],
        **changes,
    }
    (folder / "scans.yaml").write_text(yaml.safe_dump(document, sort_keys=False))
    return folder / "scans.yaml"


def landmarks(path: Path) -> pd.DataFrame:
    """The table as it is written, of a cohort that reads as sound."""
    folder = path.with_name("scans")
    write(read(path), folder, replace=False)
    table = cohorts.read(folder).landmarks
    assert table is not None
    return table


def refused(path: Path) -> str:
    with pytest.raises(InputError) as error:
        write_judged(read(path), path.parent / "judged" / "scans", False)
    return str(error.value)


@sweep(
    "name, text",
    [
        ("a.mrk.json", mrk({k: LPS(p) for k, p in SPINE.items()})),
        ("a.mrk.json", mrk({k: RAS(p) for k, p in SPINE.items()}, axes="RAS")),
        (
            "a.mrk.json",
            mrk({k: [v / 1000 for v in LPS(p)] for k, p in SPINE.items()}, unit=["m", "UCUM", "x"]),
        ),
        ("a.fcsv", fcsv({k: LPS(p) for k, p in SPINE.items()}, axes="LPS")),
        ("a.fcsv", fcsv({k: LPS(p) for k, p in SPINE.items()}, axes="1", end=",2,0")),
        ("a.fcsv", fcsv({k: RAS(p) for k, p in SPINE.items()}, axes="0")),
    ],
)
def test_points_are_where_they_were_picked(tmp_path: Path, name: str, text: str) -> None:
    (tmp_path / name).write_text(text)
    files = [{"file": name, "specimen": "s01"}]
    table = landmarks(settings(tmp_path, files=files, sd_mm=0.5))
    assert list(table["vertebra"] + "_" + table["landmark"]) == list(SPINE)
    for row, point in zip(table.to_dict("records"), SPINE.values(), strict=True):
        assert (row["x_mm"], row["y_mm"], row["z_mm"]) == pytest.approx(point, abs=1e-6)
        assert row["sd_mm"] == 0.5


def test_names_of_ones_own_and_a_file_for_each_vertebra(tmp_path: Path) -> None:
    short = {"SUP": "superior_endplate_centre", "INF": "inferior_endplate_centre"}
    short |= {"LP": "left_pedicle_base", "RP": "right_pedicle_base"}
    for specimen in ("s01", "s02"):
        for vertebra in CENTRES:
            own = {k: LPS(SPINE[f"{vertebra}_{name}"]) for k, name in short.items()}
            (tmp_path / f"{specimen}_{vertebra}.mrk.json").write_text(mrk(own))
    files = [{"glob": "{specimen}_{vertebra}.mrk.json"}]
    found = landmarks(settings(tmp_path, files=files, labels=short))
    assert (
        found.groupby("specimen")["y_mm"].sum().tolist() == [sum(p[1] for p in SPINE.values())] * 2
    )
    labels = {f"{{vertebra}}-{own}": f"{{vertebra}}_{name}" for own, name in short.items()}
    own = {f"{v}-{k}": LPS(SPINE[f"{v}_{name}"]) for v in CENTRES for k, name in short.items()}
    (tmp_path / "a.mrk.json").write_text(mrk(own | {"skin": [0.0, 0.0, 0.0]}))
    made = read(settings(tmp_path, labels=labels))
    assert "Not read: skin." in " ".join(made.sentences)


def test_all_that_lacks_is_told_at_once(tmp_path: Path) -> None:
    points = {k: LPS(p) for k, p in SPINE.items()}
    points["L4_inferior_endplate_center"] = points.pop("L4_inferior_endplate_centre")
    document = json.loads(mrk(points))
    control = document["markups"][0]["controlPoints"]
    control[0] |= {"position": None, "positionStatus": "undefined"}
    (tmp_path / "a.mrk.json").write_text(json.dumps(document))
    told = refused(settings(tmp_path))
    assert "'s01' without inferior_endplate_centre of L4" in told
    assert "'s01' without superior_endplate_centre of L5" in told
    assert "L5_superior_endplate_centre (not placed)" in told
    assert "did you mean 'L4_inferior_endplate_center'?" in told


@sweep(
    "change, told",
    [
        (lambda t: t.replace("L4_left_ped", "L4_right_ped", 1), "'L4_right_pedicle_base' a second"),
        (lambda t: t.replace("= RAS", "= RAS\n# CoordinateSystem = LPS"), "axes 'LPS and RAS'"),
        (lambda t: t.replace("# CoordinateSystem = RAS\n", ""), "axes ''"),
        (lambda t: t.replace(",736.0,", ",x,").replace(",748.0,", ",x,"), "does not write"),
        (lambda t: t.replace("= RAS", "= LPS"), "as where axes LPS are called RAS"),
    ],
)
def test_doubtful_points_are_refused(
    tmp_path: Path, change: Callable[[str], str], told: str
) -> None:
    text = fcsv({k: RAS(p) for k, p in SPINE.items()})
    (tmp_path / "a.FCSV").write_text(change(text))
    found = refused(settings(tmp_path, files=[{"file": "a.FCSV", "specimen": "s01"}]))
    assert told in found
    assert "a.FCSV" in found
    assert found.count("without") == 0


def test_surfaces_are_named_and_stay_where_they_are(tmp_path: Path) -> None:
    (tmp_path / "a.mrk.json").write_text(mrk({k: LPS(p) for k, p in SPINE.items()}))
    (tmp_path / "s01_L5.stl").write_text("solid a")
    path = settings(tmp_path, surfaces={"file": "{specimen}_{vertebra}.stl"})
    assert "surfaces.file: found no file s01_L4.stl" in refused(path)
    (tmp_path / "s01_L4.stl").write_text("solid a")
    write(read(path), tmp_path / "scans", replace=False)
    table = pd.read_csv(tmp_path / "scans" / "surfaces.csv")
    assert table["file"].tolist() == ["s01_L5.stl", "s01_L4.stl"]
    assert set(table["unit"] + table["axes"]) == {"mmLPS"}
    assert "lying" in (tmp_path / "scans" / "cohort.yaml").read_text()
