"""Formulas as trees, which languages write: made by evaluating functions of NumPy on a name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin


@dataclass(frozen=True, eq=False)
class Expression(NDArrayOperatorsMixin):
    """A node: an operation, called as NumPy's, of operands; or a number or a name without any.

    Functions written for arrays can be evaluated on it; what asks for a value raises TypeError.

    Parameters
    ----------
    operation : str
        The name of a ufunc, or ``number``, ``variable``, ``let`` (an operand that has a name),
        ``where`` and ``clip``.
    operands : tuple of Expression
        What the operation is applied to.
    name : str
        That of a variable or of a ``let``.
    value : float
        That of a number.
    limits : tuple of two floats
        The range of a variable.
    """

    operation: str
    operands: tuple[Expression, ...] = ()
    name: str = ""
    value: float = float("nan")
    limits: tuple[float, float] = (-float("inf"), float("inf"))

    def named(self, name: str) -> Expression:
        """Return it as a constant of the code with a name."""
        return Expression("let", (self,), name)

    @property
    def is_number(self) -> bool:
        """Whether it is a number."""
        return self.operation == "number"

    @property
    def is_atom(self) -> bool:
        """Whether it is a number or has a name."""
        return self.operation in ("number", "variable", "let")

    def __bool__(self) -> bool:
        raise TypeError("an expression has no value")

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *operands: Any, **_: Any) -> Any:
        """Return the node of an operation; one in place makes a new node as well."""
        if method != "__call__":
            return NotImplemented
        return Expression(ufunc.__name__, tuple(map(as_expression, operands)))

    def __array_function__(
        self, function: Any, _: Any, operands: Sequence[Any], options: Mapping[str, Any]
    ) -> Any:
        """Return what a function that is no ufunc makes of it."""
        if function in (np.where, np.clip) and len(operands) == 3 and not options:
            return Expression(function.__name__, tuple(map(as_expression, operands)))
        if function is np.full_like:
            return number(operands[1])
        if function is np.ones_like:
            return number(1)
        return NotImplemented


def number(value: float) -> Expression:
    """Return a number as an expression."""
    return Expression("number", value=float(value))


def variable(name: str, limits: tuple[float, float] = (-np.inf, np.inf)) -> Any:
    """Return a variable; as `Any`, so that it goes into functions of arrays."""
    return Expression("variable", name=name, limits=limits)


def as_expression(value: Any) -> Expression:
    """Return an expression as it is, also out of an array without dimensions, or a number."""
    if isinstance(value, np.ndarray) and not value.ndim:
        value = value.item()
    return value if isinstance(value, Expression) else number(value)


def in_order(node: Expression) -> tuple[Expression, Expression]:
    """Return both operands, in a sum a number first, in a product names first and a number last."""
    first, second = node.operands
    if node.operation == "add" and second.is_number:
        return second, first
    if node.operation == "multiply":
        rank = [2 if one.is_number else 0 if one.is_atom else 1 for one in node.operands]
        return (first, second) if rank[0] <= rank[1] else (second, first)
    return first, second
