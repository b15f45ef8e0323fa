"""Ishigami's function in the place of the engine: the jobs' indices beside the closed form.

Everything but the solve is the product's: the design, batches, tables, indices and convergence.
Ishigami & Homma 1990, a = 7, b = 0.1. What would be caught: values, samples or factors that
change places between the jobs; the estimators by themselves are looked at in
`tests/unit/test_global_indices`.
"""

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from known_indices import ishigami, morris_truth
from lever import tables_of, write_lever
from small_project import Project

from spinepipe.jobs.digest import mark_of, provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.studies.global_sensitivity.settings import GlobalSensitivity
from spinepipe.studies.global_sensitivity.tables import RESPONSES
from spinepipe.tables import to_arrow, write

pytestmark = [pytest.mark.slow, pytest.mark.full]

Computed = dict[str, dict[str, pd.DataFrame]]

SAMPLES = {"sobol": 1024, "fast": 2048, "morris": 500}
NAMES = {"load_point_x": "x1", "load_point_y": "x2", "load_point_z": "x3"}

STUDY = """\
study: {method}
kind: global_sensitivity
cohort: lever
specimens: [a]
factors:
  - {{of: load_point, axis: x, offset_mm: {{low: -3.141592653589793, high: 3.141592653589793}}}}
  - {{of: load_point, axis: y, offset_mm: {{low: -3.141592653589793, high: 3.141592653589793}}}}
  - {{of: load_point, axis: z, offset_mm: {{low: -3.141592653589793, high: 3.141592653589793}}}}
design: {{method: {method}, samples: {samples}}}
outputs: {{motion: [extension], joint_load: []}}
"""


def in_place_of_a_solve(
    root: str,
    study: str,
    design: str,
    specimen: str,
    parts: dict[str, dict[str, str]],
    base: list[str],
) -> None:
    """Ishigami's function of the first three factors."""
    settings, cohort = study_of_kind(GlobalSensitivity, root, study)
    size = settings.batch_size(1)
    values = pq.read_table(design).column("value").to_numpy().reshape(settings.n_runs, -1)
    read = [mark_of(path) for path in (design, *base)]
    known = provenance("respond", settings, cohort, [specimen], [str(size), *read])
    for output, place in parts.items():
        write(_responses(values, size, int(place["batch"])), output, known)


def _responses(values: np.ndarray, size: int, batch: int) -> pa.Table:
    part = values[batch * size : (batch + 1) * size]
    x, y, z = part[:, :3].T
    table = RESPONSES.without("specimen")
    columns = {column.name: [0.0] * len(part) for column in table.columns}
    columns.update(
        sample=[batch * size + number for number in range(len(part))],
        test=["push"] * len(part),
        step=[1] * len(part),
        joint=["V1V2"] * len(part),
        predicted_extension_deg=np.sin(x) + 7.0 * np.sin(y) ** 2 + 0.1 * z**4 * np.sin(x),
        status=["converged"] * len(part),
        message=[""] * len(part),
    )
    return to_arrow(table, columns)


@pytest.fixture(scope="module")
def computed(tmp_path_factory: pytest.TempPathFactory) -> Computed:
    """Tables of a study by each method."""
    root = tmp_path_factory.mktemp("ishigami")
    write_lever(Project(root))
    for method, samples in SAMPLES.items():
        text = STUDY.format(method=method, samples=samples)
        (root / f"config/studies/{method}.yaml").write_text(text)
    return {name: tables_of(root, name, in_place_of_a_solve) for name in SAMPLES}


def beside_truth(rows: pd.DataFrame, truth: dict[tuple[str, str, str], float]) -> pd.DataFrame:
    """Rows of known indices, with the column ``truth``."""
    named = [
        truth.get((row.index_, NAMES.get(row.factor, ""), NAMES.get(row.other, "")))
        for row in rows.rename(columns={"index": "index_"}).itertuples()
    ]
    return rows.assign(truth=named).dropna(subset=["truth"])


def test_sobol_indices_are_ishigami_s(computed: Computed) -> None:
    rows = beside_truth(computed["sobol"]["indices"], ishigami().truth)
    assert len(rows) == 9  # S1 and ST of three factors, three pairs
    assert (rows["estimate"] - rows["truth"]).abs().max() < 0.05
    inside = (rows["ci_low"] <= rows["truth"]) & (rows["truth"] <= rows["ci_high"])
    assert inside.sum() >= 8  # of nine intervals of 95 %


def test_fast_indices_are_ishigami_s(computed: Computed) -> None:
    rows = beside_truth(computed["fast"]["indices"], ishigami().truth)
    assert len(rows) == 6
    assert (rows["estimate"] - rows["truth"]).abs().max() < 0.05


def test_elementary_effects_are_ishigami_s(computed: Computed) -> None:
    rows = beside_truth(computed["morris"]["indices"], morris_truth(ishigami()))
    assert len(rows) == 9
    assert (rows["estimate"] - rows["truth"]).abs().max() < 0.08 * rows["truth"].max()


def test_the_factor_that_changes_nothing_is_at_the_floor(computed: Computed) -> None:
    rows = computed["sobol"]["indices"]
    total = rows[rows["index"] == "ST"].set_index("factor")
    assert total.loc["dummy", "estimate"] == pytest.approx(0.0, abs=1e-12)
    assert not total.loc["dummy", "above_floor"]
    assert total.loc["dummy", "negligible"]
    assert not total.loc[list(NAMES), "negligible"].any()
    assert (total["noise_floor_low"] > 0.0).all()
    assert (total["noise_floor_low"] < total["noise_floor"]).all()
    assert (total["noise_floor"] < 1e-9).all(), "the solver's 1e-6 deg beside a variance of 14"
    assert total.loc[list(NAMES), "above_floor"].all()


def test_estimates_settle_with_the_size_of_the_design(computed: Computed) -> None:
    grown = computed["sobol"]["convergence"]
    x2 = grown[(grown["factor"] == "load_point_y") & (grown["index"] == "S1")]
    width = (x2["ci_high"] - x2["ci_low"]).to_numpy()
    order = x2["runs"].to_numpy().argsort()
    assert x2["runs"].max() == 1024 * (2 * 4 + 2)
    assert width[order][-1] < 0.5 * width[order][0]
