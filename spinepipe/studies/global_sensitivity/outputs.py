"""Outputs of a study as arrays: all samples of one test and step, joint by joint."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
from numpy.typing import NDArray

from spinepipe.effects.contract import Array
from spinepipe.statics import Status
from spinepipe.studies import GlobalSensitivity
from spinepipe.tables import CALIBRATED, RESPONSES

Where = tuple[str, str, int, str, str]
"""Output, test, step, joint, coordinate."""

EVERY = "*"
SETTLED = 1e-6
"""Outputs (mm, deg, N, N m) that vary by less than a solver can tell are constant."""

_MOTION = {c.name.removeprefix("predicted_").rsplit("_", 1)[0]: c.name
           for c in RESPONSES.columns if c.name.startswith("predicted_")}  # fmt: skip
_LOAD = {c.name.removeprefix("load_").rsplit("_", 1)[0]: c.name
         for c in RESPONSES.columns if c.name.startswith("load_")}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Output:
    """K outputs that succeed or fail together.

    Attributes
    ----------
    where : (K,) what each is. values : (n, K) in units of the tables, 0 where a run failed.
    ok : (n,) which runs succeeded. resolution : below which an output counts as constant.
    """

    where: tuple[Where, ...]
    values: Array
    ok: NDArray[np.bool_]
    resolution: float


def response_outputs(blocks: Sequence[str], study: GlobalSensitivity) -> Iterator[Output]:
    """Outputs of each test and step from the blocks of a specimen's responses."""
    if not (study.outputs.motion or study.outputs.joint_load):
        return
    kinds = {
        "motion": {name: _MOTION[name] for name in study.outputs.motion},
        "joint_load": {name: _LOAD[name] for name in study.outputs.joint_load},
    }
    columns = [column for kind in kinds.values() for column in kind.values()]
    rows = _rows(blocks, ["sample", "test", "step", "joint", "status", *columns])
    head = rows.filter(pc.equal(rows["sample"], rows["sample"][0])).to_pylist()
    per_sample = len(head)
    good = np.array(pc.equal(rows["status"], Status.CONVERGED.value)).reshape(-1, per_sample)
    numbers = {
        name: np.nan_to_num(rows[name].to_numpy()).reshape(-1, per_sample) for name in columns
    }
    for test, step in dict.fromkeys((row["test"], row["step"]) for row in head):
        at = [n for n, row in enumerate(head) if (row["test"], row["step"]) == (test, step)]
        where = tuple(
            (kind, test, step, head[n]["joint"], name)
            for kind, names in kinds.items()
            for name in names
            for n in at
        )
        values = [numbers[column][:, at] for kind in kinds.values() for column in kind.values()]
        ok: NDArray[np.bool_] = np.all(good[:, at], axis=1, keepdims=False)
        yield Output(where, np.where(ok[:, None], np.hstack(values), 0.0), ok, SETTLED)


def calibrated_outputs(blocks: Sequence[str], study: GlobalSensitivity) -> Iterator[Output]:
    """Stiffness in each coordinate from the blocks of a specimen's fits."""
    if not blocks:
        return
    free = study.calibration.free
    names = {c.name.rsplit("_n", 1)[0]: c.name for c in CALIBRATED.columns if "_per_" in c.name}
    rows = _rows(blocks, ["status", *(names[name] for name in free)])
    ok = np.asarray(pc.is_in(rows["status"], value_set=pa.array(["converged"])))
    values = np.column_stack([np.nan_to_num(rows[names[name]].to_numpy()) for name in free])
    where = tuple(("stiffness", EVERY, 0, EVERY, name) for name in free)
    yield Output(where, np.where(ok[:, None], values, 0.0), ok, SETTLED)


def _rows(blocks: Sequence[str], columns: list[str]) -> pa.Table:
    """Rows of all blocks; they come in the order of the samples."""
    return pa.concat_tables([pq.read_table(path, columns=columns) for path in blocks])
