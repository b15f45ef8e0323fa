"""Largest memory of a process: one that solves T12-S1 once, and single jobs."""

import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass

from benchmarks.study import ROOT

_OURS = """
from spinepipe.statics import Chain, System, follow
from tests.reference.bridge import load_case, spine_model
from tests.reference.peers.chain import t12_s1_chain

chain = t12_s1_chain()
model = spine_model(chain)
follow(System(Chain(model), model, load_case(chain)))
"""

_THEIRS = """
import numpy as np
from tests.reference.peers import opensim_peer
from tests.reference.peers.chain import t12_s1_chain

opensim_peer.equilibrium(t12_s1_chain())
"""

# Not getrusage: its largest memory is also that of the process from which this one was forked.
_PEAK = """
from pathlib import Path
print(next(x for x in Path("/proc/self/status").read_text().splitlines() if x[:6] == "VmHWM:"))
"""


@dataclass(frozen=True)
class Memory:
    """What a process did, and the most memory it held."""

    what: str
    peak_mib: float


def processes() -> Iterator[Memory]:
    """One process of each."""
    yield Memory("spinepipe: equilibrium T12-S1", peak_mib(_OURS))
    yield Memory("OpenSim: equilibrium T12-S1", peak_mib(_THEIRS))


def per_row(job: str, call: str, rows: int) -> float:
    """Bytes per row that a job of `spinepipe` holds at most, beyond those of its modules."""
    imported = f"import spinepipe.{job} as job\n"
    return (peak_mib(imported + call) - peak_mib(imported)) * 2**20 / rows


def peak_mib(program: str) -> float:
    """Most memory of a process that runs a program, MiB."""
    done = subprocess.run(
        [sys.executable, "-c", program + _PEAK],
        cwd=ROOT,
        check=True,
        capture_output=True,
        text=True,
    )
    return int(done.stdout.split()[-2]) / 1024  # VmHWM: 12345 kB
