"""A testing machine's text of 100 MB: seconds and memory until it is a recording."""

import resource
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.memory import peak_mib

MEGABYTES = 100
_READ = """
from pathlib import Path
from spinepipe.testing_machine.recording import read_recording
from spinepipe.testing_machine.settings import MachineMapping

mapping = MachineMapping.model_validate({{
    "cohort": "rig", "title": "made up", "source": "nobody", "vertebrae": ["L5", "L4"],
    "load_point_mm": [0.0, 0.0, 0.0], "form": {form},
    "time": {{"column": "t", "unit": "s"}},
    "loads": [{{"column": "M", "unit": "N m", "positive": "flexion"}},
              {{"column": "F", "unit": "N", "positive": "inferior"}}],
    "motion": [{{"column": "A", "unit": "deg", "joint": "L4L5", "positive": "flexion"}}],
    "files": [{{"file": "big.txt", "specimen": "s01", "test": "flexion", "driving": "M"}}],
}})
read_recording(Path({path!r}), mapping.files[0], mapping)
"""


@dataclass(frozen=True)
class Reading:
    """How a text was written, and what reading it took: the whole process, imports too."""

    what: str
    megabytes: float
    rows: int
    cpu_s: float
    wall_s: float
    peak_mib: float


def readings() -> list[Reading]:
    """Plain text, which the bulk reader takes, and quoted cells, which only the exact one does."""
    found = []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "big.txt")
        for what, quote, form in (
            ("plain numbers", "", {}),
            ("decimal commas", "", {"decimal": "comma", "delimiter": "semicolon"}),
            ("cells in quotes", '"', {}),
        ):
            rows = _write(path, quote, form)
            start, before = time.perf_counter(), _cpu_of_children()
            peak = peak_mib(_READ.format(form=form, path=str(path)))
            wall = time.perf_counter() - start
            cpu, size = _cpu_of_children() - before, path.stat().st_size / 1e6
            found.append(Reading(what, size, rows, cpu, wall, peak))
    return found


def _cpu_of_children() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _write(path: Path, quote: str, form: dict[str, str]) -> int:
    """Eight columns, cycles of 100 s at 100 Hz; the number of rows."""
    mark = ";" if form else ","
    at_once = 50_000
    rows = 0
    with path.open("w") as file:
        file.write(mark.join("tMFAbcde") + "\n")
        while file.tell() < MEGABYTES * 1e6:
            t = (rows + np.arange(at_once)) / 100
            moment = 7.5 * np.sin(2 * np.pi * t / 100)
            columns = (t, moment, 300 + moment, moment / 1.5, *[moment] * 4)
            line = mark.join([f"{quote}%.4f{quote}"] * len(columns))
            text = "\n".join(line % row for row in zip(*columns, strict=True)) + "\n"
            file.write(text.replace(".", ",") if form else text)
            rows += at_once
    return rows
