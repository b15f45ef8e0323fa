"""How often 95 % intervals of the posterior hold the truth, over phantoms with felt landmarks."""

import hashlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pandas as pd
from statsmodels.stats.proportion import proportion_confint

from spinepipe.calibration import fit
from spinepipe.calibration.posterior import between, modes, normal_of
from spinepipe.calibration.sampler import sample
from spinepipe.jobs.code import code_digest
from spinepipe.studies.joint_pose_sensitivity.inputs import study_and_cohort
from spinepipe.studies.joint_pose_sensitivity.landmarks import landmarks_of
from spinepipe.studies.joint_pose_sensitivity.posterior_target import posterior_of, problem_of
from tests.generators import palpated_joints
from tests.generators.palpated_joints import FACTOR, FREE, MARKS, START, Joint, joint, write

ROOT = Path(__file__).resolve().parents[2]
PHANTOMS, TOGETHER = 240, 24
CHAINS, WARM_UP, DRAWS = 4, 30, 60
"""Short: the coverage of all is looked at, no single posterior is told."""

ENDS = (2.5, 97.5)
LITTLE_KNOWN = 0.3
"""SD as a share of the prior's, from which a stiffness counts as little known."""

Z = 1.959963984540054
NAMES = ("anterior", "superior", "extension")
STUDY = """\
study: felt
kind: joint_pose_sensitivity
cohort: felt
stiffness: {{anterior_n_per_m: {0}, superior_n_per_m: {1}, right_n_per_m: {2},
  extension_nm_per_rad: {3}, right_bending_nm_per_rad: {4}, left_rotation_nm_per_rad: {5}}}
calibration: {{free: [anterior, superior, extension], bound_factor: {6}}}
posterior: {{draws: {7}, noise: declared}}
"""


def table(blocks: Sequence[int] = range(PHANTOMS // TOGETHER)) -> pd.DataFrame:
    """Coverage by quantity, of the sampler and of Laplace; ends by Wilson over phantoms."""
    rows = pd.concat([pd.read_parquet(_block(block)) for block in blocks], ignore_index=True)
    told = rows[rows["quantity"].isin(NAMES)]
    unknown = told[told["share"] > LITTLE_KNOWN].assign(quantity="stiffness, little known")
    whole = [rows, told.assign(quantity="stiffness, all"), unknown]
    found = []
    for name, part in pd.concat(whole).groupby("quantity", sort=False):
        row: dict[str, object] = {"quantity": name, "intervals": len(part)}
        row |= {"sd_over_prior": part["share"].median()}
        for way in ("sampler", "laplace"):
            low, high = proportion_confint(part[way].sum(), len(part), method="wilson")
            row |= {f"{way}_percent": 100 * part[way].mean()}
            row |= {f"{way}_low": 100 * low, f"{way}_high": 100 * high}
        found.append(row)
    return pd.DataFrame(found)


def _block(block: int) -> Path:
    """The rows of some phantoms, as a file that appears whole and is kept with its code."""
    code = code_digest("spinepipe.studies.joint_pose_sensitivity.posterior")
    own = Path(__file__).read_bytes() + Path(palpated_joints.__file__).read_bytes()
    made_by = hashlib.sha256(code.encode() + own).hexdigest()[:12]
    folder = ROOT / "results" / "validation" / "posterior_coverage" / made_by
    path = folder / f"block={block:02d}.parquet"
    if not path.exists():
        folder.mkdir(parents=True, exist_ok=True)
        partial = path.with_suffix(".part")
        pd.DataFrame(_rows(block)).to_parquet(partial)
        partial.rename(path)
    print(f"posterior coverage: {TOGETHER * (block + 1)} phantoms", flush=True)
    return path


def _rows(block: int) -> Iterator[dict[str, object]]:
    seeds = range(TOGETHER * block, TOGETHER * (block + 1))
    joints = {f"p{seed:03d}": joint(seed) for seed in seeds}
    with TemporaryDirectory() as place:
        root = Path(place)
        write(joints, root / "config" / "cohorts" / "felt")
        (root / "config" / "studies").mkdir()
        (root / "config" / "config.yaml").write_text("studies: [felt]\n")
        text = STUDY.format(*START.tolist(), FACTOR, DRAWS)
        (root / "config" / "studies" / "felt.yaml").write_text(text)
        for (name, one), seed in zip(joints.items(), seeds, strict=True):
            yield from _phantom(str(root), name, one, seed)


def _phantom(root: str, name: str, one: Joint, seed: int) -> Iterator[dict[str, object]]:
    settings, cohort = study_and_cohort(root, "felt")
    alone = problem_of(root, settings, name)
    found = fit(alone, 1, seed)
    assert found.status.usable, (name, found.message)
    own = posterior_of(
        settings, cohort, alone, landmarks_of(cohort, name, settings.landmark_sd_mm), 0.0
    )
    target, (low, high) = own.target(), own.bounds
    start = np.zeros(own.unknowns.size)
    start[: len(FREE)] = normal_of(low, high, found.x)
    mode = modes(target, start[None])[0]
    assert mode.point is not None, (name, mode.message)
    sd = np.sqrt(np.diagonal(mode.covariance))
    truth = _truth(one, low, high)
    z = sample(target, mode, CHAINS, WARM_UP, DRAWS, seed).z
    ends = np.percentile(z.reshape(-1, len(sd)), ENDS, axis=0)
    marks = [f"landmark {axis}" for _ in MARKS for axis in "xyz"]
    told = zip([*NAMES, *marks], truth, ends.T, mode.point.z, sd, strict=True)
    for quantity, value, (a, b), top, near in told:
        yield {
            "seed": seed,
            "quantity": quantity,
            "sampler": bool(a <= value <= b),
            "laplace": bool(abs(value - top) <= Z * near),
            "share": float(near),
        }


def _truth(one: Joint, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """z of the truth: as the prior tells stiffnesses and displacements."""
    moves = np.log(one.stiffness / START)[list(FREE)]
    at = normal_of(low, high, moves)
    assert np.allclose(between(low, high, at)[0], moves, atol=1e-3)
    away = (one.true - one.felt) / palpated_joints.SD_MM
    return np.concatenate([at, away.ravel()])
