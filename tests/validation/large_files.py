"""Files of 100 MB and at the limits of what is read: how long does `spinepipe check` take?

Processor time of a process of its own, its start and imports included; what it said beside it.
Kept file by file: a run that was cut off goes on.
"""

import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from tests.generators.spoilt.projects import MODEL, Project, projects, write
from tests.validation.kept import Kept

SIZE = 100_000_000
MOST_ROWS, MOST_CELLS, MOST_YAML = 150_000, 4_000_000, 1_000_000
"""What docs/cohort-format.md says is read."""

GOAL_S = 10.0

HANGS_ON = ("spinepipe/**/*.py", "tests/generators/spoilt/projects.py", "tests/validation/*.py")


@dataclass(frozen=True)
class Large:
    """One large file in the place of one of a project's."""

    project: Project
    file: str
    what: str
    make: Callable[[], bytes]


def table() -> pd.DataFrame:
    """Seconds and answer of each."""
    kept, rows = Kept("large_files", HANGS_ON), []
    for one in (_sound(), *larges()):
        name = f"{one.project.name} {one.file} {one.what}"
        if name not in kept.known:
            kept.add(name, _measured(one))
            print(kept.known[name], flush=True)
        rows.append(kept.known[name])
    return pd.DataFrame(rows)


def _sound() -> Large:
    """Nothing large: what every check takes on this machine."""
    project = next(project for project in projects() if project.name == "small_rig")
    file = f"{project.folder}/motion.csv"
    return Large(project, file, "as it was", lambda: project.files[file])


def _measured(one: Large) -> dict[str, object]:
    data = one.make()
    with tempfile.TemporaryDirectory() as folder:
        write({**one.project.files, one.file: data}, Path(folder))
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        command = [sys.executable, "-m", "spinepipe.cli", "--root", folder, "check"]
        done = subprocess.run(command, capture_output=True, text=True, env=dict(os.environ))
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    told = [line.strip() for line in done.stdout.splitlines() if "found" in line]
    return {
        "file": one.file.rpartition("/")[2],
        "what": one.what,
        "mb": round(len(data) / 1e6, 1),
        "processor_s": round(seconds, 1),
        "within_goal": seconds <= GOAL_S,
        "exit": done.returncode,
        "characters_told": len(done.stdout) + len(done.stderr),
        "first_told": (told or [done.stderr.strip()[-80:] or "accepted"])[0][:120].replace(
            "|", "/"
        ),
    }


def larges() -> Iterator[Large]:
    """All of them."""
    by_name = {project.name: project for project in projects()}
    small, model = by_name["small_rig"], by_name["on_model"]
    for stem in small.tables:
        yield from _of_table(small, stem)
    for name, stems in (
        ("on_model", ("landmarks",)),
        ("ais18_scoliosis", ("films", "patients")),
        ("trunk_volunteers", ("subjects", "tasks")),
        ("tracking_phantom", ("trials", "marker_set")),
    ):
        for stem in stems:
            yield from _of_table(by_name[name], stem, main=True)
    for project, file in (
        (small, small.study),
        (small, f"{small.folder}/cohort.yaml"),
        (small, "config/config.yaml"),
        (model, MODEL),
    ):
        yield from _of_yaml(project, file)
    yield from _of_recording(by_name["tracking_phantom"])


def _of_table(project: Project, stem: str, main: bool = False) -> Iterator[Large]:
    file = f"{project.folder}/{stem}.csv"
    header, *rows = project.files[file].decode().splitlines()
    cells = rows[0].split(",")
    unknown = ["q{n}" if not _is_number(cell) else cell for cell in cells]

    def large(what: str, make: Callable[[], str]) -> Large:
        return Large(project, file, what, lambda: make().encode())

    def repeated(row: str, number: int) -> str:
        return "\n".join([header, *(row.replace("{n}", str(n)) for n in range(number))]) + "\n"

    most = min(MOST_ROWS, MOST_CELLS // len(cells)) - 10
    yield large(
        "lawful rows, 100 MB", lambda: repeated(rows[0], (SIZE - 1000) // (len(rows[0]) + 1))
    )
    yield large("the same row, as many as are read", lambda: repeated(rows[0], most))
    yield large("unknown names, as many as are read", lambda: repeated(",".join(unknown), most))
    if main:
        return
    wide = ",".join("9" * 24 for _ in cells)
    yield large("one line", lambda: "1" * SIZE)
    yield large("one line of commas", lambda: "," * SIZE)
    yield large("line ends", lambda: header + "\n" * (SIZE - 200))
    yield large(
        "a quote that never ends",
        lambda: header + '\n"' + "a," * (MOST_CELLS // 3) + "b" * (SIZE // 2),
    )
    yield large(
        "long cells",
        lambda: repeated(",".join(["a" * 190] * len(cells)), SIZE // 200 // len(cells)),
    )
    yield large("cells of 24 digits", lambda: repeated(wide, min(most, SIZE // len(wide))))
    yield large("remarks of 990 characters", lambda: repeated("a b " * 247, SIZE // 1000))


def _is_number(cell: str) -> bool:
    return cell.strip("-").replace(".", "", 1).replace("e", "", 1).replace("-", "").isdigit()


def _of_yaml(project: Project, file: str) -> Iterator[Large]:
    text = project.files[file].decode()

    def large(what: str, more: Callable[[], str]) -> Large:
        return Large(project, file, what, lambda: (text + more()).encode())

    room = MOST_YAML - len(text) - 100
    yield large("comment, 100 MB", lambda: "#" * SIZE)
    yield large("brackets, 100 MB", lambda: "q: " + "[" * SIZE)
    yield large("brackets, 1 MB", lambda: "q: " + "[" * room)
    yield large("braces, 1 MB", lambda: "q: " + "{a: " * (room // 4))
    yield large("dashes, 1 MB", lambda: "q:\n  " + "- " * (room // 2))
    yield large("aliases, 1 MB", lambda: "q: &a [1]\nr: [" + "*a," * (room // 3 - 10) + "*a]\n")
    yield large("99 000 items", lambda: "q: [" + "1," * 99_000 + "1]\n")
    yield large("keys, 1 MB", lambda: "".join(f"q{n}: 1\n" for n in range(room // 11)))
    yield large("one text, 1 MB", lambda: "q: " + "a b " * (room // 4))
    yield large("blanks, 1 MB", lambda: "q:" + " " * room)
    yield large("quotes, 1 MB", lambda: 'q: "' + "\\n" * (room // 2))


def _of_recording(project: Project) -> Iterator[Large]:
    file = next(name for name in project.files if name.endswith("stance.trc"))
    text = project.files[file].decode()
    *head, frame = text.rstrip("\n").split("\n")
    many = (SIZE - 10_000) // (len(frame) + 12)

    def frames(number: int) -> bytes:
        start = "\n".join(head[:6]).replace("\t11\t", f"\t{number}\t", 1)
        cells = frame.split("\t")[2:]
        rows = ("\t".join([str(n + 1), f"{n / 25:.4f}", *cells]) for n in range(number))
        return ("\n".join([start, *rows]) + "\n").encode()

    yield Large(project, file, "lawful frames, 100 MB", lambda: frames(many))
    yield Large(
        project, file, "lawful frames, as many as are read", lambda: frames(9_900_000 // 84)
    )
    yield Large(project, file, "one line", lambda: b"1" * SIZE)
    yield Large(project, file, "tabs", lambda: text.encode() + b"\t" * (SIZE - len(text)))
