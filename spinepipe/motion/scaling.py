"""A generic skeleton and its markers made as large as a subject, from one static trial.

Pelvis, lumbar and thoracic part get a factor each: those by which distances between markers of the
model, in its neutral pose, come nearest to the subject's in least squares, over pairs of markers.
Masses grow to the subject's, in the generic proportions; inertias with mass and size squared.

A cluster is a plate that no body scales: its middle moves with its vertebra's size, the markers on
it keep their distances. Pairs within one cluster tell nothing of size and are left out.
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from spinepipe.decomposition import bounded_least_squares, svd
from spinepipe.effects.contract import Array
from spinepipe.frames import Pose
from spinepipe.motion.skeleton import (
    BODIES,
    JOINTS,
    MarkerSet,
    MarkerTrial,
    Masses,
    Skeleton,
    body_poses,
)
from spinepipe.units import COORDINATES, MM_PER_M

SEGMENTS = ("pelvis", "lumbar", "thoracic")

SMALLEST, LARGEST = 0.4, 2.5
"""Factors outside say that markers or units are mixed up."""

CLOSE = 1e-12
"""Relative change at which the fit ends: where rounding of distances does."""

UNTOLD = 1e-6
"""Size of the weakest direction of the factors, over the strongest, that tells nothing of them."""


@dataclass(frozen=True, eq=False)
class ScalingFit:
    """How large the subject is beside the generic skeleton, and how well that fits.

    Attributes
    ----------
    factors : (3,) of `SEGMENTS`. n_pairs : of markers.
    rms_mm : root mean square over pairs of what is left of the distance. largest_mm : of one pair.
    largest_pair : the two markers of it.
    """

    factors: Array
    n_pairs: int
    rms_mm: float
    largest_mm: float
    largest_pair: tuple[str, str]


def segment_of(body: int) -> int:
    """Place in `SEGMENTS` of a body."""
    name = BODIES[body]
    return SEGMENTS.index(
        "pelvis" if name == "S1" else "lumbar" if name.startswith("L") else "thoracic"
    )


def fit_scaling(skeleton: Skeleton, markers: MarkerSet, static: MarkerTrial) -> ScalingFit:
    """The factors that fit the subject's static trial.

    Parameters
    ----------
    skeleton, markers : generic; the neutral pose is taken for the subject's.
    static : the subject stands still; its markers are those of `markers`, in their order.

    Raises
    ------
    ValueError
        Where the pairs leave a factor open, or a factor is none of a person.
    """
    # pairs of markers and their mean distances, over frames with both in sight
    pairs: list[tuple[int, int]] = []
    distances: list[float] = []
    for one, other in combinations(range(len(markers)), 2):
        both = static.seen[:, one] & static.seen[:, other]
        plate = markers.cluster[one] and markers.cluster[one] == markers.cluster[other]
        if both.any() and not plate:
            apart = static.places[both, other] - static.places[both, one]
            pairs.append((one, other))
            distances.append(float(np.linalg.norm(apart, axis=1).mean()))
    if not pairs:
        raise ValueError(f"no pair of markers is in sight in {static.name}")
    chosen, measured = np.array(pairs, dtype=np.int64), np.array(distances)
    by_factor, fixed = _places(skeleton, markers)
    across = by_factor[chosen[:, 1]] - by_factor[chosen[:, 0]]
    plates = fixed[chosen[:, 1]] - fixed[chosen[:, 0]]

    def residual(factors: Array) -> Array:
        found: Array = np.linalg.norm(across @ factors + plates, axis=1) - measured
        return found

    def jacobian(factors: Array) -> Array:
        gap = across @ factors + plates
        return np.einsum("nc,ncs->ns", gap / np.linalg.norm(gap, axis=1)[:, None], across)

    _require_told(jacobian(np.ones(len(SEGMENTS))))
    limits = np.full((2, len(SEGMENTS)), [[SMALLEST], [LARGEST]])
    start = np.ones(len(SEGMENTS))
    solved = bounded_least_squares(
        residual, start, jacobian, (limits[0], limits[1]), ftol=CLOSE, xtol=CLOSE, gtol=CLOSE
    )
    for name, factor in zip(SEGMENTS, solved.x, strict=True):
        # a factor at a limit is none that was found
        if not SMALLEST * (1.0 + UNTOLD) < factor < LARGEST * (1.0 - UNTOLD):
            raise ValueError(
                f"the {name} part would be {factor:.2f} times the generic one; check the markers' "
                "names and the units of the static trial"
            )
    left = np.abs(solved.fun) * MM_PER_M
    worst = int(np.argmax(left))
    first, second = chosen[worst]
    return ScalingFit(
        solved.x,
        len(chosen),
        float(np.sqrt(np.mean(left**2))),
        float(left[worst]),
        (markers.names[first], markers.names[second]),
    )


def _require_told(jacobian: Array) -> None:
    """Refuses pairs whose distances do not hang on each factor, or on all factors alike."""
    told = np.linalg.norm(jacobian, axis=0)
    for name, size in zip(SEGMENTS, told, strict=True):
        if size <= UNTOLD * told.max():
            raise ValueError(f"no pair of markers tells how large the {name} part is")
    sizes = svd(jacobian)[1]
    if len(sizes) < len(SEGMENTS) or sizes[-1] <= UNTOLD * sizes[0]:
        raise ValueError("pairs of markers do not tell the sizes of the three parts apart")


def _places(skeleton: Skeleton, markers: MarkerSet) -> tuple[Array, Array]:
    """Markers in the neutral pose as what grows with each factor (K, 3, 3) and what does not.

    Place (K, 3) m = first @ factors + second.
    """
    # a body's origin is the sum of the steps below it, each as large as the body that it leads from
    turns, origins = body_poses(skeleton, np.zeros((len(BODIES), len(COORDINATES))))
    body_factors = np.zeros((len(BODIES), 3, len(SEGMENTS)))
    for k in range(len(JOINTS)):
        body_factors[k + 1] = body_factors[k]
        body_factors[k + 1, :, segment_of(k)] += origins[k + 1] - origins[k]
    plates = _on_plates(markers)
    by_factor = body_factors[markers.body].copy()
    for k, body in enumerate(markers.body):
        grown = markers.at[k] - plates[k]
        by_factor[k, :, segment_of(int(body))] += turns[body] @ grown
    return by_factor, np.einsum("kij,kj->ki", turns[markers.body], plates)


def _on_plates(markers: MarkerSet) -> Array:
    """(K, 3) m, each marker from the middle of its cluster; zero for single ones."""
    found = np.zeros_like(markers.at)
    for name in {name for name in markers.cluster if name}:
        at = [k for k, cluster in enumerate(markers.cluster) if cluster == name]
        found[at] = markers.at[at] - markers.at[at].mean(axis=0)
    return found


def body_factors(factors: Array) -> Array:
    """(18,) how many times as large bodies are, of factors (3,) of `SEGMENTS`."""
    return np.array([factors[segment_of(k)] for k in range(len(BODIES))])


def steps_of(skeleton: Skeleton, factors: Array) -> tuple[Pose, ...]:
    """(17,) steps from joint to joint as large as the factors (3,) say."""
    size = body_factors(factors)
    return tuple(
        Pose(step.rotation, size[k] * step.origin) for k, step in enumerate(skeleton.steps)
    )


def scale_skeleton(
    skeleton: Skeleton, markers: MarkerSet, factors: Array, mass_kg: float
) -> tuple[Skeleton, MarkerSet]:
    """Skeleton and markers as large as the factors (3,) say, masses summing to mass_kg.

    Parameters
    ----------
    mass_kg : of all that the skeleton's bodies carry, pelvis to T1.
    """
    size = body_factors(factors)
    given = skeleton.masses
    heavier = mass_kg / float(given.kg.sum())
    masses = Masses(
        heavier * given.kg,
        size[:, None] * given.com,
        heavier * (size**2)[:, None, None] * given.about_com,
    )
    plates = _on_plates(markers)
    at = size[markers.body, None] * (markers.at - plates) + plates
    grown = MarkerSet(markers.names, markers.body, at, markers.weight, markers.cluster)
    return Skeleton(steps_of(skeleton, factors), masses), grown
