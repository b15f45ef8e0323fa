"""What is seen of a motion: markers on skin that slides, and what is told of the person."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from tests.generators.tracking.laws import Array
from tests.generators.tracking.moved import Motion
from tests.generators.tracking.person import BODIES, Person

CLUSTERS = ("T1", "T3", "T7", "T11", "L2", "L4")
SINGLES = ("T5", "T9", "T12", "L3")
PELVIS_MM = {
    "LASI": (75.0, 5.0, -120.0),
    "RASI": (75.0, 5.0, 120.0),
    "LPSI": (-85.0, 15.0, -42.0),
    "RPSI": (-85.0, 15.0, 42.0),
    "SACR": (-95.0, -10.0, 0.0),
}
ARMS_MM = ((0.0, 28.0, 0.0), (-6.0, -9.0, 17.0), (-6.0, -9.0, -19.0))


@dataclass(frozen=True)
class Errors:
    """How wrong things are: SD or size of each.

    Attributes
    ----------
    placed_mm : markers on the body against where they are told to be. slides_mm : least and most
        that skin slides over a vertebra at the whole flexion. noise_mm : of a frame. length : share
        by which told lengths are off. tilt_deg : told tilts of joints. mass : told masses.
    """

    placed_mm: float = 3.0
    slides_mm: tuple[float, float] = (10.0, 20.0)
    noise_mm: float = 0.35
    length: float = 0.025
    tilt_deg: float = 1.5
    mass: float = 0.06


EXACT = Errors(0.0, (0.0, 0.0), 0.2, 0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Worn:
    """Markers as they are worn: on which body, where in truth and as told, m, and how they slide.

    Attributes
    ----------
    slides : (K, 3) m at the whole flexion, in the body's axes.
    """

    names: tuple[str, ...]
    body: Array
    at: Array
    told: Array
    slides: Array
    cluster: tuple[str, ...]


def worn(person: Person, rng: np.random.Generator, errors: Errors) -> Worn:
    """The protocol of Wang 2021: 22 markers on the spine, five on the pelvis."""
    scale = person.height_m / 1.75
    names, body, at, slides = [], [], [], []
    for name in (*CLUSTERS, *SINGLES):
        slide = rng.uniform(*errors.slides_mm) * np.array([0.15, -1.0, 0.0])
        for marker, place in _on_a_vertebra(person, name):
            names.append(marker)
            body.append(BODIES.index(name))
            at.append(place)
            slides.append(slide)
    for name, place_mm in PELVIS_MM.items():
        names.append(name)
        body.append(0)
        at.append(1e-3 * scale * np.array(place_mm))
        slides.append(rng.uniform(0.0, 0.3) * errors.slides_mm[1] * np.array([0.3, -1.0, 0.0]))
    spread = 1e-3 * errors.placed_mm
    together = {k: rng.normal(0.0, spread, 3) for k in dict.fromkeys(body)}
    off = np.array([together[k] if k else rng.normal(0.0, spread, 3) for k in body])
    told = np.array(at)
    cluster = tuple(name[:-2] if name[:-2] in CLUSTERS else "" for name in names)
    return Worn(tuple(names), np.array(body), told + off, told, 1e-3 * np.array(slides), cluster)


def _on_a_vertebra(person: Person, name: str) -> Iterator[tuple[str, Array]]:
    """Markers and where they are told to be, m: three arms of a cluster, or one."""
    k, scale = BODIES.index(name), person.height_m / 1.75
    behind = scale * (-62.0 - 10.0 * (name[0] == "L"))
    middle = 500.0 * person.steps[k, 1] if k < 17 else 9.0
    place = np.array([behind, middle - 8.0 * scale, 0.0])
    if name not in CLUSTERS:
        yield name, 1e-3 * place
        return
    for letter, arm in zip("abc", ARMS_MM, strict=True):
        yield f"{name}_{letter}", 1e-3 * (place + np.array(arm))


def seen(motion: Motion, markers: Worn, rng: np.random.Generator, errors: Errors) -> Array:
    """(F, K, 3) m in ground, y up; NaN in a few short gaps. Skin slides with the bend, late."""
    lag = max(int(0.1 * len(motion.bent)), 1)
    late = np.array([motion.bent[max(0, k - lag) : k + 1].mean() for k in range(len(motion.bent))])
    local = markers.at + late[:, None, None] ** 1.3 * markers.slides
    turned = np.einsum("fkij,fkj->fki", motion.turns[:, markers.body], local)
    found: Array = motion.places[:, markers.body] + turned
    found = found + rng.normal(0.0, 1e-3 * errors.noise_mm, found.shape)
    for _ in range(3):
        marker, first = rng.integers(len(markers.names)), rng.integers(max(len(found) - 4, 1))
        found[first : first + 3, marker] = np.nan
    return found


@dataclass(frozen=True, eq=False)
class Told:
    """What the cohort says of the person: joints in ground (17,), bodies, none of it exact."""

    places: Array
    turns: Array
    kg: Array
    com: Array
    about: Array


def told(person: Person, rng: np.random.Generator, errors: Errors) -> Told:
    """The skeleton scaled by the body's height, with errors of lengths, tilts and masses."""
    steps = person.steps * (1.0 + errors.length * rng.normal(size=(17, 1)))
    off = Rotation.from_euler("z", errors.tilt_deg * rng.normal(size=(17, 1)), degrees=True)
    own = person.turns @ off.as_matrix()
    turns, places = np.zeros((17, 3, 3)), np.zeros((17, 3))
    turn, place = np.eye(3), np.zeros(3)
    for k in range(17):
        place = place + turn @ steps[k]
        turn = turn @ own[k]
        turns[k], places[k] = turn, place
    share = 1.0 + errors.mass * rng.normal(size=18)
    base = np.concatenate([np.eye(3)[None], turns])
    at = np.concatenate([np.zeros((1, 3)), places])
    com = at + np.einsum("bij,bj->bi", base, person.com)
    about = np.einsum("bij,bj,bkj->bik", base, share[:, None] * person.about, base)
    return Told(places, turns, share * person.kg, com, about)
