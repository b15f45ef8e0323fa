"""`python -m benchmarks equilibria OLD`: stacks of spines solved from neutral, beside a commit.

Joints stiffen exponentially under gravity, a moment and a force. Both commits are measured by this
file, in turn, each in processes of its own; the least of their CPU times counts.
"""

import json
import os
import shutil
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from spinepipe.effects import create
from spinepipe.model import ScopedEffect
from spinepipe.statics import free_parameters
from tests.reference.bridge import load_case, spine_model
from tests.reference.peers.chain import random_chain

try:
    from spinepipe.statics.batched import Cases, Spines, Stack, poses_by
    from spinepipe.statics.batched.spines import stack_spines
except ModuleNotFoundError:  # an older commit, which calls them so
    from spinepipe.statics.many import Cases, Spines, Stack, poses_by
    from spinepipe.statics.many.spines import stacked as stack_spines

ROOT = Path(__file__).parents[1]
JOINTS, SIZES = (3, 6, 17), (1, 10, 100, 1000, 10_000)
TURNS, REPEATS = 3, 3
STIFFNESS = [149e3, 1.89e6, 135e3, 15.0, 20.0, 80.0]
STIFFENING = [40.0, 10.0, 14.0]
"""N m/rad at rest, and the rates (1/rad) of both sides."""
FORCE_N, MOMENT_NM = np.array([20.0, -40.0, 10.0]), np.array([2.0, 1.0, -7.5])

Figures = dict[str, float]
"""us an equilibrium, by joints, spines, and whether with derivatives by all stiffnesses."""


def stack(joints: int, count: int) -> Stack:
    """Spines of their own; longer ones bear less, so that all bend by 5 to 10 degrees a joint."""
    rng, share = np.random.default_rng(1), 3.0 / joints
    chain = random_chain(rng, joints, tilt_deg=15.0)
    moment = MOMENT_NM * (1.0 if joints == 3 else 0.64 if joints == 17 else share)
    top = replace(chain.loads[-1], force=share**2 * FORCE_N, moment=moment, point=chain.centres[-1])
    light = 0.4 * share
    chain = replace(chain, masses=light * chain.masses, inertias=light * chain.inertias)
    chain = chain.with_loads(top).with_stiffness(np.tile(STIFFNESS, (joints, 1)))
    model, every = spine_model(chain), tuple(range(joints))
    for name in ("extension", "right_bending", "left_rotation"):
        law = create("two_sided_exponential", {"coordinate": name})
        own = ScopedEffect(law, every, np.tile(STIFFENING, (joints, 1)), ("*",))
        model = model.with_effects((*model.effects, own))
    spines, cases = Spines.of(model, count), Cases.of(load_case(chain), count)
    values = [one * np.exp(rng.normal(0.0, 0.3, one.shape)) for one in spines.values]
    size = np.exp(rng.normal(0.0, 0.3, (count, 1, 1, 1)))
    cases = replace(cases, forces=cases.forces * size, moments=cases.moments * size)
    return stack_spines(replace(spines, values=tuple(values)), cases)


def figures() -> Figures:
    """What this commit takes."""
    found = {}
    for joints in JOINTS:
        for count in SIZES:
            made = stack(joints, count)
            free = free_parameters(made.model(0), 0, ["extension_nm_per_rad"], "per_joint")
            unknowns = [free] * count
            q = made.solve(why=False).q
            for name, call in (
                ("solved", lambda made=made: made.solve(why=False)),
                ("derivatives", lambda made=made, q=q, u=unknowns: poses_by(made, q, u)),
            ):
                call()
                seconds = []
                for _ in range(REPEATS if count < SIZES[-1] else 1):
                    begun = time.process_time()
                    call()
                    seconds.append(time.process_time() - begun)
                found[f"{joints} joints, {count} spines, {name}"] = 1e6 * min(seconds) / count
    return found


def tree_of(old: str, part: str) -> Path:
    """Files of an older commit for a part of the benchmarks; a name such as HEAD~1 moves."""
    folder = ROOT / ".benchmarks" / f"{part}-{old}"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    archive = subprocess.run(["git", "archive", old], cwd=ROOT, stdout=subprocess.PIPE, check=True)
    subprocess.run(["tar", "-x"], cwd=folder, input=archive.stdout, check=True)
    return folder


def beside(old: str) -> list[tuple[str, float, float | None]]:
    """What is measured, at HEAD and at an older commit."""
    return measured_beside(old, "equilibria", __file__)


def measured_beside(old: str, part: str, file: str) -> list[tuple[str, float, float | None]]:
    """Least figures that a file writes as JSON, at HEAD and at an older commit, in turn; None where
    the older one has none of that name."""
    folder = tree_of(old, part)
    turns: list[list[Figures]] = [[], []]
    for _ in range(TURNS):
        for found, tree in zip(turns, (ROOT, folder), strict=True):
            place = {"PYTHONPATH": str(tree), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
            run = [sys.executable, file]
            said = subprocess.run(
                run, cwd=tree, env=os.environ | place, stdout=subprocess.PIPE, check=True
            )
            found.append(json.loads(said.stdout))
    least = [{name: min(one[name] for one in side) for name in side[0]} for side in turns]
    return [(name, new, least[1].get(name)) for name, new in least[0].items()]


if __name__ == "__main__":
    print(json.dumps(figures()))
