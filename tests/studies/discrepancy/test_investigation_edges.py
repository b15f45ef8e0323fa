"""Searches of cohorts at the edge: little was measured, something is missing, bases of all kinds.

Catches a search that ends in a traceback or in NaN where data are few, a noise that takes the
subtracted step or unequal loads for scatter, a base that loses what its model file says.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow.compute as pc
import pyarrow.parquet as pq
import pytest
from chain_cases import DEGREES, JOINTS, MILLIMETRES, STUDY, Chains
from discrepancy_cases import files_of_a_search

from spinepipe.model.file import EffectEntry, ModelFile, Values, read_model, write_model
from spinepipe.studies.discrepancy import job as search
from spinepipe.studies.discrepancy.kind import KIND
from spinepipe.units import STIFFNESS_COLUMNS

pytestmark = pytest.mark.slow

STIFFNESS = np.array([50.0, 60.0, 200.0])
NOISE_DEG = 0.1
RATE = 8.0
"""1/rad, of the stiffening that some of the cohorts have."""

FLEXES = "extension_deg"
PER_SPECIMEN = "base: {stiffness: per_specimen}\n"
FEW = "effects: [load_offset, neutral_zone, nonlinear_stiffening]\n"
SMALL: dict[str, Any] = {
    "tests": ("flexion", "left_lateral_bending"),
    "cycles": 3,
    "steps": 6,
    "step_nm": 1.4,
}
SPECIMENS = {"a": 1.0, "b": 1.2}
"""Names, and how much stiffer they are."""

ONE = {"a": 1.0}


def stiffening(linear_deg: pd.Series) -> pd.Series:
    """Angles at which ``k (exp(rate q) - 1) / rate`` carries what turned springs k by these."""
    turned = np.deg2rad(linear_deg)
    return np.rad2deg(np.sign(turned) * np.log1p(RATE * np.abs(turned)) / RATE)


def chains(
    specimens: Mapping[str, float] = SPECIMENS,
    stiffens: bool = False,
    by_joint: tuple[float, ...] = (1.0, 1.0, 1.0),
    **choices: Any,
) -> Chains:
    """Straight chains in pure moments up to 7 N m, three cycles, with noise.

    Parameters
    ----------
    stiffens : whether their resistance to flexion grows with it.
    """
    stiffness = {name: k * np.outer(by_joint, STIFFNESS) for name, k in specimens.items()}
    made = Chains(stiffness, **(SMALL | choices))
    columns = list(DEGREES)
    if stiffens:
        made.motion[FLEXES] = stiffening(made.motion[FLEXES])
    return noisy(made, columns)


def noisy(made: Chains, columns: list[str]) -> Chains:
    rng = np.random.default_rng(0)
    made.motion[columns] += NOISE_DEG * rng.normal(size=made.motion[columns].shape)
    if made.zeroed:
        keys = ["specimen", "test", "cycle", "joint"]
        made.motion[columns] -= made.motion.groupby(keys)[columns].transform("first")
    return made


def no_constant(name: str) -> float:
    raise AssertionError(f"{name} in a verdict")


def searched(made: Chains, root: Path, study: str = PER_SPECIMEN) -> dict[str, Any]:
    """The verdict, after a look at every number of every file."""
    made.study = study
    made.write(root)
    head = f"study: {STUDY}\nkind: discrepancy\ncohort: chains\n"
    (root / f"config/studies/{STUDY}.yaml").write_text(head + study + FEW)
    folder = root / "results" / STUDY / "discrepancy"
    folder.mkdir(parents=True)
    search.run(str(root), STUDY, **files_of_a_search(folder))
    for table in KIND.tables:
        assert_no_nan(folder / f"{table.name}.parquet")
    for name in ("model_base", "model_with_effects"):
        read_model(folder / f"{name}.yaml")
    text = (folder / "verdict.json").read_text()
    found: dict[str, Any] = json.loads(text, parse_constant=no_constant)
    return found


def assert_no_nan(path: Path) -> None:
    table = pq.read_table(path)
    for name in table.column_names:
        if table[name].type in ("double", "float"):
            assert not pc.any(pc.is_nan(table[name].drop_null())).as_py(), f"{path.stem}: {name}"


def told(verdict: Mapping[str, Any]) -> set[str]:
    """All effects that a verdict speaks of."""
    return {one["name"] for one in verdict["effects"]} | set(verdict["candidates_in_set"])


def assert_nothing_missing(verdict: Mapping[str, Any]) -> None:
    assert (verdict["verdict"], told(verdict)) == ("NULL", set()), verdict["why"]
    assert verdict["gap"]["base"] < 0.6
    assert verdict["suspected_data_errors"] == []


def assert_stiffening_seen(verdict: Mapping[str, Any]) -> None:
    assert verdict["verdict"] in ("NAMED", "SET"), verdict["why"]
    assert "nonlinear_stiffening" in told(verdict)
    assert told(verdict) <= {"nonlinear_stiffening", "neutral_zone"}
    assert verdict["gap"]["base"] > 0.3


def test_one_test_of_one_specimen(tmp_path: Path) -> None:
    only = {"tests": ("flexion",)}
    assert_nothing_missing(searched(chains(ONE, **only), tmp_path / "springs"))
    assert_stiffening_seen(searched(chains(ONE, stiffens=True, **only), tmp_path / "stiffens"))


def test_without_repeats_noise_is_as_declared_and_said_so(tmp_path: Path) -> None:
    verdict = searched(chains(ONE, cycles=1), tmp_path / "springs")
    assert_nothing_missing(verdict)
    assert verdict["noise"]["source"] == "declared"
    assert NOISE_DEG <= verdict["noise"]["rotation_sd_deg"] <= 1.5 * NOISE_DEG


def with_translations(made: Chains) -> Chains:
    """Of L4L5 translations alone, of the others rotations alone; no moment translates a joint."""
    blind = made.motion["joint"] == JOINTS[1]
    rng = np.random.default_rng(6)
    for name in MILLIMETRES:
        made.motion[name] = np.where(blind, 0.1 * rng.normal(size=len(made.motion)), np.nan)
    made.motion.loc[blind, list(DEGREES)] = np.nan
    return made


def test_a_joint_with_translations_alone(tmp_path: Path) -> None:
    verdict = searched(with_translations(chains()), tmp_path)
    assert_nothing_missing(verdict)
    assert verdict["noise"]["translation_sd_mm"] == pytest.approx(0.1, rel=0.15)


def without_joint(made: Chains) -> Chains:
    made.motion = made.motion[made.motion["joint"] != JOINTS[1]]
    return made


def test_a_joint_without_any_reading(tmp_path: Path) -> None:
    base = "base: {stiffness: per_joint}\n"
    assert_nothing_missing(searched(without_joint(chains(ONE)), tmp_path, base))


def test_zeroed_readings_of_loud_declaration(tmp_path: Path) -> None:
    """Noise of the subtracted step is in all others: it must not pass for more noise.

    Repeats tell it, whatever is declared.
    """
    loud = PER_SPECIMEN + "measurement_sd: {rotation_deg: 0.9, translation_mm: 0.9}\n"
    verdict = searched(chains(ONE, zeroed=True), tmp_path, loud)
    assert_nothing_missing(verdict)
    assert verdict["noise"]["source"] == "repeats"
    assert verdict["noise"]["rotation_sd_deg"] == pytest.approx(NOISE_DEG, rel=0.1)


def unequal(made: Chains) -> Chains:
    """Loads of the cycles 0.94, 1 and 1.06 times as large, and linear motion with them."""
    for table, columns in (
        (made.loads, ["mx_nm", "my_nm", "mz_nm"]),
        (made.motion, list(DEGREES)),
    ):
        table[columns] = table[columns].mul(1.0 + 0.06 * (table["cycle"] - 2), axis=0)
    return made


def test_cycles_of_unequal_loads_tell_the_noise_too(tmp_path: Path) -> None:
    """Their motion differs by up to 1 deg, of which the loads are to blame; no noise declared."""
    stiffness = {name: k * np.outer(np.ones(3), STIFFNESS) for name, k in SPECIMENS.items()}
    made = unequal(Chains(stiffness, **SMALL, sd=False))
    verdict = searched(noisy(made, list(DEGREES)), tmp_path)
    assert_nothing_missing(verdict)
    assert verdict["noise"]["source"] == "repeats"
    assert verdict["noise"]["rotation_sd_deg"] == pytest.approx(NOISE_DEG, rel=0.1)
    assert abs(verdict["noise"]["serial_correlation"]) < 0.2


LEVELS = (0.7, 1.0, 1.4)


def bushings(path: Path) -> str:
    """A model file with the joints' ratios, but twice too stiff; the study's line."""
    rows = []
    for joint, ratio in zip(JOINTS, LEVELS, strict=True):
        k = 2.0 * ratio * STIFFNESS
        rows.append(Values(joint=joint, **dict(zip(STIFFNESS_COLUMNS[3:], k, strict=True))))
    entry = EffectEntry(effect="linear_bushing", values=tuple(rows))
    path.parent.mkdir(parents=True, exist_ok=True)
    write_model(ModelFile(model="m", cohort="chains", effects=(entry,)), path)
    return f"base: {{model: {path.name}}}\n"


def test_a_base_from_a_model_file_keeps_the_ratios_of_its_joints(tmp_path: Path) -> None:
    base = bushings(tmp_path / "model.yaml")
    assert_nothing_missing(searched(chains(ONE, by_joint=LEVELS), tmp_path, base))


def test_a_base_from_a_model_file_may_have_the_effect(tmp_path: Path) -> None:
    """With what stiffens in the base, nothing is missing any more."""
    base = bushings(tmp_path / "model.yaml")
    file = read_model(tmp_path / "model.yaml")
    own = EffectEntry(effect="nonlinear_stiffening", values=(Values(rate=RATE),))
    update = {"effects": (*file.effects, own)}
    write_model(file.model_copy(update=update), tmp_path / "model.yaml")
    made = chains(ONE, by_joint=LEVELS, stiffens=True)
    assert_nothing_missing(searched(made, tmp_path, base))
