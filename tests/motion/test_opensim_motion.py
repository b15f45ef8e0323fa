"""Exported models and motions in OpenSim: it replays them, loads their joints, fits their markers.

The spine is made up. Coordinates, bodies and markers come from the files alone.
"""

from pathlib import Path

import numpy as np
import pytest
from moving_spine import everywhere, markers, postures, spine, trial_at

from spinepipe.model import RefusedModel
from spinepipe.motion.export import COLUMNS, mot, osim
from spinepipe.motion.objective import SHAPE, MotionObjective, sample_trial
from spinepipe.motion.points import COUNT, marker_places
from spinepipe.motion.posture import postures as fitted
from spinepipe.motion.residual_terms import bodies_of
from spinepipe.motion.skeleton import BODIES, MarkerSet
from tests.reference.peers import opensim_motion as peer

REPLAYED_M = 1e-9
"""Fifteen digits of metres and degrees, along 18 bodies."""

LOADED = 1e-9
"""Share of the largest load: two programs' round-off over 108 coordinates."""

FITTED_DEG = 1e-3
ACCURACY = 1e-10
"""OpenSim's, of its own assembly; with its usual 1e-5 it ends up to degrees away."""

SLIDING_M = 1e-3
"""SD of what markers are off, so that no posture fits them exactly: little beside the 60 mm of a
body's markers, or there is more than one posture that nothing near fits better."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("opensim")


def exported(folder: Path, seen: MarkerSet, name: str):
    """The model as OpenSim reads it."""
    path = folder / f"{name}.osim"
    path.write_text(osim(spine(), seen, name), encoding="utf-8")
    return peer.model_of(path, COLUMNS)


def test_opensim_replays_a_motion(folder: Path) -> None:
    q, times = postures(11, 5), np.linspace(0.3, 1.1, 5)
    model = exported(folder, markers(), "replayed")
    (folder / "replayed.mot").write_text(mot("replayed", times, q), encoding="utf-8")
    told, values = peer.coordinates_of(model, folder / "replayed.mot")
    np.testing.assert_allclose(told, times, atol=1e-12)
    np.testing.assert_allclose(values, q.reshape(5, COUNT), atol=1e-13)
    np.testing.assert_allclose(
        peer.marker_places(model, values),
        marker_places(spine(), markers(), q),
        rtol=0.0,
        atol=REPLAYED_M,
    )


def test_opensim_asks_the_same_loads(folder: Path) -> None:
    """Postures, speeds and accelerations at random; all 108 coordinates."""
    motion = [
        postures(seed, 6).reshape(6, COUNT) * size for seed, size in ((12, 1), (13, 5), (14, 30))
    ]
    expected = peer.loads(exported(folder, markers(), "loaded"), *motion)
    found = bodies_of(spine()).loads(*motion)
    for part in (slice(0, 3), slice(3, 6)):
        ours, theirs = (one.reshape(-1, *SHAPE)[..., part] for one in (found, expected))
        size = np.abs(theirs).max()
        assert size > 50.0
        np.testing.assert_allclose(ours, theirs, rtol=0.0, atol=LOADED * size)


def trc(path: Path, times: np.ndarray, places: np.ndarray, seen: MarkerSet) -> None:
    """Places (F, K, 3) m as a .trc file without loss."""
    frames, count = places.shape[:2]
    rate = f"{1.0 / (times[1] - times[0]):.6g}"
    named = "\t\t\t".join(seen.names)
    axes = "\t".join(f"X{k}\tY{k}\tZ{k}" for k in range(1, count + 1))
    lines = [
        f"PathFileType\t4\t(X/Y/Z)\t{path.name}",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame"
        "\tOrigNumFrames",
        f"{rate}\t{rate}\t{frames}\t{count}\tm\t{rate}\t1\t{frames}",
        f"Frame#\tTime\t{named}\t\t",
        f"\t\t{axes}",
        "",
    ]
    for frame in range(frames):
        row = [repr(value) for value in places[frame].ravel().tolist()]
        lines.append("\t".join([str(frame + 1), repr(float(times[frame])), *row]))
    path.write_text("\n".join(lines) + "\n")


def test_inverse_kinematics_are_opensims(folder: Path) -> None:
    """Markers off by millimetres, weights unlike; three rotations a joint, the pelvis free."""
    rng, frames = np.random.default_rng(15), 4
    seen = everywhere()
    weight = rng.uniform(0.5, 3.0, len(seen))
    seen = MarkerSet(seen.names, seen.body, seen.at, weight, seen.cluster)
    times = 0.1 * np.arange(frames)
    q = postures(16, frames, 0.05)
    q[:, 1:, :3] = 0.0
    places = marker_places(spine(), seen, q) + rng.normal(0.0, SLIDING_M, (frames, len(seen), 3))
    trc(folder / "fitted.trc", times, places, seen)
    expected = peer.inverse_kinematics(
        exported(folder, seen, "fitted"),
        folder / "fitted.trc",
        folder / "fitted.mot",
        dict(zip(seen.names, weight.tolist(), strict=True)),
        ACCURACY,
    ).reshape(frames, *SHAPE)
    free = np.ones(SHAPE, dtype=bool)
    free[1:, :3] = False
    known = sample_trial(spine(), seen, trial_at(places), frames - 1)
    found = fitted(MotionObjective(free=free, loads=False), known)
    assert found.settled.all()
    assert np.abs(expected[:, 1:, :3]).max() == 0.0
    np.testing.assert_allclose(
        np.rad2deg(found.q[..., 3:]), np.rad2deg(expected[..., 3:]), rtol=0.0, atol=FITTED_DEG
    )
    np.testing.assert_allclose(found.q[:, 0, :3], expected[:, 0, :3], rtol=0.0, atol=1e-5)
    off = np.rad2deg(np.abs(found.q - q)[..., 3:]).max()
    assert off > 1.0, "markers that are off by so much leave no posture as it was"


def test_names_that_opensim_cannot_take_are_refused() -> None:
    seen = markers()
    spaced = MarkerSet(("T1 a", *seen.names[1:]), seen.body, seen.at, seen.weight, seen.cluster)
    with pytest.raises(RefusedModel, match="'T1 a'"):
        osim(spine(), spaced, "s01")


def test_a_model_weighs_what_its_bodies_do(folder: Path) -> None:
    model = exported(folder, markers(), "weighed").model
    state = model.initSystem()
    assert model.getTotalMass(state) == pytest.approx(spine().masses.kg.sum())
    assert model.getBodySet().getSize() == len(BODIES)
