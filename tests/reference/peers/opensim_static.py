"""Static optimisation of a held trunk by OpenSim's own tool.

Muscles pull along straight paths; each joint coordinate is loaded with what muscles have to make.
"""

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np
import opensim
from numpy.typing import NDArray

from spinepipe.muscles.trunk import LEVELS
from tests.reference.peers.opensim_trunk import AXES, OpenSimTrunk

Array = NDArray[np.float64]

COORDINATES = tuple(f"{level}_{name}" for level in LEVELS for name, _ in AXES)
CONVERGENCE, MOST_ITERATIONS = 1e-6, 500
_STEP_S = 0.01


class Asked(NamedTuple):
    """A tool that is ready to run, and where it writes."""

    tool: opensim.AnalyzeTool
    model: opensim.Model
    names: tuple[str, ...]
    folder: TemporaryDirectory[str]


def asked(peer: OpenSimTrunk, bends: Array, required: Array, strength: Array, frames: int) -> Asked:
    """The tool for some frames of one posture; the model is changed.

    Parameters
    ----------
    bends : (7, 3) rad, extension, right bending, left rotation. required : (21,) N m of the
        coordinates, in this order. strength : (M,) N.
    """
    model, folder = peer.model, TemporaryDirectory()
    for name, most in zip(peer.names, strength, strict=True):
        path = opensim.PathActuator.safeDownCast(model.getForceSet().get(name))
        path.setOptimalForce(float(most))
        path.setMinControl(0.0)
        path.setMaxControl(1.0)
    for name, moment in zip(COORDINATES, required, strict=True):
        load = opensim.ExpressionBasedCoordinateForce(name, repr(-float(moment)))
        load.setName(f"load_{name}")
        model.addForce(load)
    model.set_gravity(opensim.Vec3(0.0))
    end = _STEP_S * (frames - 1)
    model.addAnalysis(_optimisation(end))
    motion = Path(folder.name, "still.sto")
    motion.write_text(_still(bends, frames), encoding="utf-8")
    state = model.initSystem()
    tool = opensim.AnalyzeTool()
    tool.setName("held")
    tool.setModel(model)
    tool.setCoordinatesFileName(str(motion))
    tool.setInitialTime(0.0)
    tool.setFinalTime(end)
    tool.setResultsDir(folder.name)
    tool.setSolveForEquilibrium(False)
    tool.setReplaceForceSet(False)
    tool.loadStatesFromFile(state)
    return Asked(tool, model, peer.names, folder)


def forces(ready: Asked) -> Array:
    """(frames, M) N; runs the tool.

    Raises
    ------
    RuntimeError
        Where the tool says that it failed.
    """
    if not ready.tool.run():
        raise RuntimeError("OpenSim's static optimisation failed")
    (written,) = Path(ready.folder.name).glob("*_force.sto")
    table = opensim.TimeSeriesTable(str(written))
    columns = [table.getDependentColumn(name).to_numpy() for name in ready.names]
    return np.stack(columns, axis=1)


def _optimisation(end: float) -> opensim.StaticOptimization:
    found = opensim.StaticOptimization()
    found.setUseModelForceSet(True)
    found.setActivationExponent(2)
    found.setUseMusclePhysiology(False)
    found.setConvergenceCriterion(CONVERGENCE)
    found.setMaxIterations(MOST_ITERATIONS)
    found.setStartTime(0.0)
    found.setEndTime(end)
    return found


def _still(bends: Array, frames: int) -> str:
    """A motion in which nothing moves."""
    head = f"still\nversion=1\nnRows={frames}\nnColumns={1 + bends.size}\ninDegrees=no\nendheader\n"
    row = "\t".join(repr(float(angle)) for angle in bends.ravel())
    rows = "".join(f"{_STEP_S * k:g}\t{row}\n" for k in range(frames))
    return head + "\t".join(["time", *COORDINATES]) + "\n" + rows
