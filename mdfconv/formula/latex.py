"""Formulas as LaTeX."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction

import numpy as np

from mdfconv.distributions.parameter import number_text
from mdfconv.formula.code import Code, Language, ascii_text
from mdfconv.formula.exact import StoredNumber
from mdfconv.formula.expression import Expression, in_order

_LARGEST_DENOMINATOR = 100
# How tightly what stands around a text binds: a choice, a sum, a product or a power, a name.
_CHOICE, _SUM, _PRODUCT, _NAME = range(4)


class Latex(Language):
    """The formula as LaTeX."""

    comment = "%"

    def lines(self, code: Code) -> list[str]:
        """Return an equation in a line for each result, with the range in which it holds."""
        ranges = r", \quad ".join(map(_latex_range, code.arguments))
        return [rf"{equation}, \quad {ranges}" for equation in self._equations(code)]

    def short(self, code: Code) -> str:
        """Return the equations."""
        return r", \quad ".join(self._equations(code))

    def _equations(self, code: Code) -> Iterator[str]:
        symbols = {one.name: _latex_symbol(one.symbol) for one in code.arguments}
        for result, expression in zip(code.results, code.expressions, strict=True):
            yield f"{_latex_symbol(result.symbol)} = {_latex(expression, symbols)}"


def _latex(node: Expression, symbols: dict[str, str], least: int = _CHOICE) -> str:
    """Return an expression as LaTeX, in parentheses if it binds less than it must."""
    if node.operation in ("let", "clip"):
        return _latex(node.operands[0], symbols, least)
    if node.is_number:
        text, binds = _latex_number(node.value), _NAME if node.value >= 0 else _SUM
    elif node.is_atom:
        text, binds = symbols[node.name], _NAME
    else:
        text, binds = _latex_operation(node, symbols)
    return text if binds >= least else rf"\left({text}\right)"


def _latex_operation(node: Expression, symbols: dict[str, str]) -> tuple[str, int]:
    coefficients, variable = _polynomial(node)
    if variable is not None:
        base, exponent = _base(variable)
        return _latex_polynomial(coefficients, _latex(base, symbols, _NAME), exponent), _SUM
    first = node.operands[0]
    match node.operation:
        case "power":
            base, exponent = _base(node)
            return _latex_power(_latex(base, symbols, _NAME), exponent), _PRODUCT
        case "divide":
            above, below = (_latex(one, symbols) for one in node.operands)
            return rf"\frac{{{above}}}{{{below}}}", _PRODUCT
        case "multiply":
            before, after = in_order(node)
            if after.is_number:
                before, after = after, before
            return (
                f"{_latex(before, symbols, _PRODUCT)} {_latex(after, symbols, _PRODUCT)}",
                _PRODUCT,
            )
        case "add" | "subtract":
            sign = "+" if node.operation == "add" else "-"
            left, right = in_order(node)
            return f"{_latex(left, symbols, _SUM)} {sign} {_latex(right, symbols, _PRODUCT)}", _SUM
        case "log":
            return rf"\ln {_latex(first, symbols, _NAME)}", _PRODUCT
        case "select":
            low, high, one, other = (_latex(operand, symbols) for operand in node.operands)
            cases = rf"{one} & \text{{if }} {low} < {high} \\ {other} & \text{{otherwise}}"
            return rf"\begin{{cases}} {cases} \end{{cases}}", _CHOICE
    name = {"minimum": "min", "maximum": "max"}[node.operation]
    both = ", ".join(_latex(one, symbols) for one in node.operands)
    return rf"\{name}\left({both}\right)", _PRODUCT


def _polynomial(node: Expression) -> tuple[tuple[float, ...], Expression | None]:
    """Return coefficients and variable of a polynomial in Horner's form; no variable for others."""
    coefficients: list[float] = []
    variable = None
    while node.operation == "add" and node.operands[1].is_number:
        product, constant = node.operands
        if product.operation != "multiply" or (
            coefficients and product.operands[1] is not variable
        ):
            break
        coefficients.append(constant.value)
        node, variable = product.operands
    return (*coefficients, node.value), variable if node.is_number else None


def _base(node: Expression) -> tuple[Expression, float]:
    """Return what is raised to a power, and the exponent: 1 for what is no power."""
    while node.operation == "let":
        node = node.operands[0]
    if node.operation == "power" and node.operands[1].is_number:
        return node.operands[0], node.operands[1].value
    return node, 1.0


def _latex_symbol(symbol: str) -> str:
    head, _, tail = ascii_text(symbol, r"\{}").partition("_")
    return f"{head}_{{{tail}}}" if tail else head


def _latex_range(stored: StoredNumber) -> str:
    """Return the legal range of a number."""
    parameter, symbol = stored.parameter, _latex_symbol(stored.symbol)
    above, below = (
        r"\le" if closed else "<" for closed in (parameter.lower_closed, parameter.upper_closed)
    )
    start = f"{number_text(parameter.lower)} {above} {symbol}"
    return f"{start} {below} {number_text(parameter.upper)}" if parameter.upper < np.inf else start


def _latex_number(value: float) -> str:
    head, _, tail = str(np.float32(value)).partition("e")
    head = head.removesuffix(".0")
    return rf"{head} \cdot 10^{{{int(tail)}}}" if tail else head


def _latex_polynomial(coefficients: tuple[float, ...], base: str, exponent: float) -> str:
    text = ""
    for index, coefficient in enumerate(coefficients):
        number = _latex_number(abs(coefficient))
        sign = "-" if coefficient < 0 else "+"
        factor = rf" {_latex_power(base, index * exponent)}" if index else ""
        text += f" {sign} {number}{factor}" if text else f"{'-' * (sign == '-')}{number}{factor}"
    return text


def _latex_power(base: str, exponent: float) -> str:
    return base if exponent == 1 else f"{base}^{{{_exponent(exponent)}}}"


def _exponent(value: float) -> str:
    fraction = Fraction(value).limit_denominator(_LARGEST_DENOMINATOR)
    return str(fraction) if float(fraction) == value else _latex_number(value)
