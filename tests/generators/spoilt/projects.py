"""Sound projects that are spoilt: shipped cohorts cut down, and small ones made up here."""

import csv
import io
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

import yaml

from tests.generators.spoilt import trunk
from tests.generators.spoilt.c3d import Markers, read_trc, written

CONFIG = Path(__file__).resolve().parents[3] / "config"

Files = dict[str, bytes]
"""Content by path from the project's root."""

MODEL = "config/model.yaml"


@dataclass(frozen=True)
class Project:
    """One cohort, one study of it and config.yaml, all sound.

    Attributes
    ----------
    files : content by path. tables : stems of the cohort's documented tables.
    mapping : path of the YAML that `spinepipe import` makes the cohort by; empty: it is there.
    spoilt_elsewhere : whether its tables and YAML files are spoilt in another project.
    markers : what its files of motion tell, by path, where they were made of it.
    """

    name: str
    kind: str
    cohort: str
    files: Files
    tables: tuple[str, ...]
    mapping: str = ""
    spoilt_elsewhere: bool = False
    markers: Mapping[str, Markers] = field(default_factory=dict)

    @property
    def folder(self) -> str:
        """The cohort's folder."""
        return f"config/cohorts/{self.cohort}"

    @property
    def study(self) -> str:
        """The study's file."""
        return f"config/studies/{self.name}.yaml"

    def table(self, stem: str) -> list[list[str]]:
        """Cells of a table, the header first."""
        text = self.files[f"{self.folder}/{stem}.csv"].decode()
        return list(csv.reader(io.StringIO(text)))


def as_csv(rows: list[list[str]]) -> bytes:
    """Rows as a CSV file."""
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows(rows)
    return out.getvalue().encode()


class _WrittenOut(yaml.SafeDumper):
    """Writes what stands in two places twice."""

    def ignore_aliases(self, data: object) -> bool:
        return True


def as_yaml(data: object) -> bytes:
    """Data as a YAML file, every key on a line of its own."""
    text = yaml.dump(data, Dumper=_WrittenOut, sort_keys=False, allow_unicode=True, width=10_000)
    return text.encode()


@dataclass(frozen=True)
class _Shipped:
    """A shipped study, and what of its cohort is kept: all where nothing is named."""

    study: str
    tables: tuple[str, ...]
    specimens: tuple[str, ...] = ()
    tests: tuple[str, ...] = ()
    cycles: tuple[str, ...] = ()


_TWO_TESTS = ("flexion", "left_axial_rotation")
_RIG = ("specimens", "joints", "bodies", "loads", "motion")
_FELT = ("specimens", "landmarks", "bodies", "loads", "motion")

SHIPPED = (
    _Shipped("l1l4_joint_pose", _FELT),
    _Shipped("l1l4_factors", _FELT),
    _Shipped("t12s1_cohort_stiffness", _FELT, ("s01", "s02"), _TWO_TESTS, ("1",)),
    _Shipped("t12s1_range_of_motion", _FELT, ("s01",), (), ("1",)),
    _Shipped("linear_spines", _RIG, ("s01", "s02"), ("flexion_extension", "lateral_bending")),
    _Shipped("l4l5_disc", ("specimens", "joints", "loads", "motion")),
    _Shipped("ais18_scoliosis", ("specimens", "films", "patients"), ("p01", "p02", "p03", "p04")),
    _Shipped(
        "tracking_phantom",
        ("specimens", "joints", "bodies", "subjects", "trials", "marker_set"),
        ("s01",),
    ),
    _Shipped("trunk_volunteers", ("specimens", "subjects", "tasks")),
)


def _shipped(of: _Shipped) -> Project:
    keys = yaml.safe_load((CONFIG / "studies" / f"{of.study}.yaml").read_text())
    cohort = keys["cohort"]
    source = CONFIG / "cohorts" / cohort
    folder = f"config/cohorts/{cohort}"
    files = {
        "config/config.yaml": as_yaml({"studies": [of.study]}),
        f"config/studies/{of.study}.yaml": as_yaml(keys),
        f"{folder}/cohort.yaml": as_yaml(yaml.safe_load((source / "cohort.yaml").read_text())),
    }
    for path in sorted(source.iterdir()):
        if path.suffix == ".csv":
            files[f"{folder}/{path.name}"] = as_csv(_kept(path, of))
        elif path.suffix == ".trc" and (not of.specimens or path.name.startswith(of.specimens)):
            files[f"{folder}/{path.name}"] = path.read_bytes()
    return Project(of.study, keys["kind"], cohort, files, of.tables)


def _kept(path: Path, of: _Shipped) -> list[list[str]]:
    header, *rows = csv.reader(io.StringIO(path.read_text(encoding="utf-8")))
    for column, keep in (
        ("specimen", of.specimens),
        ("test", of.tests),
        ("cycle", of.cycles),
    ):
        if column in header and keep:
            at = header.index(column)
            rows = [row for row in rows if row[at] in (*keep, "*")]
    return [header, *rows]


SMALL = "small"

_COHORT = {
    "cohort": SMALL,
    "title": "two specimens, three vertebrae",
    "source": "written for the tests",
    "vertebrae": ["L4", "L3", "L2"],
    "gravity": True,
    "zeroed_at_step_0": False,
    "measurement_sd": {"rotation_deg": 0.1, "translation_mm": 0.05},
}

_LOADS = (
    "specimen,test,cycle,step,vertebra,fx_n,fy_n,fz_n,mx_nm,my_nm,mz_nm,px_mm,py_mm,pz_mm,time_s,follower_n",
    (
        "*,flexion,,0,L2,0,0,0,0,0,0,,,,0,",
        "*,flexion,,1,L2,0,-50,0,0,0,-1,15,72,0,1,",
        "*,flexion,,2,L2,0,-100,0,0,0,-2,15,72,0,2,",
    ),
)


def _small_tables(landmarks: bool) -> dict[str, tuple[str, tuple[str, ...]]]:
    """Two specimens of three vertebrae that stand straight, and two joints that bend forwards."""
    tables = {
        "specimens": (
            "specimen,sex,age_years,height_m,mass_kg,degeneration_grade,scanner",
            ("a,female,61,1.62,70.5,2,CT 1", "b,,,,,,CT 2"),
        ),
        "bodies": (
            "specimen,vertebra,mass_kg,com_x_mm,com_y_mm,com_z_mm,"
            "ixx_kg_m2,iyy_kg_m2,izz_kg_m2,ixy_kg_m2,ixz_kg_m2,iyz_kg_m2",
            tuple(
                f"{s},{v},0.06,0,{y},0,2e-5,3e-5,2e-5,0,0,0"
                for s in "ab"
                for v, y in (("L3", 23), ("L2", 59))
            ),
        ),
        "loads": _LOADS,
        "motion": (
            "specimen,test,cycle,step,joint,extension_deg,anterior_mm,superior_mm",
            tuple(
                f"{s},flexion,,{step},{joint},{-step * size:g},{0.1 * step * size:.2f},"
                f"{-0.08 * step * size:.3f}"
                for s, joints in (("a", (1.0, 1.1)), ("b", (1.2, 1.3)))
                for step in range(3)
                for joint, size in zip(("L3L4", "L2L3"), joints, strict=True)
            ),
        ),
    }
    tables["joints"] = (
        "specimen,joint,x_mm,y_mm,z_mm,extension_deg,right_bending_deg,left_rotation_deg",
        tuple(
            f"{s},{joint},0,{y},0,{turned},0,0"
            for s in "ab"
            for joint, y, turned in (("L3L4", 5, -3), ("L2L3", 41, 4))
        ),
    )
    if landmarks:
        points = (
            ("superior_endplate_centre", 0, 26, 0),
            ("inferior_endplate_centre", 0, 0, 0),
            ("left_pedicle_base", -20, 18, -15),
            ("right_pedicle_base", -20, 18, 15),
        )
        tables["landmarks"] = (
            "specimen,vertebra,landmark,x_mm,y_mm,z_mm,sd_mm",
            tuple(
                f"{s},{v},{name},{x},{y + base},{z},1"
                for s in "ab"
                for v, base in (("L4", -26), ("L3", 10), ("L2", 46))
                for name, x, y, z in points
            ),
        )
        del tables["joints"]
    return tables


_RIG_TABLES = {
    "supports": (
        "specimen,test,joint,coordinate,vertebra,direction,state,reaction",
        ("*,flexion,L3L4,right_bending,,,held,", "*,*,L2L3,right_bending,,,held,unknown"),
    ),
    "preload": (
        "specimen,test,vertebra,fx_n,fy_n,fz_n,mx_nm,my_nm,mz_nm,px_mm,py_mm,pz_mm",
        ("*,flexion,L2,0,-20,0,0,0,0,0,60,0", "a,*,L3,0,-5,0,0,0,0,0,30,0"),
    ),
}


def _small(name: str, kind: str, keys: dict[str, object], landmarks: bool, rig: bool) -> Project:
    tables = _small_tables(landmarks) | (_RIG_TABLES if rig else {})
    study = {"study": name, "kind": kind, "cohort": SMALL, **keys}
    files = {
        "config/config.yaml": as_yaml({"studies": [name], "full": []}),
        f"config/studies/{name}.yaml": as_yaml(study),
        f"config/cohorts/{SMALL}/cohort.yaml": as_yaml(_COHORT),
    }
    for stem, (header, rows) in tables.items():
        files[f"config/cohorts/{SMALL}/{stem}.csv"] = "\n".join([header, *rows, ""]).encode()
    if name == "on_model":
        files[MODEL] = as_yaml(model_file())
    return Project(name, kind, SMALL, files, tuple(tables))


def model_file() -> dict[str, object]:
    """A model of the small cohort with several effects, their options and values."""
    everywhere = {"specimens": ["*"], "joints": ["*"], "tests": ["*"]}
    return {
        "model": "on_model",
        "cohort": SMALL,
        "effects": [
            {
                "effect": "linear_bushing",
                "options": {},
                "scope": everywhere,
                "values": [
                    {"specimen": "*", "joint": "*", "extension_nm_per_rad": 50.0},
                    {"specimen": "a", "joint": "L3L4", "extension_nm_per_rad": 40.0},
                ],
            },
            {
                "effect": "neutral_zone",
                "options": {"zone": "off_centre"},
                "scope": {"specimens": ["a", "b"], "joints": ["L3L4"], "tests": ["flexion"]},
                "values": [{"specimen": "*", "joint": "*"}],
            },
        ],
    }


def _forms() -> dict[str, object]:
    """A study of global sensitivity with a factor of each form."""
    offset, times = {"low": -1.0, "high": 1.0}, {"sd": 0.1}
    return {
        "stiffness": {"extension_nm_per_rad": 50.0},
        "factors": [
            {"of": "stiffness", "coordinate": "extension", "times": {"low": 0.5, "high": 2.0}},
            {"of": "joint_centre", "axis": "anterior", "offset_mm": offset, "name": "centre"},
            {"of": "joint_axes", "axis": "extension", "offset_deg": {"sd": 2.0}},
            {"of": "load_size", "times": times},
            {"of": "load_direction", "axis": "z", "offset_deg": offset},
            {"of": "load_point", "axis": "x", "offset_mm": offset},
            {"of": "mass", "times": times},
            {"of": "centre_of_mass", "axis": "x", "offset_mm": offset},
        ],
        "design": {"method": "sobol", "samples": 64, "second_order": False},
    }


@cache
def projects() -> tuple[Project, ...]:
    """All of them."""
    return (
        *map(_shipped, SHIPPED),
        _small("small_rig", "discrepancy", {"base": {"stiffness": "per_specimen"}}, False, True),
        _small("on_model", "cohort_stiffness", {"base": {"model": MODEL}}, True, False),
        _small("small_factors", "global_sensitivity", _forms(), True, False),
        _tracked_in_c3d(),
        _own_trunk(),
        _machine(),
    )


def _tracked_in_c3d() -> Project:
    """The tracked phantom, its motion as `.c3d`."""
    plain = next(of for of in SHIPPED if of.study == "tracking_phantom")
    of, name = _shipped(plain), "tracking_in_c3d"
    markers = {
        f"{file.removesuffix('.trc')}.c3d": read_trc(content.decode())
        for file, content in of.files.items()
        if file.endswith(".trc")
    }
    trials = f"{of.folder}/trials.csv"
    files = {
        "config/config.yaml": as_yaml({"studies": [name]}),
        f"config/studies/{name}.yaml": as_yaml(
            {**yaml.safe_load(of.files[of.study]), "study": name}
        ),
        **{n: c for n, c in of.files.items() if n.startswith(of.folder) and n[-4:] != ".trc"},
        trials: of.files[trials].replace(b".trc", b".c3d"),
        **{file: written(one) for file, one in markers.items()},
    }
    return replace(of, name=name, files=files, spoilt_elsewhere=True, markers=markers)


def _own_trunk() -> Project:
    """Persons and tasks of the shipped cohort on a trunk that the cohort brings along."""
    plain = next(of for of in SHIPPED if of.study == "trunk_volunteers")
    of, name = _shipped(plain), "own_trunk"
    folder = f"config/cohorts/{name}"
    header = yaml.safe_load(of.files[f"{of.folder}/cohort.yaml"])
    subjects = of.table("subjects")[:3]
    who = tuple(row[0] for row in subjects[1:])
    rows = {
        "specimens": [["specimen"], *([one] for one in who)],
        "subjects": subjects,
        "tasks": of.table("tasks")[:3],
        **trunk.tables(who),
    }
    files = {
        "config/config.yaml": as_yaml({"studies": [name]}),
        f"config/studies/{name}.yaml": as_yaml(
            {"study": name, "kind": of.kind, "cohort": name, "geometry": "cohort"}
        ),
        f"{folder}/cohort.yaml": as_yaml(
            {**header, "cohort": name, "vertebrae": list(trunk.CHAIN)}
        ),
        **{f"{folder}/{stem}.csv": as_csv(table) for stem, table in rows.items()},
    }
    stems = ("joints", "muscles", "muscle_parameters", "body_frames")
    return Project(name, of.kind, name, files, stems)


RIG = CONFIG.parent / "docs/examples/testing_machine"


def _machine() -> Project:
    """The files of a testing machine that come along, of one specimen."""
    keys = yaml.safe_load((RIG / "rig.yaml").read_text())
    keys["files"] = [of for of in keys["files"] if of["specimen"] == "s01"]
    files = {f"machine/{of['file']}": (RIG / of["file"]).read_bytes() for of in keys["files"]}
    files = {"machine/rig.yaml": as_yaml(keys), **files}
    return Project("machine_rig", "import", keys["cohort"], files, (), mapping="machine/rig.yaml")


def write(files: Files, root: Path) -> Path:
    """Write files below a folder that there is not yet."""
    for name, content in files.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    return root
