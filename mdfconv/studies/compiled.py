"""The printed expressions on arrays of Dr.Jit: what its LLVM backend makes of the same formulas.

Dr.Jit is no dependency. Where it is installed it says how quickly this processor can evaluate a
form: one pass over memory, vectorized elementary functions, one thread.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from importlib import import_module
from typing import Any

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin

from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array


def drjit_evaluation(mdf: Distribution, beta: Array, parameter: float) -> Callable[[], Any] | None:
    """Return what evaluates the printed unit form in Dr.Jit, in one thread.

    Angles and whatever depends on the parameter are variables of the compiled code, which is made
    once for all parameters; γ is a constant of it. Every call computes anew and waits for the end.
    It returns an array of Dr.Jit.

    Parameters
    ----------
    mdf : Distribution
        The distribution; γ is that of it.
    beta : numpy.ndarray, shape (n,)
        Angles in radians, float32 or float64; all is computed in their type.
    parameter : float
        The parameter, unchecked.

    Returns
    -------
    callable or None
        None where Dr.Jit is not installed or finds no LLVM, or lacks a function of the form.
    """
    drjit = _drjit()
    if drjit is None:
        return None
    drjit.set_thread_count(1)
    kind = drjit.llvm.Float64 if beta.dtype == np.float64 else drjit.llvm.Float
    angles = _CompiledArray(kind(beta))
    # In NumPy's type, by which it is known from the constants of the expression.
    arguments = [beta.dtype.type(parameter)]
    gamma = [float(mdf.gamma)] if mdf.second_parameter else []

    def evaluate() -> Any:
        with np.errstate(all="ignore"):
            value = mdf.printed.unit(angles, *arguments, *gamma).value
        drjit.eval(value)
        drjit.sync_thread()
        return value

    try:
        evaluate()
    except TypeError:
        return None
    return evaluate


def _drjit() -> Any:
    """Return the module; None where it is not installed or finds no LLVM."""
    try:
        drjit = import_module("drjit")
        import_module("drjit.llvm")
    except ImportError:
        return None
    return drjit if drjit.has_backend(drjit.JitBackend.LLVM) else None


class _CompiledArray(NDArrayOperatorsMixin):
    """An array of Dr.Jit on which NumPy's functions compute."""

    def __init__(self, value: Any) -> None:
        self.value = value

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        return NotImplemented if options else self._apply(ufunc, inputs)

    def __array_function__(
        self, function: Any, types: Any, inputs: Sequence[Any], options: Mapping[str, Any]
    ) -> Any:
        return NotImplemented if options else self._apply(function, inputs)

    def _apply(self, function: Any, inputs: Sequence[Any]) -> Any:
        compiled = _functions().get(function)
        if compiled is None:
            return NotImplemented
        return _CompiledArray(compiled(*map(self._operand, inputs)))

    def _operand(self, operand: Any) -> Any:
        """Return an operand for Dr.Jit: a scalar of NumPy as a variable, others as constants."""
        if isinstance(operand, _CompiledArray):
            return operand.value
        if isinstance(operand, np.floating):
            return _drjit().opaque(type(self.value), float(operand))
        return bool(operand) if isinstance(operand, np.bool_) else operand


@cache
def _functions() -> dict[Any, Callable[..., Any]]:
    """Return what Dr.Jit has in the place of NumPy's functions."""
    drjit = _drjit()

    def tan(angle: Any) -> Any:
        # Quicker than its own tangent; the sine and the cosine are computed once for all.
        sine, cosine = drjit.sincos(angle)
        return sine / cosine

    renamed = {
        np.add: operator.add,
        np.subtract: operator.sub,
        np.multiply: operator.mul,
        np.divide: operator.truediv,
        np.negative: operator.neg,
        np.greater: operator.gt,
        np.less: operator.lt,
        np.cos: lambda angle: drjit.sincos(angle)[1],
        np.sin: lambda angle: drjit.sincos(angle)[0],
        np.tan: tan,
        np.where: drjit.select,
    }
    same = (np.power, np.square, np.sqrt, np.exp, np.log)
    return renamed | {function: getattr(drjit, function.__name__) for function in same}
