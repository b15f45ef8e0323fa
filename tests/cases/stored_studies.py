"""Made-up results of two tiny studies, as runs would leave them: tables, conclusions, pages."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import grid_cases
import pyarrow as pa

from spinepipe.marks import KEY, write_marked
from spinepipe.studies.range_of_motion.tables import RANGE_OF_MOTION
from spinepipe.tables import from_rows, read, write

FIRST, SECOND = "first", "second"
COLUMNS = (
    *("order", "place", "rule", "verdict", "text", "name", "value", "unit"),
    *("low", "high", "n", "source"),
)
TYPES = {"order": pa.int32(), "n": pa.int32(), **dict.fromkeys(("value", "low", "high"), "double")}
ANSWER = "In flexion, joints move 9.0°."
KEY_NUMBER = "Median motion in flexion"


def project(root: Path) -> Path:
    """A project of two studies of one cohort that differ in their seed, without results."""
    sd = "measurement_sd: {rotation_deg: 3.0, translation_mm: 1.2}\n"
    grid_cases.project(root, "poses: 2\nseed: 1\n", header=f"{sd}made_up: true\n")
    studies = root / "config" / "studies"
    text = (studies / f"{grid_cases.STUDY}.yaml").read_text()
    (studies / f"{grid_cases.STUDY}.yaml").unlink()
    for name, seed in ((FIRST, 1), (SECOND, 2)):
        told = text.replace(f"study: {grid_cases.STUDY}", f"study: {name}")
        (studies / f"{name}.yaml").write_text(told.replace("seed: 1", f"seed: {seed}"))
    (root / "config" / "config.yaml").write_text(f"studies: [{SECOND}, {FIRST}]\n")
    return root


def conclusion(place: str, rule: str, verdict: str, text: str, *values: Any) -> list[dict]:
    """A row for each number ``(name, value, unit, low, high)``, one with empty cells for none."""
    head = {"place": place, "rule": rule, "verdict": verdict, "text": text}
    names = ("name", "value", "unit", "low", "high")
    rows = [dict(zip(names, value, strict=True)) for value in values] or [{"name": "", "unit": ""}]
    return [{**head, **row, "source": ""} for row in rows]


def conclusions(value: float = 9.0, light: str = "ok") -> list[list[dict]]:
    """An answer with its number, the same as a key number, and two lights."""
    number = ("motion", value, "°", value - 1.0, value + 1.0)
    return [
        conclusion("answer", "motion", "answered", ANSWER, number),
        conclusion("key", "motion", "answered", KEY_NUMBER, number),
        conclusion("light", "solves", light, "Solves: all converged."),
        conclusion("light", "draws", "check_few", "Draws: few."),
    ]


def store_conclusions(folder: Path, told: Sequence[list[dict]]) -> None:
    """The table of conclusions, in their order."""
    rows = [{**row, "order": order} for order, of in enumerate(told) for row in of]
    columns = {
        name: pa.array([row.get(name) for row in rows], TYPES.get(name, pa.string()))
        for name in COLUMNS
    }
    write(pa.table(columns), folder / "conclusions.parquet", {"study": folder.name})


def store(root: Path, name: str, told: Sequence[list[dict]], mark: str = "0" * 64) -> Path:
    """A table, the conclusions and the page of a study."""
    folder = root / "results" / name
    folder.mkdir(parents=True, exist_ok=True)
    path, _ = grid_cases.table_of(folder, (1, 2, 1))
    made_by = {"study": name, "kind": "range_of_motion", "code_digest": "c0de", KEY: mark}
    write(read(path), path, {**made_by, "data_digest": "da7a", "seed": "1"})
    store_conclusions(folder, told)
    write_marked("a page", folder / "report.html", mark)
    return folder


def change_table(folder: Path, **metadata: str) -> None:
    """Another number in the first row of the table, and no last row; other metadata too."""
    path = folder / "range_of_motion.parquet"
    rows = read(path).to_pandas()
    rows.loc[0, "predicted_extension_deg"] += 1.0
    told = from_rows(RANGE_OF_MOTION, rows.iloc[:-1].to_dict("records"))
    made_by = {"study": folder.name, "kind": "range_of_motion", "seed": "1", "code_digest": "c0de"}
    write(told, path, {**made_by, "data_digest": "da7a", KEY: "1" * 64, **metadata})
