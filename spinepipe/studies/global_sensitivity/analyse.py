"""Job: indices of all factors for all outputs of one specimen, and how they settle."""

from collections.abc import Iterator, Sequence
from typing import Any

from spinepipe.jobs.global_sensitivity.drawn import design_of
from spinepipe.jobs.global_sensitivity.outputs import Output, calibrated_outputs, response_outputs
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.jobs.provenance import provenance
from spinepipe.sensitivity.global_indices import (
    Index,
    Settings,
    above_floor,
    convergence,
    indices,
    noise_floor,
)
from spinepipe.studies import GlobalSensitivity
from spinepipe.tables import CONVERGENCE, INDICES, Table, to_arrow, write

Rows = list[dict[str, Any]]

WHERE = ("output", "test", "step", "joint", "coordinate")


def run(
    root: str,
    study: str,
    design: str,
    responses: list[str],
    calibrated: list[str],
    specimen: str,
    indices: str,
    convergence: str,
) -> None:
    """Write the indices, and the convergence, of one specimen from the blocks of its samples."""
    settings, cohort = study_of_kind(GlobalSensitivity, root, study)
    outputs = [
        *response_outputs(responses, settings),
        *calibrated_outputs(calibrated, settings),
    ]
    made_by = provenance("global_sensitivity.analyse", settings, cohort)
    for table, rows, path in (
        (INDICES, _index_rows, indices),
        (CONVERGENCE, _convergence_rows, convergence),
    ):
        _write(table, [row for one in outputs for row in rows(settings, one)], path, made_by)


def _write(table: Table, rows: Rows, path: str, made_by: dict[str, str]) -> None:
    own = table.without("specimen")
    columns = {column.name: [row[column.name] for row in rows] for column in own.columns}
    write(to_arrow(own, columns), path, made_by)


def _asked(settings: GlobalSensitivity) -> Settings:
    return Settings(
        bootstraps=settings.bootstraps,
        confidence=settings.confidence,
        seed=settings.seed,
        most_failed=settings.most_failed,
        wanted=settings.chosen_indices,
    )


def _index_rows(settings: GlobalSensitivity, one: Output) -> Iterator[dict[str, Any]]:
    found = indices(design_of(settings), one.values, one.ok, _asked(settings), one.resolution)
    floors = noise_floor(found)
    means, sds = _sizes(one)
    for index in found:
        above = above_floor(index, floors)
        nothing = [None] * len(one.where)
        floor = floors[index.index].tolist() if index.index in floors else nothing
        columns = zip(
            *(one.where, _numbers(index), means, sds, floor, above, index.status, index.message),
            strict=True,
        )
        for where, numbers, mean, sd, top, is_above, status, message in columns:
            yield {
                **dict(zip(WHERE, where, strict=True)),
                "index": index.index,
                "factor": index.factor,
                "other": index.other,
                **numbers,
                "mean": mean,
                "sd": sd,
                "noise_floor": top,
                "above_floor": is_above,
                "runs": index.runs,
                "failed": index.failed,
                "status": status.value,
                "message": message,
            }


def _convergence_rows(settings: GlobalSensitivity, one: Output) -> Iterator[dict[str, Any]]:
    asked = _asked(settings)
    for stage in convergence(design_of(settings), one.values, one.ok, asked, 8, one.resolution):
        for index in stage.indices:
            for where, numbers in zip(one.where, _numbers(index), strict=True):
                yield {
                    **dict(zip(WHERE, where, strict=True)),
                    "index": index.index,
                    "factor": index.factor,
                    "samples": stage.samples,
                    "runs": stage.runs,
                    **numbers,
                }


def _sizes(one: Output) -> tuple[list[float | None], list[float | None]]:
    """Mean and SD of each output over the runs that have it."""
    if not one.ok.any():
        nothing: list[float | None] = [None] * len(one.where)
        return nothing, nothing
    values = one.values[one.ok]
    return values.mean(axis=0).tolist(), values.std(axis=0).tolist()


def _numbers(index: Index) -> Sequence[dict[str, float | None]]:
    ends = (index.estimate.tolist(), index.low.tolist(), index.high.tolist())
    return [
        {"estimate": estimate, "ci_low": low, "ci_high": high}
        for estimate, low, high in zip(*ends, strict=True)
    ]
