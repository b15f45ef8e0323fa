"""What somebody might put beside data so that it runs when it is read."""

import base64
import os
import pickle
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from spinepipe.studies.discrepancy.store import SUFFIX


class Trap:
    """Unpickled, it makes a folder."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def __reduce__(self) -> tuple[object, ...]:
        return os.mkdir, (str(self._folder),)


def a_pickle(sprung: Path) -> bytes:
    """Bytes that make the folder `sprung` when they are unpickled."""
    return pickle.dumps(Trap(sprung))


def a_tag(sprung: Path) -> str:
    """YAML that makes the folder when it is read by a loader that builds Python's objects."""
    return f"!!python/object/apply:os.mkdir ['{sprung}']"


def a_python_type(path: Path, sprung: Path) -> None:
    """Parquet whose column says that its type is to be unpickled, as old readers did unasked."""
    told = {
        "ARROW:extension:name": "arrow.py_extension_type",
        "ARROW:extension:metadata": a_pickle(sprung),
    }
    column = pa.field("specimen", pa.string(), metadata=told)
    pq.write_table(pa.table({"specimen": ["a"]}, schema=pa.schema([column])), path)


_STUDY = "joint_pose_sensitivity"
_RECORD = base64.urlsafe_b64encode(f"results/{_STUDY}/simulations.parquet".encode()).decode()
NAMES = {
    "results": ("x.pkl", "_task.pklz", "cache.joblib", "small.npy", "sitecustomize.py"),
    f"results/{_STUDY}": ("x.pkl", f"{'0' * 64}{SUFFIX}", "_result.pklz", "stiffness.pickle"),
    "config": ("x.pkl", "config.pkl", "config.py", "config.json"),
    "config/studies": (f"{_STUDY}.pkl", f"{_STUDY}.py", "conftest.py"),
    "config/cohorts/palanca_l1l4": ("landmarks.pkl", "landmarks.npy", "cohort.py", "specimens.npz"),
    ".snakemake/iocache": ("latest.pkl",),
    ".snakemake/metadata": (_RECORD,),
    ".snakemake/auxiliary": ("x.pkl",),
    ".snakemake": ("metadata.db", "x.pkl"),
}
"""Files that programs of these kinds keep pickles or programs in, by folder."""


def plant(project: Path, sprung: Path) -> list[Path]:
    """Put pickles, and Python that does the same, wherever a run may look; the files."""
    planted = []
    for folder, names in NAMES.items():
        for path in (project / folder / name for name in names):
            path.parent.mkdir(parents=True, exist_ok=True)
            python = f"import os\nos.mkdir({str(sprung)!r})\n".encode()
            path.write_bytes(python if path.suffix == ".py" else a_pickle(sprung))
            planted.append(path)
    return planted
