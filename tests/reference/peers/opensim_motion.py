"""A tracked spine in OpenSim, from the files that spinepipe writes: replayed, driven, fitted."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import opensim
from numpy.typing import NDArray

Array = NDArray[np.float64]

opensim.Logger.setLevelString("Off")
opensim.Logger.removeFileSink()

TRANSLATIONS = ("_anterior", "_superior", "_right")


class Peer(NamedTuple):
    """A model, and the names of its coordinates in the order of every array of this module.

    OpenSim has its own order: rotations of a joint first.
    """

    model: opensim.Model
    names: tuple[str, ...]

    @property
    def order(self) -> list[int]:
        """Place of each name in the model, which is that in the tree of a chain."""
        coordinates = self.model.getCoordinateSet()
        there = [coordinates.get(k).getName() for k in range(coordinates.getSize())]
        assert sorted(there) == sorted(self.names)
        return [there.index(name) for name in self.names]


def model_of(path: Path, names: Sequence[str]) -> Peer:
    """The model in a file."""
    model = opensim.Model(str(path))
    model.finalizeConnections()
    return Peer(model, tuple(names))


def coordinates_of(peer: Peer, path: Path) -> tuple[Array, Array]:
    """Times (F,) and values (F, n) of a motion, m and rad.

    OpenSim itself reads the file and turns degrees into radians.
    """
    peer.model.initSystem()
    stored = opensim.Storage(str(path))
    assert stored.isInDegrees()
    peer.model.getSimbodyEngine().convertDegreesToRadians(stored)
    labels = [stored.getColumnLabels().get(k) for k in range(1, stored.getColumnLabels().size())]
    where = [labels.index(name) for name in peer.names]
    times = opensim.ArrayDouble()
    stored.getTimeColumn(times)
    rows = []
    for frame in range(stored.getSize()):
        data = stored.getStateVector(frame).getData()
        rows.append([data.get(k) for k in where])
    return np.array([times.get(k) for k in range(times.size())]), np.array(rows)


def marker_places(peer: Peer, values: Array) -> Array:
    """(F, K, 3) m in ground, of postures (F, n) m and rad."""
    state = peer.model.initSystem()
    markers = peer.model.getMarkerSet()
    found = []
    for posture in values:
        _put(peer, state, posture)
        peer.model.realizePosition(state)
        places = [markers.get(k).getLocationInGround(state) for k in range(markers.getSize())]
        found.append([[at.get(i) for i in range(3)] for at in places])
    return np.array(found)


def loads(peer: Peer, values: Array, speeds: Array, accelerations: Array) -> Array:
    """(F, n) N and N m of OpenSim's inverse dynamics, of motions (F, n) each."""
    state = peer.model.initSystem()
    coordinates, order = peer.model.getCoordinateSet(), peer.order
    solver = opensim.InverseDynamicsSolver(peer.model)
    found = []
    for posture, speed, acceleration in zip(values, speeds, accelerations, strict=True):
        _put(peer, state, posture)
        asked = opensim.Vector(len(order), 0.0)
        for k, rate, change in zip(order, speed, acceleration, strict=True):
            coordinates.get(k).setSpeedValue(state, float(rate))
            asked.set(k, float(change))
        peer.model.realizeVelocity(state)
        forces = solver.solve(state, asked)
        found.append([forces.get(k) for k in order])
    return np.array(found)


def _put(peer: Peer, state: opensim.State, posture: Array) -> None:
    coordinates = peer.model.getCoordinateSet()
    for k, value in zip(peer.order, posture, strict=True):
        coordinates.get(k).setValue(state, float(value), False)


def inverse_kinematics(
    peer: Peer, motion: Path, output: Path, weights: dict[str, float], accuracy: float
) -> Array:
    """(F, n) m and rad of the tool, from a .trc file; joints of vertebrae turn and do not slide."""
    coordinates = peer.model.updCoordinateSet()
    for k, name in zip(peer.order, peer.names, strict=True):
        if name.endswith(TRANSLATIONS) and not name.startswith("pelvis"):
            coordinates.get(k).set_locked(True)
    peer.model.initSystem()
    tool = opensim.InverseKinematicsTool()
    tool.setModel(peer.model)
    tool.setMarkerDataFileName(str(motion))
    tool.setOutputMotionFileName(str(output))
    tool.set_report_errors(False)
    tool.set_accuracy(accuracy)
    for name, weight in weights.items():
        task = opensim.IKMarkerTask()
        task.setName(name)
        task.setApply(True)
        task.setWeight(weight)
        tool.getIKTaskSet().cloneAndAppend(task)
    assert tool.run()
    return coordinates_of(peer, output)[1]
