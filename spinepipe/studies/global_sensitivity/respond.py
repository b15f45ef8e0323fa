"""Job: motion and joint loads of one specimen in one batch of samples, in all tests."""

import sys
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spinepipe.jobs.inputs import study_of_kind
from spinepipe.statics.batched import ManySolved, solve_many
from spinepipe.status import Status
from spinepipe.studies.global_sensitivity.batch import Batch, batch_of, made_of_batches
from spinepipe.studies.global_sensitivity.settings import GlobalSensitivity
from spinepipe.studies.global_sensitivity.tables import RESPONSES
from spinepipe.studies.selected_tests import SelectedTest
from spinepipe.tables import to_arrow, write
from spinepipe.units import COORDINATE_COLUMNS, from_si, subtract_baseline

HANDED_OVER = "share_by_engine_of_record"
"""In a file's metadata: runs whose stability nothing simpler proves."""

LOADS = tuple(c.name for c in RESPONSES.columns if c.name.startswith("load_"))


def run(
    root: str,
    study: str,
    design: str,
    specimen: str,
    parts: Mapping[str, Mapping[str, str]],
    base: Sequence[str] = (),
) -> None:
    """Write a file of each batch: sample by sample, test by test, step by step, joint by joint.

    Parameters
    ----------
    base : file of the specimen's fitted stiffness, where factors start from it.
    """
    settings, cohort = study_of_kind(GlobalSensitivity, root, study)
    made_by = made_of_batches("respond", settings, cohort, specimen, design, base)
    every = settings.steps == "all"
    for path, place in parts.items():
        one = batch_of(root, settings, cohort, design, base, specimen, int(place["batch"]), every)
        columns, by_engine = responses(one, cohort.joint_names)
        handed = {HANDED_OVER: f"{by_engine.sum() / max(len(by_engine), 1):.4f}"}
        if by_engine.any():
            print(
                f"{study}: {specimen}, batch {place['batch']}: {by_engine.sum()} of "
                f"{len(by_engine)} runs left to the engine of record",
                file=sys.stderr,
            )
        write(to_arrow(RESPONSES, columns, specimen=specimen), path, made_by | handed)


def responses(batch: Batch, joints: Sequence[str]) -> tuple[dict[str, Any], NDArray[np.bool_]]:
    """Columns of the table ``responses`` of a batch, and which runs the engine of record solved."""
    asked = tuple(zip(batch.varied.cases, batch.start.tests, strict=True))
    found = [solve_many(batch.varied.spines, cases, test.needed) for cases, test in asked]
    solved = [_rows(batch, *both) for both in zip(batch.start.tests, found, strict=True)]
    by_engine = np.concatenate([many.by_engine for many in found])
    return _columns(batch, joints, solved), by_engine


class _Rows:
    """What a test gives for M samples, T stored steps and J joints.

    ``motion``, ``load`` : (M, T, J, 6) mm and deg, N and N m, NaN without equilibrium.
    ``status``, ``message`` : (M, T).
    """

    def __init__(self, batch: Batch, test: SelectedTest, joints: int) -> None:
        self.test = test
        shape = (batch.count, len(test.steps))
        self.motion, self.load = np.full((2, *shape, joints, 6), np.nan)
        self.status = np.full(shape, Status.REFUSED.value, dtype=object)
        self.message = np.full(shape, "", dtype=object)
        for sample, reason in batch.varied.refused.items():
            self.message[sample] = reason


def _rows(batch: Batch, test: SelectedTest, solved: ManySolved) -> _Rows:
    rows = _Rows(batch, test, solved.q.shape[2])
    motion = subtract_baseline(solved.q.swapaxes(0, 1), test.from_first).swapaxes(0, 1)
    kept, stored = batch.varied.kept, slice(-len(test.steps), None)
    rows.motion[kept] = from_si(motion)[:, stored]
    rows.load[kept] = solved.load[:, stored]
    rows.status[kept] = solved.status[:, stored].astype(object)
    words = np.full(solved.status.shape, "", dtype=object)
    for place, message in solved.messages.items():
        words[place] = message
    rows.message[kept] = words[:, stored]
    return rows


def _columns(batch: Batch, joints: Sequence[str], tests: Sequence[_Rows]) -> dict[str, Any]:
    steps = [(one.test.case.test, step) for one in tests for step in one.test.steps]
    per_sample, each = len(steps) * len(joints), len(joints)
    motion, load = (
        np.concatenate([getattr(one, name) for one in tests], axis=1).reshape(-1, 6).T
        for name in ("motion", "load")
    )
    told = {
        name: np.repeat(np.concatenate([getattr(one, name) for one in tests], axis=1), each)
        for name in ("status", "message")
    }
    numbers = np.arange(batch.first, batch.first + batch.count)
    return {
        "sample": np.repeat(numbers, per_sample),
        "test": [test for test, _ in steps for _ in joints] * batch.count,
        "step": [step for _, step in steps for _ in joints] * batch.count,
        "joint": list(joints) * (len(steps) * batch.count),
        **dict(zip([f"predicted_{name}" for name in COORDINATE_COLUMNS], motion, strict=True)),
        **dict(zip(LOADS, load, strict=True)),
        **told,
    }
