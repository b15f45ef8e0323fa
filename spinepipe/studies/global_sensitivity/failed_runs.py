"""How many runs failed, and where in the space of factors they lie.

Indices leave out what failed and what cannot be used without it. If one end of a factor makes the
spine tip, what is left says too little of it: so it is told where that end is.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray
from scipy.stats import binom

from spinepipe.effects.contract import Array
from spinepipe.sensitivity_analysis.global_indices.design import Design
from spinepipe.sensitivity_analysis.global_indices.indices import complete_blocks
from spinepipe.status import Status
from spinepipe.studies.global_sensitivity.tables import EVERY
from spinepipe.tables import read

THIRDS = ("low", "middle", "high")
ENDS = {"low": "lowest_third", "high": "highest_third"}

SURE = 0.05
"""Chance below which failed runs are said to lie in one third."""

MOSTLY = 0.5

WAYS = tuple(Status)
"""How a run may end, in the order of their numbers here."""

_AS = {
    Status.UNSTABLE: "tipped",
    Status.NOT_CONVERGED: "not_converged",
    Status.REFUSED: "refused",
}
"""How a run failed."""

_USABLE = np.array([way.usable for way in WAYS])

Ends = NDArray[np.int32]
"""(n,) place of each run's end among `WAYS`."""


def failed_rows(
    design: Design,
    values: Array,
    units: Sequence[str],
    responses: Sequence[str],
    calibrated: Sequence[str],
) -> Iterator[dict[str, Any]]:
    """Rows of ``failed_runs`` of one specimen.

    Parameters
    ----------
    values : (n, D) of the factors, in these units.
    responses, calibrated : blocks of the specimen's rows, in the order of the samples.
    """
    ended = dict(of_runs(responses))
    if calibrated:
        ended[EVERY] = _ways(read_blocks(calibrated, ["status"]))
    for test, how in ended.items():
        for row in rows_of(design, values, units, how):
            yield {"test": test, **row}


def of_runs(blocks: Sequence[str]) -> Mapping[str, Ends]:
    """How each sample ended in each test: the first load step that failed, else the last."""
    rows = read_blocks(blocks, ["sample", "test", "status"])
    head = rows.filter(pc.equal(rows["sample"], rows["sample"][0]))["test"].to_pylist()
    ended = _ways(rows).reshape(-1, len(head))
    found = {}
    for test in dict.fromkeys(head):
        each = ended[:, [at for at, name in enumerate(head) if name == test]]
        bad = ~_USABLE[each]
        found[test] = each[np.arange(len(each)), np.where(bad.any(1), bad.argmax(1), -1)]
    return found


def _ways(rows: pa.Table) -> Ends:
    """(n,) how each row ended."""
    known = pa.array([way.value for way in WAYS])
    ways: Ends = pc.index_in(rows["status"], value_set=known).to_numpy()
    return ways


def rows_of(
    design: Design, values: Array, units: Sequence[str], ended: Ends
) -> Iterator[dict[str, Any]]:
    """One row for each factor.

    Parameters
    ----------
    values : (n, D).
    """
    failed = ~_USABLE[ended]
    counts = {name: int((ended == WAYS.index(way)).sum()) for way, name in _AS.items()}
    out = int((~complete_blocks(design, ~failed).rows).sum())
    common = {"runs": design.n, "failed": int(failed.sum()), **counts, "left_out": out}
    for column, factor in enumerate(design.factors):
        own = values[failed, column]
        ends = {"lowest": own.min(), "highest": own.max()} if len(own) else {}
        yield {
            "factor": factor,
            "unit": units[column],
            **common,
            **dict.fromkeys(("lowest", "highest")),
            **{name: float(end) for name, end in ends.items()},
            **_thirds(design, column, failed),
        }


def _thirds(design: Design, column: int, failed: NDArray[np.bool_]) -> dict[str, Any]:
    """Failed runs in each third of a factor's distribution, and whether most lie at one end.

    Runs of a block share values: of each block with a failure its first one counts as a draw.
    """
    third = np.minimum((3.0 * design.unit[:, column]).astype(int), 2)
    counts = [int((third[failed] == part).sum()) for part in range(3)]
    row: dict[str, Any] = {f"{name}_third": n for name, n in zip(THIRDS, counts, strict=True)}
    if not failed.any():
        return {**row, "p": None, "mostly": "nowhere"}
    # of each block with a failure the first failed run is an independent draw of its third
    blocks = failed.reshape(-1, design.block)
    spoiled = np.flatnonzero(blocks.any(axis=1))
    drawn = third[spoiled * design.block + blocks[spoiled].argmax(axis=1)]
    # Bonferroni: both ends of every factor are looked at
    looked_at = len(ENDS) * len(design.factors)
    chances = {}
    for place, name in enumerate(THIRDS):
        if name in ENDS:
            n, share = int((drawn == place).sum()), float((third == place).mean())
            chances[name] = min(1.0, looked_at * float(binom.sf(n - 1, len(drawn), share)))
    best = min(chances, key=lambda name: chances[name])
    most = counts[THIRDS.index(best)] > MOSTLY * sum(counts)
    sure = most and chances[best] < SURE
    return {**row, "p": chances[best], "mostly": ENDS[best] if sure else "nowhere"}


def read_blocks(blocks: Sequence[str], columns: list[str]) -> pa.Table:
    """Rows of all blocks; they come in the order of the samples."""
    return pa.concat_tables([read(path, columns) for path in blocks])
