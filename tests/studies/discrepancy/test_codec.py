"""Values as bytes and back: nothing is lost, and nothing runs that is not spinepipe's own data."""

import json
import math
import pickle
import struct
from collections import OrderedDict
from dataclasses import dataclass, is_dataclass
from enum import Enum, StrEnum
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as of_numpy
from sweeps import sweep

from spinepipe.effects import PlaceSpread
from spinepipe.effects.registry import create, registered
from spinepipe.frames import Pose
from spinepipe.model import LoadCase, LoadStep, ScopedEffect
from spinepipe.studies.discrepancy.codec import decode, encode
from spinepipe.studies.discrepancy.search.joint_fit import Setting
from spinepipe.studies.discrepancy.search.readings import Repeats
from spinepipe.studies.discrepancy.search.whitening import Whitening

MANY = settings(max_examples=150)


def bits(value: float) -> bytes:
    """All 64 of them: NaN is not NaN, and 0 is -0, for ==."""
    return struct.pack("<d", value)


def alike(one: Any, other: Any) -> bool:
    """The same types all the way down, the same bits, the same order."""
    if type(one) is not type(other):
        return False
    if isinstance(one, np.ndarray | np.generic):
        return (one.dtype, one.shape, one.tobytes()) == (other.dtype, other.shape, other.tobytes())
    if type(one) is float:
        return bits(one) == bits(other)
    if type(one) in (tuple, list):
        return len(one) == len(other) and all(map(alike, one, other))
    if type(one) is dict:
        return alike(list(one.items()), list(other.items()))
    if is_dataclass(one):
        names = one.__dataclass_fields__
        return all(alike(getattr(one, name), getattr(other, name)) for name in names)
    return bool(one == other)


def arrays() -> st.SearchStrategy[np.ndarray]:
    """Of every kind of numbers and either byte order; slices and transposes too."""
    numbers = of_numpy.boolean_dtypes() | of_numpy.integer_dtypes() | of_numpy.floating_dtypes()
    shapes = of_numpy.array_shapes(min_dims=0, max_dims=4, min_side=0, max_side=4)
    made = of_numpy.arrays(numbers | of_numpy.complex_number_dtypes(), shapes)
    return made | made.map(np.transpose) | made.map(lambda one: one[..., ::-1] if one.ndim else one)


CASES = st.builds(LoadCase, st.text(), st.integers(), st.just((LoadStep(0, (), 0.5),)))
LEAVES = (
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text()
    | st.sampled_from(list(PlaceSpread))
    | arrays()
    | arrays().map(lambda one: one.ravel()[:1].sum())
    | st.frozensets(st.text())
    | CASES
    | st.builds(Repeats, CASES, arrays())
)
KEYS = st.text() | st.integers() | st.tuples(st.integers(), st.sampled_from(list(PlaceSpread)))
VALUES = st.recursive(
    LEAVES,
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.lists(inner, max_size=4).map(tuple)
        | st.dictionaries(KEYS, inner, max_size=4)
        | st.builds(Setting, st.dictionaries(st.text(), inner, max_size=2), inner, st.booleans())
    ),
    max_leaves=12,
)


@MANY
@example(-0.0)
@example(-math.nan)
@example([math.inf, -math.inf, 5e-324, 0.1, 1e22, 2**200])
@example(struct.unpack("<d", struct.pack("<Q", 0xFFF8_0000_0000_1234))[0])
@example([1, 1.0, True, np.float64(1.0), np.bool_(True), np.int8(1)])
@example({"b": 1, "a": (1, [2, ()]), 3: {}, None: frozenset()})
@example(["float", 1.0, "same", ["tuple"]])
@given(VALUES)
def test_what_is_read_is_what_was_written(value: Any) -> None:
    assert alike(decode(encode(value)), value)


@MANY
@given(VALUES)
def test_the_bytes_hang_on_the_value_alone(value: Any) -> None:
    data = encode(value)
    assert encode(decode(data)) == data


@MANY
@given(arrays())
def test_arrays_lie_in_memory_as_before_and_may_be_written(array: np.ndarray) -> None:
    """Products of matrices differ in their last bits with the order that they lie in."""
    found = decode(encode([array, array.T]))
    for one, other in zip(found, (array, array.T), strict=True):
        if other.flags.c_contiguous or other.flags.f_contiguous:
            assert one.flags.c_contiguous == other.flags.c_contiguous
            assert one.flags.f_contiguous == other.flags.f_contiguous
        assert one.flags.writeable
        assert one.flags.aligned


def test_what_was_one_object_is_one_again() -> None:
    pose = Pose(np.eye(3), np.zeros(3))
    found = decode(encode({"a": (pose, pose), "b": [pose.origin, np.zeros(3)], "c": pose}))
    assert found["a"][0] is found["a"][1] is found["c"]
    assert found["b"][0] is found["c"].origin
    assert found["b"][1] is not found["b"][0]


def test_cached_properties_are_not_written() -> None:
    held, same = (Repeats(LoadCase("flexion", 1, ()), np.ones((1, 2, 1, 6))) for _ in range(2))
    assert held.mean.shape == (2, 1, 6)
    assert encode(held) == encode(same)
    assert "mean" not in vars(decode(encode(held)))


@sweep("name", sorted(registered()))
def test_every_effect_comes_back(name: str) -> None:
    effect = create(name)
    values = np.array([[one.default for one in effect.parameters]])
    found = decode(encode(ScopedEffect(effect, (0,), values)))
    assert (type(found.effect), found.effect) == (type(effect), effect)
    assert [one.default for one in found.effect.parameters] == values[0].tolist()


class Colour(Enum):
    """An enum of others."""

    RED = 1


class Word(StrEnum):
    """A str of others."""

    HALF = "half"


class Pair(NamedTuple):
    """A tuple of others."""

    x: int


@dataclass(frozen=True)
class Foreign:
    """A dataclass of others."""

    x: int


class Text(str):
    """A str that is none."""


@sweep(
    "value",
    [
        object(),
        len,
        Foreign,
        Foreign(1),
        Colour.RED,
        Word.HALF,
        Pair(1),
        Text("a"),
        {1},
        b"a",
        1j,
        Path("a"),
        OrderedDict(a=1),
        np.array([None]),
        np.array(["a"]),
        np.str_("a"),
        np.zeros(2, [("x", float)]),
        np.ma.zeros(2),
        np.array(["2026-01-01"], "M8[D]"),
        Whitening,
    ],
)
def test_what_is_no_plain_data_is_refused(value: Any) -> None:
    for held in (value, [value], {"a": (value,)}, Setting({"a": value}, {}, True)):
        with pytest.raises(TypeError, match="cannot be kept as data"):
            encode(held)


def test_text_that_is_no_text_is_refused() -> None:
    with pytest.raises(UnicodeEncodeError):
        encode("\ud83d")


def written(structure: Any, numbers: bytes = b"") -> bytes:
    """Bytes with a structure as somebody else might write it."""
    return json.dumps(structure).encode() + b"\n" + numbers


@sweep(
    "name",
    [
        "os:system",
        "subprocess:Popen",
        "test_codec:Foreign",
        "spinepipe_other.a:B",
        ":a",
        "",
        "spinepipe.files:appearing",
        "spinepipe.files:os.system",
        "spinepipe.files:Path",
        "spinepipe.studies.discrepancy.codec:import_module",
    ],
)
def test_no_name_but_of_our_data_is_ever_called(name: str) -> None:
    with pytest.raises(ValueError, match="is no"):
        decode(written(["data", name, "true"]))


@sweep(
    "name, words",
    [
        ("spinepipe.tables:Table", "is called spinepipe.schema.table:Table"),
        ("spinepipe.files:re.RegexFlag", "cannot be kept as data"),
    ],
)
def test_a_class_is_known_by_its_own_name_alone(name: str, words: str) -> None:
    """Not by that of a file that imports it, which would open all that any file imports."""
    with pytest.raises(ValueError, match=words):
        decode(written(["data", name, "true"]))


def test_the_program_is_not_run_by_its_name() -> None:
    """To import `spinepipe.cli.__main__` would be to run it, and to exit."""
    with pytest.raises(ValueError, match="is not of spinepipe"):
        decode(written(["data", "spinepipe.cli.__main__:main", "true"]))


@sweep(
    "structure",
    [
        ["data", "spinepipe.no_such_room:Data"],
        ["data", "spinepipe.status:NoSuchName"],
        ["data", "spinepipe.schema.table:Table", "name"],
        ["enum", "spinepipe.status:Status", "no_such_member"],
        ["array", "<f8", [2], "C", 0],
        ["array", "|O", [0], "C", 0],
        ["array", "f8,f8", [0], "C", 0],
        [["data"], 1],
        ["no such tag"],
        ["same", 7],
        [],
    ],
)
def test_what_was_not_written_here_is_one_kind_of_error(structure: Any) -> None:
    with pytest.raises(ValueError, match=r"\S"):
        decode(written(structure))


def test_nothing_is_unpickled() -> None:
    """Nor are arrays of objects, which in memory are addresses."""
    for data in (pickle.dumps(Colour.RED), written(["array", "|O", [1], "C", 0], bytes(8))):
        with pytest.raises(ValueError, match=r"no dtype|codec|Expecting"):
            decode(data)
