"""Blocked evaluation of elementwise kernels.

A kernel is written as plain NumPy expressions. Evaluated on a whole array, each
operation would stream through memory and allocate an array of its own; evaluated
block by block, its intermediates stay in the cache and the only large allocation
is the result.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache, partial
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mdfconv.errors import MdfconvError

Array: TypeAlias = NDArray[np.floating[Any]]
Indices: TypeAlias = NDArray[np.integer[Any]]
Mask: TypeAlias = NDArray[np.bool_]
Kernel: TypeAlias = Callable[..., Any]

# Large enough to hide the cost of a call, small enough for the intermediates to stay in cache; no
# power of 2, which would put the same elements of all arrays into the same lines of the cache.
_BLOCK = 90_000
# The GNU C library returns large blocks to the system, and fresh pages cost more than what is
# computed in them. Once a block has been freed, of 31 MB at most, it keeps twice as much. This one
# is never touched.
np.empty(31 << 20, np.uint8)
# Smaller arrays are done sooner than threads are started; a few parts for each thread even out
# what the others are kept from.
_WORTH_THREADS, _PARTS_A_THREAD = 1 << 20, 4


def as_operand(values: ArrayLike) -> Any:
    """Return real numbers in a form that takes part in NumPy's type promotion.

    Python numbers stay as they are, so that they do not widen float32. Raise `MdfconvError` if the
    values are not real numbers.
    """
    if isinstance(values, np.ma.MaskedArray):
        raise MdfconvError("a masked array: fill or compress it first")
    try:
        if type(values) in (int, float):
            return float(values)  # type: ignore[arg-type]
        array = np.asarray(values)
    except OverflowError:
        raise MdfconvError("a number is too large") from None
    except ValueError:
        raise MdfconvError("expected numbers in an array of a regular shape") from None
    if array.dtype.kind not in "fiu":
        raise MdfconvError(f"expected real numbers, got {array.dtype.name}")
    if array.dtype.kind == "f" and array.dtype.itemsize > np.dtype(float).itemsize:
        with np.errstate(all="ignore"):
            double = array.astype(float)
        if ((np.isinf(double) & np.isfinite(array)) | ((double == 0) & (array != 0))).any():
            raise MdfconvError("a number is too large or too small for float64")
    return array


def computing_dtype(*operands: Any) -> tuple[np.dtype[Any], np.dtype[Any]]:
    """Return the type to compute in and the type of the result.

    Both are float32 for float32 input, float64 otherwise; float16 is computed in
    float32 and returned as float16.
    """
    promoted = np.result_type(*operands)
    if promoted == np.float16:
        return np.dtype(np.float32), promoted
    single = promoted == np.float32
    dtype = np.dtype(np.float32 if single else np.float64)
    return dtype, dtype


def evaluate(kernel: Kernel, angles: ArrayLike, *operands: ArrayLike, threads: int = 1) -> Any:
    """Evaluate a kernel over the broadcast of angles and their parameters.

    Parameters
    ----------
    kernel : callable
        ``kernel(angles, *operands, out)`` maps one-dimensional blocks to a block of values,
        which it writes to `out`. The block of angles is as long as `out`; a parameter that
        is constant over the block arrives as a number. They must not be written to.
    angles : array_like
        The angles, in the kernel's variable.
    *operands : array_like
        Parameters that broadcast against `angles`.
    threads : int
        How many share the blocks of a large array.

    Returns
    -------
    numpy.ndarray or numpy scalar
        The values, in the broadcast shape.
    """
    inputs = [as_operand(angles), *(as_operand(operand) for operand in operands)]
    dtype, result_dtype = computing_dtype(*inputs)
    arrays = [np.asarray(value) for value in inputs]
    try:
        size = math.prod(np.broadcast_shapes(*(array.shape for array in arrays)))
    except ValueError:
        shapes = ", ".join(str(array.shape) for array in arrays)
        raise MdfconvError(f"shapes {shapes} do not broadcast against each other") from None
    # An angle that is infinite in a short type is beyond the horizon.
    with np.errstate(over="ignore"):
        iterator = np.nditer(  # type: ignore[call-overload]
            [*arrays, None],
            flags=["external_loop", "buffered", "zerosize_ok", "ranged"],
            op_flags=[["readonly"]] * len(arrays) + [["writeonly", "allocate"]],
            op_dtypes=[dtype] * (len(arrays) + 1),
            casting="same_kind",
            buffersize=_BLOCK,
        )
    with iterator:
        in_parts(partial(_run, kernel, iterator), size, threads)
        result: Any = iterator.operands[-1]
    if result.dtype == result_dtype:
        return result[()]
    # A mirror's D(0) overflows float16: inf is the answer, not an accident.
    with np.errstate(over="ignore"):
        return result.astype(result_dtype)[()]


def _run(kernel: Kernel, iterator: Any, start: int, end: int) -> None:
    """Evaluate a kernel on a part of an iterator's range."""
    part = iterator.copy()
    part.iterrange = start, end
    with part, np.errstate(all="ignore"):
        for angles, *rest, out in part:
            kernel(angles, *(b[0] if b.strides[0] == 0 else b for b in rest), out)


def worth_threads(size: int, threads: int) -> bool:
    """Return whether several threads pay; raise `MdfconvError` unless so many can run."""
    if not isinstance(threads, int | np.integer):
        raise MdfconvError(f"threads are counted, not {threads!r}")
    if threads < 1:
        raise MdfconvError(f"{threads} threads: at least 1")
    return threads > 1 and size >= _WORTH_THREADS


def in_parts(run: Callable[[int, int], None], size: int, threads: int) -> None:
    """Run from 0 to a size, a large range in parts by several threads."""
    if not worth_threads(size, threads):
        run(0, size)
        return
    ends = np.linspace(0, size, threads * _PARTS_A_THREAD + 1).astype(int).tolist()
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(run, ends[:-1], ends[1:]))


def by_blocks(function: Kernel, values: Array, size: int) -> Array:
    """Return a float64 function of values, computed so many at a time, in their shape.

    `function` returns an array, shape (n,), for one.
    """
    flat = np.ravel(values)
    result = np.empty(flat.size)
    for start in range(0, flat.size, size):
        block = slice(start, start + size)
        result[block] = function(flat[block])
    return result.reshape(np.shape(values))


def inverse_square(values: Array) -> Array:
    """Return 1/values², finite even where values² underflows, so that 0 times it is 0.

    So it stays when it is multiplied by a number below 2.
    """
    return np.minimum(1 / (values * values), np.finfo(values.dtype).max / 2)


@cache
def gauss_legendre(order: int) -> tuple[Array, Array]:
    """Return nodes and weights on [−1, 1]; they must not be written to."""
    nodes, weights = np.polynomial.legendre.leggauss(order)
    nodes.flags.writeable = weights.flags.writeable = False
    return nodes, weights


def gauss_panels(edges: Array, order: int) -> tuple[Array, Array]:
    """Return Gauss-Legendre nodes and weights on the n panels between sorted edges.

    Of edges of the shape (..., n + 1) both have the shape (..., n * order).
    """
    x, w = gauss_legendre(order)
    half = 0.5 * np.diff(edges)[..., None]
    nodes = edges[..., :-1, None] + half * (1 + x)
    shape = (*edges.shape[:-1], -1)
    return nodes.reshape(shape), (half * w).reshape(shape)
