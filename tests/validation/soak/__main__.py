"""`python -m tests.validation.soak [PART ...]`: kills, sequence, targets, memory; all unless told.

`python -m tests.validation.soak kills KIND ...` kills studies of these kinds alone.

What was measured by this code is kept, kind by kind and part by part: started again, the program
goes on with what is missing. The tables are written after each piece.
"""

import signal
import sys
import tempfile
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import pandas as pd
from small_studies import SMALL

from tests.validation.kept import Kept
from tests.validation.soak import kills, memory, sequence, targets
from tests.validation.written import write, written

HANGS_ON = (
    *("Snakefile", "workflow/rules/*.smk", "profiles/default/*", "spinepipe/jobs/*.py"),
    *("spinepipe/files.py", "spinepipe/marks.py", "spinepipe/world.py"),
    *("tests/validation/soak/*.py", "tests/cases/small_studies.py"),
)
"""What runs jobs and writes files, and this program: results are kept as long as it stays."""

Rows = list[dict[str, Any]]

KILLS_HEAD = (
    f"A small study of each kind, killed {kills.KILLS} times and started again by the same "
    "command. A kill comes after a drawn number of further result files and a part of a "
    "second; three of five kill all processes at once, one Snakemake alone, one a worker. "
    "When a study comes to its end before all kills are spent, it begins anew "
    "(rounds). Files that differ: from those of an undisturbed run, byte by byte, in all "
    f"rounds together; what tells processor time is left out: of tables the column "
    f"`{kills.TELLS_TIME}` and the row `{kills.ROW_OF_TIME}`, and the page with that row, the "
    "report of `tracking`, as a whole. Finished files made twice: there at a kill, and "
    "not in Snakemake's record as being made. The command fails where a verdict is not "
    f'"{kills.SOUND}". In the system\'s temporary folder killed processes leave empty '
    "folders of Python and Snakemake."
)


def main() -> None:
    """Run the parts that are asked for, or all; `kills` for the kinds behind it, or all."""
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))  # ends its runs too
    if sys.argv[1:2] == ["kills"]:
        _kills(sys.argv[2:])
        return
    parts: dict[str, Callable[[], None]] = {
        "kills": lambda: _kills(()),
        "sequence": _sequence,
        "targets": _targets,
        "memory": _memory,
    }
    for name in sys.argv[1:] or parts:
        if name not in parts:
            sys.exit(f"no part {name!r}: {', '.join(parts)}")
        parts[name]()


def kept(name: str, measure: Callable[[Path], Iterable[dict[str, Any]]]) -> Rows:
    """Rows of a piece: as they were kept, or measured in a temporary folder."""
    pieces = Kept("soak", HANGS_ON)
    if name not in pieces.known:
        with tempfile.TemporaryDirectory(prefix="spinepipe-soak-") as folder:
            pieces.add(name, list(measure(Path(folder))))
    rows: Rows = pieces.known[name]
    return rows


def _kills(kinds: Sequence[str]) -> None:
    """Kill studies of these kinds; ends with an error where a kill did harm.

    Rows of other kinds stay in the table as they were measured, each with its date.
    """
    unknown = set(kinds) - set(SMALL)
    if unknown:
        sys.exit(f"no kind {', '.join(sorted(unknown))}: {', '.join(SMALL)}")
    rows = {row["kind"]: row for row in written("soak_kills")}
    for kind in kinds or SMALL:
        found = kept(f"kills-{kind}", lambda folder, kind=kind: [kills.row(kind, folder)])  # type: ignore[misc]
        rows |= {row["kind"]: row for row in found}
        in_order = [rows[one] for one in SMALL if one in rows]
        _write("kills", KILLS_HEAD, in_order)
    harmed = [f"{kind}: {row['verdict']}" for kind, row in rows.items() if not kills.is_sound(row)]
    if harmed:
        sys.exit("soak kills: " + "; ".join(harmed))


def _sequence() -> None:
    found = kept("sequence", sequence.rows)
    _write(
        "sequence",
        "One small study of range of motion, nothing reset in between: settings, data or code "
        "changed and changed back, runs killed in the middle of it, files damaged, lost and dated "
        "in a drawn order, Snakemake's record removed. After each step but a kill the run goes to "
        "its end, and each table is compared byte by byte with that of a fresh run of the same "
        "settings.",
        found,
    )
    if any(int(row["tables_that_differ"]) for row in found):
        sys.exit("soak sequence: tables differ")


def _targets() -> None:
    _write(
        "targets",
        f"A study of {2 * targets.SAMPLES:,} jobs of one run each. One job in a hundred dies: by "
        "an exception, SIGKILL, an end of its process, a fault of memory, a quarter each; each "
        "must be named with its cause on the screen and in its log, all others must be done, and "
        "the next run must make the dead ones and nothing else. Runs that tip over are rows with "
        "status and message, equal to those of the same study in batches, and counted in "
        "`failed_runs`. "
        "Nothing to do: every file is looked at, its content digest verified or not.",
        kept("targets", targets.rows),
    )


def _memory() -> None:
    _write(
        "memory",
        f"{memory.STUDIES} studies, one after the other, in one pool of two workers, each with a "
        "seed and a cohort of its own. What a worker holds after the study of that number, freed "
        f"memory given back; limit of growth from study {memory.WARM} to the last: "
        f"{memory.MOST_GROWTH_MIB:g} MiB, nothing for open files, threads and PyBullet's clients.",
        kept("memory", memory.rows),
    )


def _write(part: str, head: str, rows: Rows) -> None:
    write(f"soak_{part}", head, pd.DataFrame(rows), f"python -m tests.validation.soak {part}")


if __name__ == "__main__":
    main()
