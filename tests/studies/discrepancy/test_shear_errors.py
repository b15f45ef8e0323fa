"""Mistakes in files of shear tests: force and displacement of one joint, no rotation read."""

from collections.abc import Callable, Sequence

import numpy as np
from scipy.spatial.transform import Rotation
from sweeps import sweep

from spinepipe.cohort.load_response import joint_loads
from spinepipe.effects import Wrench
from spinepipe.frames import Pose
from spinepipe.model import LoadCase, LoadStep
from spinepipe.studies.discrepancy.mistakes.data_errors import before_a_fit
from spinepipe.studies.discrepancy.search.readings import Repeats, SpecimenReadings
from spinepipe.studies.discrepancy.verdict import SuspectedError

JOINTS = ("C6C7",)
TESTS = {"anterior_shear": np.eye(3)[0], "compression": -np.eye(3)[1]}
LEVELS = np.array([0.0, 20.0, 40.0, 60.0, 80.0, 100.0])
STIFFNESS = np.array([9e4, 5e5, 1e5])
SD = np.array([2e-5] * 3 + [np.nan] * 3)
ORIGIN = np.array([0.01, 0.02, 0.0])

Change = Callable[[str, str, np.ndarray], np.ndarray]


def unchanged(specimen: str, test: str, q: np.ndarray) -> np.ndarray:
    return q


def sheared(
    change: Change = unchanged, force: float = 1.0, cycles: int = 3, arm: float = 0.0
) -> list[SpecimenReadings]:
    """Linear joints in forces through their centre, or ``arm`` m above it; ``force`` is written."""
    rng = np.random.default_rng(3)
    found = []
    for name in "abc":
        k, tests = STIFFNESS * np.exp(rng.normal(0.0, 0.3, 3)), []
        for test, way in TESTS.items():
            point = ORIGIN + np.array([0.0, arm, 0.0])
            steps = tuple(
                LoadStep(n, (Wrench(0, point, force * level * way, np.zeros(3)),))
                for n, level in enumerate(LEVELS)
            )
            q = np.full((cycles, len(LEVELS), 1, 6), np.nan)
            q[..., 0, :3] = LEVELS[:, None] * way / k
            q[..., :3] += SD[:3] * rng.standard_normal(q[..., :3].shape)
            tests.append(Repeats(LoadCase(test, 1, steps), change(name, test, q)))
        found.append(SpecimenReadings(name, (Pose(np.eye(3), ORIGIN),), tuple(tests)))
    return found


def suspected(given: Sequence[SpecimenReadings]) -> tuple[SuspectedError, ...]:
    return before_a_fit(given, JOINTS, SD, zeroed=False)


def test_loads_of_all_coordinates_are_forces_and_moments_in_the_joint_frame() -> None:
    frame = Pose(Rotation.from_euler("ZXY", (0.3, -0.2, 0.5)).as_matrix(), ORIGIN)
    force, moment, arm = (np.random.default_rng(n).normal(size=3) for n in range(3))
    step = LoadStep(0, (Wrench(0, ORIGIN + arm, force, moment),))
    (loads,) = joint_loads((frame,), LoadCase("all", 1, (step,)))[0]
    along = frame.rotation.T
    about = along @ (moment + np.cross(arm, force))
    np.testing.assert_allclose(loads[:3], along @ force, rtol=0, atol=1e-14)
    np.testing.assert_allclose(loads[3:], about[[2, 0, 1]], rtol=0, atol=1e-14)


def test_nothing_is_suspected_of_clean_shear() -> None:
    assert suspected(sheared()) == ()


def test_a_flipped_translation_moves_against_its_load() -> None:
    def flip(specimen: str, test: str, q: np.ndarray) -> np.ndarray:
        return np.where(np.arange(6) == 0, -q, q) if specimen == "b" else q

    (error,) = suspected(sheared(flip))
    assert error.where == "b, test anterior_shear"
    assert error.what == "sign of the load, or of every anterior reading"
    assert "move against the load" in error.evidence


@sweep("force, words", [(1e-3, "kN and not N"), (1e3, "in m and not mm")])
def test_a_wrong_unit_of_forces_is_told(force: float, words: str) -> None:
    (error,) = suspected(sheared(force=force))
    assert error.where == "all specimens"
    assert words in error.what
    assert "N/mm in anterior" in error.evidence


def test_one_specimen_in_another_unit_is_told_beside_the_others() -> None:
    def in_m(specimen: str, test: str, q: np.ndarray) -> np.ndarray:
        return 1e-3 * q if specimen == "c" else q

    given = sheared(in_m)
    assert suspected(given) == ()  # a hundredth of the noise: nobody can tell
    tiny = SD * 1e-4
    (error,) = before_a_fit(given, JOINTS, tiny, zeroed=False)
    assert error.where == "c"
    assert "translations in m and not mm" in error.what


def test_rotation_by_a_lever_as_short_as_centres_are_sure_tells_no_sign() -> None:
    """A joint that turns against the moment of a force 5 mm off: its centre may be below that."""

    def turning(specimen: str, test: str, q: np.ndarray) -> np.ndarray:
        new = q.copy()
        new[..., 0, 3] = 1e-4 * LEVELS
        return new

    sd = np.where(np.isfinite(SD), SD, 1e-4)
    assert before_a_fit(sheared(turning, arm=0.005), JOINTS, sd, zeroed=False) == ()
    (error,) = before_a_fit(sheared(turning, arm=0.05), JOINTS, sd, zeroed=False)
    assert "extension" in error.what


def test_loose_markers_are_told_by_translations_too() -> None:
    rng = np.random.default_rng(5)

    def shaken(specimen: str, test: str, q: np.ndarray) -> np.ndarray:
        more = 10.0 * SD[:3] * rng.standard_normal(q[..., :3].shape)
        return np.concatenate([q[..., :3] + more, q[..., 3:]], axis=-1) if specimen == "a" else q

    (error,) = suspected(sheared(shaken))
    assert (error.where, error.what) == ("a, C6C7", "markers of the joint")
