"""Job: indices of all factors for all outputs of one specimen, and how they settle."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from spinepipe.effects.contract import Array
from spinepipe.jobs.digest import mark_of, provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.sensitivity_analysis.global_indices.convergence import convergence
from spinepipe.sensitivity_analysis.global_indices.design import Design
from spinepipe.sensitivity_analysis.global_indices.estimates import SensitivityIndex, Settings
from spinepipe.sensitivity_analysis.global_indices.floor import (
    Floor,
    above_floor,
    negligible,
    noise_floor,
)
from spinepipe.sensitivity_analysis.global_indices.indices import indices
from spinepipe.status import Status
from spinepipe.studies.global_sensitivity.failed_runs import failed_rows, read_blocks
from spinepipe.studies.global_sensitivity.sampling import design_of, factor_values
from spinepipe.studies.global_sensitivity.settings import GlobalSensitivity
from spinepipe.studies.global_sensitivity.tables import (
    CALIBRATED,
    CONVERGENCE,
    EVERY,
    FAILED_RUNS,
    INDICES,
    RESPONSES,
)
from spinepipe.tables import from_rows, to_arrow, write

Where = tuple[str, str, int, str, str]
"""Output, test, step, joint, coordinate."""

Columns = dict[str, Sequence[Any]]

SETTLED = 1e-6
"""Outputs (mm, deg, N, N m) that vary by less than a solver can tell are constant."""

WHERE = ("output", "test", "step", "joint", "coordinate")

_MOTION, _LOAD = (
    {
        column.name.removeprefix(kind).rsplit("_", 1)[0]: column.name
        for column in RESPONSES.columns
        if column.name.startswith(kind)
    }
    for kind in ("predicted_", "load_")
)
"""Column of each coordinate."""


@dataclass(frozen=True, eq=False)
class OutputGroup:
    """K outputs that succeed or fail together.

    Attributes
    ----------
    where : (K,) what each is. values : (n, K) in units of the tables, 0 where a run failed.
    ok : (n,) which runs succeeded.
    """

    where: tuple[Where, ...]
    values: Array
    ok: NDArray[np.bool_]


def run(
    root: str,
    study: str,
    design: str,
    responses: Sequence[str],
    specimen: str,
    indices: str,
    convergence: str,
    failed_runs: str,
    calibrated: Sequence[str] = (),
) -> None:
    """Write what the blocks of one specimen's samples say: indices, how they settle, who failed."""
    settings, cohort = study_of_kind(GlobalSensitivity, root, study)
    outputs: list[OutputGroup] = []
    # responses are read only where motion or loads are asked, and of them the columns asked
    columns = [_MOTION[name] for name in settings.outputs.motion]
    columns += [_LOAD[name] for name in settings.outputs.joint_load]
    if columns:
        place = ["sample", "test", "step", "joint", "status"]
        outputs += outputs_of(read_blocks(responses, [*place, *columns]), settings)
    outputs += calibrated_outputs(calibrated, settings)
    read = [mark_of(path) for path in (design, *responses, *calibrated)]
    made_by = provenance("analyse", settings, cohort, [specimen], read)
    drawn = design_of(settings)
    rows = analysed(settings, drawn, outputs, specimen)
    for table, path in zip(rows, (indices, convergence), strict=True):
        write(table, path, made_by)
    values = factor_values(design, settings, slice(None)) * np.array(settings.per_si)
    failed = list(failed_rows(drawn, values, settings.units, responses, calibrated))
    write(from_rows(FAILED_RUNS, failed, specimen=specimen), failed_runs, made_by)


def analysed(
    settings: GlobalSensitivity, design: Design, outputs: Sequence[OutputGroup], specimen: str
) -> tuple[pa.Table, pa.Table]:
    """The tables ``indices`` and ``convergence`` of one specimen."""
    each = [_analysed(settings, design, one) for one in outputs]
    tables = []
    for place, table in enumerate((INDICES, CONVERGENCE)):
        parts = [part for found in each for part in found[place]]
        columns = {
            name: list(chain.from_iterable(part[name] for part in parts))
            for name in table.names
            if name != "specimen"
        }
        tables.append(to_arrow(table, columns, specimen=specimen))
    return tables[0], tables[1]


def _analysed(
    settings: GlobalSensitivity, design: Design, one: OutputGroup
) -> tuple[list[Columns], list[Columns]]:
    """Columns of each index of K outputs, and of each while the design grows; K cells each."""
    asked = Settings(
        bootstraps=settings.bootstraps,
        confidence=settings.confidence,
        seed=settings.seed,
        most_failed=settings.most_failed,
        wanted=settings.chosen_indices,
    )
    found = indices(design, one.values, one.ok, asked, SETTLED)
    floors = noise_floor(design, one.values, found, one.ok, asked, SETTLED)
    stages = convergence(design, one.values, one.ok, asked, 8, SETTLED, found)
    count, where = len(one.where), dict(zip(WHERE, zip(*one.where, strict=True), strict=True))
    good = one.values[one.ok] if one.ok.any() else np.full((1, count), np.nan)
    common = where | {"mean": good.mean(axis=0), "sd": good.std(axis=0)}
    of_stages = [
        where | _numbers(index) | _repeated(count, samples=stage.samples, runs=stage.runs)
        for stage in stages
        for index in stage.indices
    ]
    return [common | _screened(index, floors) for index in found], of_stages


def _screened(index: SensitivityIndex, floors: dict[str, Floor]) -> Columns:
    """An index, what tells it from noise, and a factor from one that may be fixed."""
    count, floor = len(index.status), floors.get(index.index)
    nothing = [None] * count
    told = _repeated(
        count,
        other=index.other,
        floor_replicates=0 if floor is None else floor.replicates,
        runs=index.runs,
        failed=index.failed,
        conditional=index.failed > 0,
    )
    return {
        **_numbers(index),
        **told,
        "noise_floor_low": nothing if floor is None else floor.low.tolist(),
        "noise_floor": nothing if floor is None else floor.high.tolist(),
        "above_floor": above_floor(index, floors),
        "negligible": negligible(index),
        "status": [status.value for status in index.status],
        "message": index.message,
    }


def _numbers(index: SensitivityIndex) -> Columns:
    ends = {"estimate": index.estimate, "ci_low": index.low, "ci_high": index.high}
    told = _repeated(len(index.status), index=index.index, factor=index.factor)
    return told | {name: numbers.tolist() for name, numbers in ends.items()}


def _repeated(count: int, **values: Any) -> Columns:
    """The same in all cells of a column."""
    return {name: [value] * count for name, value in values.items()}


def outputs_of(rows: pa.Table, study: GlobalSensitivity) -> Iterator[OutputGroup]:
    """Outputs of each test and step from all responses of a specimen, sample by sample."""
    kinds = {
        "motion": {name: _MOTION[name] for name in study.outputs.motion},
        "joint_load": {name: _LOAD[name] for name in study.outputs.joint_load},
    }
    columns = [column for kind in kinds.values() for column in kind.values()]
    head = rows.filter(pc.equal(rows["sample"], rows["sample"][0])).to_pylist()
    # all samples have the rows of the first one, in the same order
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
        yield OutputGroup(where, np.where(ok[:, None], np.hstack(values), 0.0), ok)


def calibrated_outputs(blocks: Sequence[str], study: GlobalSensitivity) -> Iterator[OutputGroup]:
    """Stiffness in each coordinate from the blocks of a specimen's fits."""
    if not blocks:
        return
    free = study.calibration.free
    names = {c.name.rsplit("_n", 1)[0]: c.name for c in CALIBRATED.columns if "_per_" in c.name}
    rows = read_blocks(blocks, ["status", *(names[name] for name in free)])
    ok = np.asarray(pc.is_in(rows["status"], value_set=pa.array(["converged"])))
    values = np.column_stack([np.nan_to_num(rows[names[name]].to_numpy()) for name in free])
    where = tuple(("stiffness", EVERY, 0, EVERY, name) for name in free)
    yield OutputGroup(where, np.where(ok[:, None], values, 0.0), ok)
