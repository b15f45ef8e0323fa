"""What indices say of a factor without effect, and which factors may be called negligible.

Catches a factor called negligible, or important, by noise alone.
"""

from collections.abc import Sequence

import numpy as np
import pytest
from known_indices import FUNCTIONS

from spinepipe.sensitivity_analysis.global_indices.design import DUMMY, draw
from spinepipe.sensitivity_analysis.global_indices.estimates import SensitivityIndex, Settings
from spinepipe.sensitivity_analysis.global_indices.floor import (
    REPLICATES,
    Floor,
    above_floor,
    noise_floor,
)
from spinepipe.sensitivity_analysis.global_indices.indices import indices

ISHIGAMI, G = FUNCTIONS["ishigami"], FUNCTIONS["g"]
NAMES = (*ISHIGAMI.factors, "inert")
RESOLUTION = 1e-3
"""How far two runs of the same input lie apart at most, where a solver is imitated."""

Names = dict[tuple[str, str], SensitivityIndex]


def analysed(
    method: str, samples: int, seed: int, wanted: Sequence[str], scatter: float = 0.0
) -> tuple[Names, dict[str, Floor]]:
    """Indices of Ishigami's function and their floors, with a solver's scatter."""
    design = draw(method, NAMES, samples, seed, dummy=True)
    off = np.random.default_rng(seed).uniform(-scatter / 2, scatter / 2, design.n)
    outputs = (ISHIGAMI.values(design.unit[:, :3]) + off)[:, None]
    settings = Settings(bootstraps=20, delta_bootstraps=5, seed=seed, wanted=tuple(wanted))
    found = indices(design, outputs, settings=settings, resolution=scatter)
    floors = noise_floor(design, outputs, found, settings=settings, resolution=scatter)
    return {(i.index, i.factor): i for i in found if not i.other}, floors


CASES = [
    ("latin_hypercube", 200, ("PAWN", "S1_RBD", "KS_high")),
    ("fast", 1025, ("S1", "ST")),
    ("sobol", 64, ("S1", "ST")),
    ("morris", 20, ("mu", "mu_star", "sigma")),
]


@pytest.mark.parametrize(("method", "samples", "wanted"), CASES)
def test_a_floor_is_an_interval_above_nothing_and_below_what_matters(
    method: str, samples: int, wanted: tuple[str, ...]
) -> None:
    found, floors = analysed(method, samples, 3, wanted, 1e-6)
    for name in wanted:
        low, high = floors[name].low[0], floors[name].high[0]
        assert low < high, name
        assert high > 0.0, name
        assert floors[name].replicates > 8
    strongest = {"mu_star": "x2", "S1_RBD": "x2", "PAWN": "x2"}
    for name in set(wanted) - {"mu"}:
        assert above_floor(found[name, strongest.get(name, "x1")], floors) == (True,), name


def test_what_a_solver_leaves_open_is_the_floor_of_repeated_runs() -> None:
    """Repetitions off by u within +-r: ST has mean r^2 / 6 over the variance, S1 mean 0.

    Var(u) = r^2 / 3; ST is half the mean square of the difference over the variance.
    """
    design = draw("sobol", NAMES, 256, 1, dummy=True)
    outputs = ISHIGAMI.values(design.unit[:, :3])[:, None]
    found = indices(design, outputs, resolution=RESOLUTION)
    floors = noise_floor(design, outputs, found, resolution=RESOLUTION)
    variance = 0.5 + 49.0 / 8.0 + 0.1 * np.pi**4 / 5.0 + 0.01 * np.pi**8 / 18.0
    middle = 0.5 * (floors["ST"].low[0] + floors["ST"].high[0])
    assert middle == pytest.approx(RESOLUTION**2 / 6.0 / variance, rel=0.1)
    half = 1.96 * RESOLUTION / np.sqrt(3.0 * 256.0 * variance)
    assert floors["S1"].high[0] == pytest.approx(half, rel=0.25)
    assert floors["S1"].low[0] == pytest.approx(-half, rel=0.25)
    assert floors["S1"].replicates == REPLICATES


def test_a_floor_of_pairs_holds_all_of_the_dummy_s() -> None:
    design = draw("sobol", G.factors, 64, 5, dummy=True)
    outputs = G.values(design.unit[:, :6])[:, None]
    found = indices(design, outputs, settings=Settings(bootstraps=20))
    floor = noise_floor(design, outputs, found)["S2"]
    pairs = [i for i in found if i.index == "S2" and DUMMY in (i.factor, i.other)]
    assert floor.replicates == len(pairs) == 6
    assert floor.high[0] == max(pair.high[0] for pair in pairs) > 0.0
    assert floor.low[0] == min(pair.low[0] for pair in pairs)


def test_delta_has_a_floor_too_and_without_a_dummy_there_is_none() -> None:
    found, floors = analysed("latin_hypercube", 200, 2, ("delta",))
    assert floors["delta"].low[0] < floors["delta"].high[0] < found["delta", "x1"].estimate[0]
    design = draw("latin_hypercube", NAMES, 100, 2)
    outputs = ISHIGAMI.values(design.unit[:, :3])[:, None]
    bare = indices(design, outputs, settings=Settings(bootstraps=20, wanted=("PAWN",)))
    assert noise_floor(design, outputs, bare) == {}
    assert above_floor(bare[0], {}) == (None,)


def test_outputs_without_an_index_have_no_floor_and_failed_runs_no_part_in_it() -> None:
    design = draw("latin_hypercube", NAMES, 100, 2, dummy=True)
    first = ISHIGAMI.values(design.unit[:, :3])
    outputs = np.column_stack([first, np.full(100, 7.0)])
    ok = np.ones(100, dtype=bool)
    outputs[:5], ok[:5] = np.nan, False
    settings = Settings(bootstraps=20, wanted=("PAWN",))
    found = indices(design, outputs, ok, settings)
    floor = noise_floor(design, outputs, found, ok, settings)["PAWN"]
    assert floor.high.tolist()[1] is None
    assert 0.0 < floor.low.tolist()[0] < floor.high.tolist()[0] < 1.0
