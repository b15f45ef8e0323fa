"""How often 95 % intervals of sensitivity indices hold what is known, over redrawn designs."""

import warnings
from collections.abc import Sequence

import numpy as np
import pandas as pd
from SALib.analyze import fast

from spinepipe.sensitivity_analysis.global_indices.design import Design, draw
from spinepipe.sensitivity_analysis.global_indices.estimates import SensitivityIndex, Settings
from spinepipe.sensitivity_analysis.global_indices.indices import indices
from tests.cases.known_indices import FUNCTIONS, KnownFunction, morris_truth

SEEDS = 40
SAMPLES = {
    "sobol": (64, 256, 1024),
    "latin_hypercube": (256, 1024),
    "morris": (10, 20, 50),
    "fast": (513, 1025),
}
IN_THE_MEAN = ("PAWN", "KS_low", "KS_high", "delta")
"""Indices that are compared with their mean over seeds: other points, as many."""

Truth = dict[tuple[str, str, str], float]
KEYS = ["method", "function", "samples", "index", "compared_with"]


def table(
    seeds: Sequence[int] = range(SEEDS),
    samples: dict[str, tuple[int, ...]] = SAMPLES,
    bootstraps: int = 1000,
) -> pd.DataFrame:
    """Coverage by method, function, number of samples and index.

    `worst_index_percent` is the coverage of the factor or pair that is held least often.
    """
    rows = []
    for method, sizes in samples.items():
        for name, function in FUNCTIONS.items():
            for size in sizes:
                found = _rows(method, function, size, seeds, bootstraps)
                rows.append(found.assign(method=method, function=name, samples=size))
                print(f"index coverage: {method}, {name}, {size} samples", flush=True)
    return _summary(_against_the_mean(pd.concat(rows, ignore_index=True)))


def _rows(
    method: str, function: KnownFunction, samples: int, seeds: Sequence[int], bootstraps: int
) -> pd.DataFrame:
    """A row of each index and seed, with its truth where one is known."""
    truth = morris_truth(function) if method == "morris" else _truth(function)
    found = []
    for seed in seeds:
        design = draw(method, function.factors, samples, seed)
        settings = Settings(bootstraps=bootstraps, seed=seed)
        outputs = function.values(design.unit)
        given = indices(design, outputs[:, None], settings=settings)
        found += [_row(index, seed, truth) for index in given if method != "fast"]
        if method == "fast":
            found += _salib_fast(design, outputs, seed, truth)
    return pd.DataFrame(found)


def _truth(function: KnownFunction) -> Truth:
    first = {("S1_RBD", *key[1:]): v for key, v in function.truth.items() if key[0] == "S1"}
    return {**function.truth, **first}


def _row(index: SensitivityIndex, seed: int, truth: Truth) -> dict[str, object]:
    key = (index.index, index.factor, index.other)
    ends = {"low": index.low.item(), "high": index.high.item()}
    return _named(key, seed, truth) | ends | {"estimate": index.estimate.item()}


def _named(key: tuple[str, str, str], seed: int, truth: Truth) -> dict[str, object]:
    known = "mean of estimates" if key[0] in IN_THE_MEAN else "truth"
    names = {"index": key[0], "factor": key[1], "other": key[2], "compared_with": known}
    return names | {"seed": seed, "truth": truth.get(key, np.nan)}


def _salib_fast(
    design: Design, outputs: np.ndarray, seed: int, truth: Truth
) -> list[dict[str, object]]:
    """SALib's own intervals of FAST, which spinepipe does not give out."""
    d = len(design.factors)
    problem = {"num_vars": d, "names": list(design.factors), "bounds": [[0.0, 1.0]] * d}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        found = fast.analyze(problem, outputs, M=design.harmonics, seed=seed + 1)
    rows = []
    for index in ("S1", "ST"):
        for at, factor in enumerate(design.factors):
            estimate, reach = found[index][at], found[f"{index}_conf"][at]
            ends = {"low": estimate - reach, "high": estimate + reach, "estimate": estimate}
            rows.append(_named((index, factor, ""), seed, truth) | ends)
    return [row | {"compared_with": "truth (SALib's interval, not given out)"} for row in rows]


def _against_the_mean(rows: pd.DataFrame) -> pd.DataFrame:
    one = ["method", "function", "samples", "index", "factor", "other"]
    means = rows.groupby(one)["estimate"].transform("mean")
    return rows.assign(truth=rows["truth"].fillna(means))


def _summary(rows: pd.DataFrame) -> pd.DataFrame:
    """A row of each kind; an end that misses by rounding alone holds."""
    slack = 1e-9 * np.maximum(1.0, rows["truth"].abs())
    inside = rows["truth"].between(rows["low"] - slack, rows["high"] + slack)
    rows = rows.assign(inside=inside, width=rows["high"] - rows["low"])
    rows["off"] = rows["estimate"] - rows["truth"]
    found = []
    for key, part in rows.groupby(KEYS, sort=False):
        each = part.groupby(["factor", "other"])["inside"].mean()
        found.append(
            {
                **dict(zip(KEYS, key, strict=True)),
                "pairs": len(part),
                "coverage_percent": 100.0 * part["inside"].mean(),
                "worst_index_percent": 100.0 * each.min(),
                "median_width": part["width"].median(),
                "rms_error": float(np.sqrt((part["off"] ** 2).mean())),
            }
        )
    return pd.DataFrame(found)
