"""Gaps pooled by place, and the terms of a law, which are what their words say."""

import re
from collections.abc import Sequence

import numpy as np
import pandas as pd
from sweeps import sweep

from spinepipe.effects.contract import Array
from spinepipe.studies.discrepancy.search import law_terms
from spinepipe.studies.discrepancy.search.gaps import KEYS, Gap, GapPlace, _spread, places, worst
from spinepipe.units import COORDINATES, ROTATIONS, TRANSLATIONS


def frame() -> pd.DataFrame:
    """Two specimens, one test, two steps, one joint, two coordinates; chi2 1, 2, 3 ..."""
    where = [
        (specimen, "flexion", step, "L4L5", coordinate)
        for specimen in "ab"
        for step in (0, 1)
        for coordinate in ROTATIONS[:2]
    ]
    rows = [(*place, float(number), 0.5) for number, place in enumerate(where, start=1)]
    return pd.DataFrame(rows, columns=[*KEYS, "chi2", "freedom"])


def test_gaps_are_pooled_by_each_place_once() -> None:
    found = {(one.by, *one.at.values()): one.gap for one in places(frame())}
    assert found["all",] == Gap(36.0, 4.0, 8)
    assert found["specimen", "a"] == Gap(1.0 + 2.0 + 3.0 + 4.0, 2.0, 4)
    assert found["step", 1] == Gap(3.0 + 4.0 + 7.0 + 8.0, 2.0, 4)
    assert found["coordinate", "right_bending"] == Gap(2.0 + 4.0 + 6.0 + 8.0, 2.0, 4)
    assert found["joint", "L4L5"] == found["test", "flexion"] == found["all",]
    place = "joint x coordinate x test", "L4L5", "extension", "flexion"
    assert found[place] == Gap(1.0 + 3.0 + 5.0 + 7.0, 2.0, 4)
    assert len(found) == 1 + 2 + 1 + 2 + 1 + 2 + 2


def test_the_worst_places_are_those_above_the_noise_largest_first() -> None:
    by = "joint x coordinate x test"
    clear, clearer = Gap(300.0, 100.0, 100), Gap(400.0, 100.0, 100)
    made = [
        GapPlace(by, {}, clear),
        GapPlace(by, {}, Gap(101.0, 100.0, 100)),
        GapPlace(by, {}, clearer),
    ]
    made.append(GapPlace("joint", {}, Gap(900.0, 100.0, 100)))
    assert [one.gap for one in worst(made, 5)] == [clearer, clear]
    assert [one.gap for one in worst(made, 1)] == [clearer]


def test_without_freedom_there_is_no_gap() -> None:
    nothing = Gap(4.0, 0.0, 4)
    assert (nothing.rms, nothing.gap, nothing.interval) == (0.0, 0.0, (0.0, 0.0))


def test_values_are_spread_over_what_was_read_test_by_test() -> None:
    used = np.zeros((2, 2, 1, 6), dtype=bool)
    used[0, 1, 0, 3], used[1, 0, 0, 3], used[1, 0, 0, 5] = True, True, True
    first, second = _spread(np.array([7.0, 8.0, 9.0]), tuple(used))
    assert first[1, 0, 3] == 7.0
    assert (second[0, 0, 3], second[0, 0, 5]) == (8.0, 9.0)
    assert np.isnan(first).sum() + np.isnan(second).sum() == 2 * 12 - 3


# Terms of a law


def state(joints: int, timed: bool) -> law_terms._TestState:
    rng = np.random.default_rng(20005)
    q, rate, load = rng.normal(size=(3, 4, joints, 6))
    return law_terms._TestState(
        q, rate if timed else None, rng.integers(-1, 2, q.shape) * 1.0, load
    )


def said(words: str, name: str, at: law_terms._TestState) -> Array:
    """(T, J) what words say: products and powers of motions by their names, and single words."""
    own = COORDINATES.index(name)
    word = name.replace("_", " ")
    if words.startswith("way of"):
        return at.way[..., own]
    if words.startswith("rate of"):
        assert at.rate is not None
        return at.rate[..., own]
    beside = np.zeros_like(at.q[..., own])
    if words == f"{word} of the joint above":
        beside[:, :-1] = at.q[:, 1:, own]
        return beside
    if words == f"{word} of the joint below":
        beside[:, 1:] = at.q[:, :-1, own]
        return beside
    names = {one: at.q[..., COORDINATES.index(one)] for one in COORDINATES}
    names["compression"] = -at.load[..., COORDINATES.index("superior")]
    product = np.ones_like(beside)
    for part in words.replace(f"{word} |{word}|", "SIGNED").split(" x "):
        if part == "SIGNED":
            product = product * names[name] * np.abs(names[name])
            continue
        base, _, power = part.partition("^")
        product = product * names[base.replace(" ", "_")] ** int(power or 1)
    return product


@sweep("read", [("extension",), ROTATIONS, COORDINATES])
@sweep("joints", [1, 3])
def test_terms_have_the_values_and_units_of_their_words(read: Sequence[str], joints: int) -> None:
    at = state(joints, timed=True)
    for name in read:
        found = list(law_terms._of(at, name, read))
        assert len({term.words for term, _ in found}) == len(found)
        for term, values in found:
            np.testing.assert_allclose(values, said(term.words, name, at), err_msg=term.words)
            assert (term.coordinate, term.acts) == (name, law_terms.LOAD)
            assert term.powers == powers(term.words)


def powers(words: str) -> tuple[int, int, int, int]:
    """Of m, rad, s and N in what the words say."""
    if words.startswith("way of"):
        return (0, 0, 0, 0)
    single = re.sub(r" of the joint (above|below)|^rate of ", "", words)
    motions = {one.replace("_", " "): one in TRANSLATIONS for one in COORDINATES}
    longest_first = "|".join(sorted(motions, key=len, reverse=True))
    moved, turned = 0, 0
    for word, power in re.findall(rf"({longest_first})(?:\^(\d))?", single):
        moved += int(power or 1) * motions[word]
        turned += int(power or 1) * (not motions[word])
    return (moved, turned, -words.startswith("rate"), int("compression" in words))


def test_a_joint_alone_has_no_neighbours_and_superior_no_compression() -> None:
    words = [term.words for term, _ in law_terms._of(state(1, False), "superior", ("superior",))]
    assert words == [
        *("superior", "superior^2", "superior^3", "superior |superior|"),
        "way of superior (+1, 0, -1)",
    ]
