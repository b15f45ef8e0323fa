"""The shipped cohort ``tracking_phantom`` and what makes it: reproduced, apart from spinepipe,
and moved as mechanics wants it.

Catches shipped data that their generator no longer makes, and a generator that uses the library.
"""

import ast
from functools import cache
from pathlib import Path

import mujoco
import numpy as np
import pandas as pd
import pytest
import yaml

from spinepipe.motion.passive import PassiveLaw, passive_elements
from tests.generators.tracking.engine import built
from tests.generators.tracking.laws import KNOTS_RAD, curves, plain_curves, resisted, stiffness
from tests.generators.tracking.moved import Filmed, Motion, moved
from tests.generators.tracking.person import drawn
from tests.generators.tracking.rows import FILES, told_rows, true_passive, true_places
from tests.generators.tracking.seen import Errors, seen
from tests.generators.tracking.write import Subject, Wanted, trc

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "config" / "cohorts" / "tracking_phantom"
GENERATOR = ROOT / "tests" / "generators" / "tracking"
SHIPPED = Wanted(2021, "muscles", 3, rate_hz=25.0)
LUMBAR = ("L1", "S1")

ENGINE_MM, ENGINE_DEG = 0.05, 0.02
"""Processors round differently, and a simulation goes on from what was rounded."""


@cache
def subject(number: int) -> Subject:
    return Subject(SHIPPED, number)


def truth() -> pd.DataFrame:
    return pd.read_csv(FOLDER / "truth_centres.csv")


def test_the_generator_knows_nothing_of_spinepipe() -> None:
    for path in GENERATOR.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            names = [alias.name for alias in getattr(node, "names", [])]
            names += [getattr(node, "module", None) or ""]
            if isinstance(node, ast.Import | ast.ImportFrom):
                assert not any(name.split(".")[0] == "spinepipe" for name in names), path.name


def test_the_folder_names_its_command_and_is_small() -> None:
    text = yaml.safe_load((FOLDER / "cohort.yaml").read_text())
    assert SHIPPED.command in text["source"]
    assert sum(path.stat().st_size for path in FOLDER.rglob("*")) < 1.3e6
    assert not (FOLDER / "hidden").exists()


@pytest.mark.parametrize("number", range(3))
def test_what_is_told_is_written_again(number: int) -> None:
    one = subject(number)
    made: dict[str, list[dict[str, object]]] = {}
    for table, row in told_rows(one.name, one.person, one.told, one.markers):
        made.setdefault(table, []).append(row)
    for table, rows in made.items():
        shipped = pd.read_csv(FOLDER / f"{table}.csv", keep_default_na=False)
        shipped = shipped[shipped["specimen"] == one.name].reset_index(drop=True)
        again = pd.DataFrame(rows).astype(shipped.dtypes.to_dict())
        pd.testing.assert_frame_equal(shipped, again[list(FILES[table])], atol=2e-3)


def test_a_trial_is_moved_and_seen_again(tmp_path: Path) -> None:
    taken = subject(0).taken("stance")
    trc(tmp_path / "s01_stance.trc", taken)
    shipped, again = (_numbers(folder / "s01_stance.trc") for folder in (FOLDER, tmp_path))
    np.testing.assert_array_equal(np.isnan(shipped), np.isnan(again))
    np.testing.assert_allclose(shipped, again, atol=ENGINE_MM)
    rows = pd.DataFrame(true_places("s01", "stance", taken.person, taken.motion))
    there = truth().query("specimen == 's01' and trial == 'stance'")
    for column in there.columns[4:]:
        apart = ENGINE_MM if column.endswith("mm") else ENGINE_DEG
        np.testing.assert_allclose(there[column], rows[column].astype(float), atol=apart)


def _numbers(path: Path) -> np.ndarray:
    lines = [line.split("\t") for line in path.read_text().splitlines()[6:]]
    return np.array([[float(cell) if cell else np.nan for cell in line] for line in lines])


def test_shipped_people_bend_as_people_do() -> None:
    """Volunteers bend 40 to 65 deg between T1 and the pelvis, most of it in the lumbar spine."""
    turns = truth().pivot_table(
        "extension_deg", ["specimen", "trial", "time_s"], "vertebra", sort=False
    )
    for specimen in ("s01", "s02", "s03"):
        bend = turns.loc[specimen, "flexion_extension"]
        bend = bend - bend.iloc[0]
        whole = (bend["T1"] - bend["S1"]).to_numpy()
        most = np.abs(whole).argmax()
        assert -65.0 < whole[most] < -38.0
        lumbar = (bend["T12"] - bend["S1"]).to_numpy()[most] / whole[most]
        assert 0.5 < lumbar < 0.9


@cache
def quick(generator: str) -> tuple[mujoco.MjModel, Motion]:
    """A bend in two seconds, seen 500 times a second."""
    person = drawn(np.random.default_rng(3), False, "hanging")
    motion = moved(
        person, "flexion_extension", generator, np.random.default_rng(4), Filmed(500.0, 2.0)
    )
    return built(person, generator == "muscles"), motion


@pytest.mark.parametrize("generator", ["torques", pytest.param("muscles", marks=pytest.mark.full)])
def test_loads_of_the_motion_are_those_that_moved_it(generator: str) -> None:
    """By the engine's inverse dynamics of the written motion; its damping is its own.

    Two hundredths: implicit steps of half a millisecond, and accelerations by differences.
    """
    model, motion = quick(generator)
    data = mujoco.MjData(model)
    acceleration = np.gradient(motion.speed, motion.time_s, axis=0)
    applied = motion.active - motion.passive
    largest = np.abs(applied[..., 3:]).max()
    assert largest > 20.0
    for k in range(100, len(motion.time_s) - 100, 50):
        data.qpos[:], data.qvel[:] = motion.q[k].ravel(), motion.speed[k].ravel()
        data.qacc[:] = acceleration[k].ravel()
        mujoco.mj_inverse(model, data)
        asked = data.qfrc_inverse[6:].reshape(17, 6)
        np.testing.assert_allclose(asked[:, 3:], applied[k, :, 3:], atol=0.02 * largest)


def test_drawn_curves_rise_and_are_no_exponentials() -> None:
    table = curves(np.random.default_rng(5))
    assert (np.diff(table, axis=-1) >= 0.0).all()
    middle = len(KNOTS_RAD) // 2
    np.testing.assert_allclose(table[..., middle], 0.0, atol=1e-9)
    # of an exponential, stiffness rises in a straight line with the moment
    rest, low, high = (stiffness(table, moment) for moment in (0.0, 3.0, 6.0))
    bent = np.abs((high - low) / (low - rest) - 1.0)
    assert np.median(bent) > 0.2


def test_the_table_of_the_control_is_its_law() -> None:
    rows = pd.DataFrame(true_passive(7))
    rows[["a", "b", "lower", "upper"]] = rows[["a", "b", "lower", "upper"]].astype(float)
    told = passive_elements(rows)
    angles = np.random.default_rng(8).normal(0.0, 0.06, (20, 17, 3))
    q = np.zeros((20, 17, 6))
    q[..., 3:], q[..., :3] = angles, 1e-3
    forces = PassiveLaw(told.a, told.b).forces(q)
    table = plain_curves(7)
    expected = np.array([resisted(table, one) for one in angles])
    np.testing.assert_allclose(forces[..., 3:], expected, rtol=2e-3, atol=5e-3)
    np.testing.assert_allclose(forces[0, 0, :3], [250.0, 800.0, 250.0], rtol=1e-3)


def test_skin_slides_with_the_bend_and_late() -> None:
    _, motion = quick("torques")
    one = Subject(Wanted(1, "torques", 1), 0)
    still = Errors(noise_mm=0.0)
    places = seen(motion, one.markers, np.random.default_rng(0), still)
    at = motion.places[:, one.markers.body]
    local = np.einsum("fkji,fkj->fki", motion.turns[:, one.markers.body], places - at)
    slid = 1e3 * np.linalg.norm(local - one.markers.at, axis=2)
    spine = one.markers.body > 0
    most = np.nanmax(slid[:, spine], axis=0)
    assert most.min() > 9.0
    assert most.max() < 21.0
    late = np.nanargmax(slid[:, spine], axis=0) > motion.bent.argmax()
    assert late.all()
