"""Four lanes as one number of compiled code: what a processor's vector registers hold.

Loops over lanes that LLVM is left to vectorise came out scalar, or with checks at each turn whether
arrays overlap. As elements of arrays, four lanes side by side need no loop: kernels are written as
for one lane. Every operation acts on each lane by itself and in the same order, so that a lane's
numbers do not hang on those beside it, nor on how wide the processor's registers are.

Arrays of N lanes are laid out for this in blocks (B, ..., 4); the last block repeats its last lane.
"""

# mypy: disable-error-code="no-untyped-call, untyped-decorator, import-untyped"
# (the interface of numba's compiler has no types)

import operator
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, cast

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.core import cgutils
from numba.core.typeconv.castgraph import Conversion
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, lower_cast, models, register_model
from numba.np import arrayobj
from numpy.typing import NDArray

from spinepipe.effects.contract import Array, Indices

WIDTH = 4
"""Lanes: the doubles of an AVX2 register. A lone lane so costs what it does in scalar code."""

SOURCE = sha256(Path(__file__).read_bytes()).hexdigest()
"""Part of the key of every compilation that is cached: `inner` functions of this file are compiled
into those of others."""

_VECTOR = ir.VectorType(ir.DoubleType(), WIDTH)

Plain = tuple[NDArray[Any], ...]
"""Arrays as compiled code takes them: a cached compilation must not name our classes, for it is
read again before one knows whether they have changed."""

P = ParamSpec("P")
R = TypeVar("R")


def inner(function: Callable[P, R]) -> Callable[P, R]:
    """A function for compiled ones of the same file: these are cached along with it.

    Division by zero is no exception (``error_model``): lanes that run away are given up later.
    """
    result: Callable[P, R] = njit(error_model="numpy")(function)
    return result


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """The function as machine code, cached beside its file; division by zero is no exception.

    Entries are copied and added one by one in loops: for `a[:] = b` or `a += b` of arrays a message
    about shapes is compiled each time, which takes longer than all the rest.
    """
    result: Any = njit(cache=True, error_model="numpy")(function)
    cache = result._cache._cache_file  # numba looks at the function's own file alone
    cache._source_stamp = (cache._source_stamp, SOURCE)
    return cast(Callable[P, R], result)


def blocks(lanes: NDArray[Any]) -> NDArray[Any]:
    """(B, ..., 4) from lanes (N, ...)."""
    count, shape = -(-len(lanes) // WIDTH), lanes.shape[1:]
    if count * WIDTH != len(lanes):
        lanes = lanes[np.minimum(np.arange(count * WIDTH), len(lanes) - 1)]
    apart = lanes.reshape(count, WIDTH, *shape)
    return np.ascontiguousarray(apart.transpose(0, *range(2, apart.ndim), 1))


def lanes(found: NDArray[Any], count: int) -> NDArray[Any]:
    """(N, ...) of blocks (B, ..., 4)."""
    last = found.ndim - 1
    apart = found.transpose(0, last, *range(1, last))  # the lanes of a block behind its number
    return apart.reshape(WIDTH * len(found), *found.shape[1:last])[:count]


class LaneType(types.Type):
    """The type of four lanes."""

    def __init__(self) -> None:
        super().__init__(name=f"Lanes{WIDTH}")

    def can_convert_from(self, typingctx: Any, other: Any) -> Any:
        """A plain number stands for four equal ones."""
        return Conversion.promote if other == types.float64 else None


LANES = LaneType()


@register_model(LaneType)
class _Model(models.PrimitiveModel):
    def __init__(self, manager: Any, numba_type: Any) -> None:
        super().__init__(manager, numba_type, _VECTOR)


@lower_cast(types.Float, LaneType)
def _equal(context: Any, builder: Any, fromty: Any, toty: Any, value: Any) -> Any:
    vector = ir.Constant(_VECTOR, ir.Undefined)
    for lane in range(WIDTH):
        vector = builder.insert_element(vector, value, ir.Constant(ir.IntType(32), lane))
    return vector


def _define(function: Any, instruction: str) -> None:
    """Make an arithmetic operator act on four lanes, or on these and a number.

    The typing rule first (which argument types it takes, and what comes out), then the LLVM
    instruction that does it.
    """

    class Typed(AbstractTemplate):
        def generic(self, args: Any, kws: Any) -> Any:
            if LANES in args and all(one in (LANES, types.float64) for one in args):
                return signature(LANES, *[LANES] * len(args))
            return None

    infer_global(function)(Typed)

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return getattr(builder, instruction)(*args)  # no fast-math: products and sums stay apart

    lower_builtin(function, *[LaneType] * (1 if function is operator.neg else 2))(lower)


for _operator, _instruction in (
    (operator.add, "fadd"),
    (operator.sub, "fsub"),
    (operator.mul, "fmul"),
    (operator.truediv, "fdiv"),
    (operator.iadd, "fadd"),
    (operator.isub, "fsub"),
    (operator.imul, "fmul"),
    (operator.neg, "fneg"),
):
    _define(_operator, _instruction)


def _vectors(typingctx: Any, array: Any) -> Any:
    """The same memory (..., 4) as an array (...) of four lanes each."""
    if not isinstance(array, types.Array) or array.layout != "C":
        return None
    # unaligned: numpy allocates on 16 bytes, an AVX2 vector's own alignment is 32
    view = types.Array(LANES, array.ndim - 1, "C", aligned=False)

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        old = arrayobj.make_array(array)(context, builder, args[0])
        new = arrayobj.make_array(view)(context, builder)
        shape = cgutils.unpack_tuple(builder, old.shape)[:-1]
        strides = cgutils.unpack_tuple(builder, old.strides)[:-1]
        arrayobj.populate_array(
            new,
            builder.bitcast(old.data, _VECTOR.as_pointer()),
            shape,
            strides,
            context.get_constant(types.intp, 8 * WIDTH),
            old.meminfo,
            old.parent,
        )
        if context.enable_nrt:  # the view holds the memory alive as the array does
            context.nrt.incref(builder, view, new._getvalue())
        return new._getvalue()

    return view(array), lower


vectors: Any = intrinsic(_vectors)


@inner
def gather(rows: Array, chosen: Indices, first: int, out: Array) -> None:
    """Fill out (n, 4) with rows (N, n) of the lanes from the first on, as ``chosen`` (L,) says.

    Where the last block has fewer than four lanes, its last one is repeated.
    """
    for lane in range(WIDTH):
        row = chosen[min(first + lane, len(chosen) - 1)]
        for c in range(len(out)):
            out[c, lane] = rows[row, c]


@inner
def scatter(block: Array, first: int, rows: Array) -> None:
    """Enter a block (n, 4) in rows (N, n), from the first on."""
    for lane in range(min(WIDTH, len(rows) - first)):
        for c in range(len(block)):
            rows[first + lane, c] = block[c, lane]


@inner
def add_product(matrix: NDArray[Any], columns: NDArray[Any], out: NDArray[Any]) -> None:
    """Add matrix (r, k) times columns (k, m) to out (r, m), of whatever entries."""
    for r in range(matrix.shape[0]):
        for c in range(columns.shape[1]):
            value = out[r, c]
            for k in range(matrix.shape[1]):
                value += matrix[r, k] * columns[k, c]
            out[r, c] = value
