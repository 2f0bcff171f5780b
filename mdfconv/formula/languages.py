"""Formulas as code to paste: GLSL, HLSL, C, Python and LaTeX.

A new language is a `Dialect` and one entry in `_DIALECTS`; LaTeX is not code and stands apart.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mdfconv import __version__
from mdfconv.conversion.endpoint import Endpoint
from mdfconv.distributions.parameter import number_text
from mdfconv.fitting.metrics import Display
from mdfconv.formula.family import Formula
from mdfconv.formula.search import Problem, is_glossy

_ASCII = str.maketrans({"α": "alpha"})


@dataclass(frozen=True)
class Dialect:
    """How a language writes what the formulas need.

    Parameters
    ----------
    comment : str
        What starts a comment line.
    head, declare, give, foot : str
        The line of the function with {name} and {argument}; a constant with {name} and {value};
        the result with {value}; what ends the function.
    number, root, inverse_root : callable
        A number in single precision, √ and 1/√ of an expression.
    include : str
        A line that must stand before the function.
    """

    comment: str
    head: str
    declare: str
    give: str
    foot: str
    number: Callable[[float], str]
    root: str
    inverse_root: str
    include: str = ""


def _plain(value: float) -> str:
    return str(np.float32(value))


_SHADER = {
    "comment": "//",
    "head": "float {name}(float {argument}) {{",
    "declare": "    float {name} = {value};",
    "give": "    return {value};",
    "foot": "}",
}
_DIALECTS = {
    "glsl": Dialect(**_SHADER, number=_plain, root="sqrt({})", inverse_root="inversesqrt({})"),
    "hlsl": Dialect(**_SHADER, number=_plain, root="sqrt({})", inverse_root="rsqrt({})"),
    "c": Dialect(
        **_SHADER,
        number=lambda value: f"{_plain(value)}f",
        root="sqrtf({})",
        inverse_root="1.0f / sqrtf({})",
        include="#include <math.h>",
    ),
    "python": Dialect(
        comment="#",
        head="def {name}({argument}):",
        declare="    {name} = {value}",
        give="    return {value}",
        foot="",
        number=_plain,
        root="{} ** 0.5",
        inverse_root="{} ** -0.5",
    ),
}
LANGUAGES = (*_DIALECTS, "latex")


def write_formula(formula: Formula, problem: Problem, language: str) -> str:
    """Return a formula as code that can be pasted, with a comment that states what it keeps.

    Parameters
    ----------
    formula : Formula
        A formula that was found for the problem.
    problem : Problem
        Its pair, metric and range.
    language : str
        One of `LANGUAGES`.
    """
    if language == "latex":
        facts = [f"% {line}" for line in _facts(formula, problem)]
        return "\n".join([*facts, latex(formula, problem)])
    dialect = _DIALECTS[language]
    argument = problem.source.stored.name
    lines, result = _body(formula, problem, dialect, argument)
    return "\n".join(
        [
            *(f"{dialect.comment} {line}" for line in _facts(formula, problem)),
            *([dialect.include] if dialect.include else []),
            dialect.head.format(name=_name(problem), argument=argument),
            *(dialect.declare.format(name=name, value=value) for name, value in lines),
            dialect.give.format(value=result),
            *([dialect.foot] if dialect.foot else []),
        ]
    )


def _name(problem: Problem) -> str:
    sides = [
        f"{side.distribution.name}_{side.stored.name}" for side in (problem.target, problem.source)
    ]
    return "_from_".join(sides).replace("-", "_")


def _facts(formula: Formula, problem: Problem) -> list[str]:
    """Return what a reader of the code must know, in ASCII."""
    sides = [
        f"{side.label} {side.stored.symbol}".translate(_ASCII)
        for side in (problem.source, problem.target)
    ]
    metric = problem.metric
    exposure = f" at exposure {metric.exposure:g}" if isinstance(metric, Display) else ""
    of = " of 1 - g" if is_glossy(problem.target) else ""
    return [
        f"{sides[0]} to {sides[1]}, for {number_text(problem.low)} to {number_text(problem.high)}.",
        f"Least squares under the {metric.name} metric{exposure}: keeps the {metric.keeps}.",
        f"Worst relative error{of} {formula.error:.2g} in float32; {formula.shape.operations} "
        "operations (+ - * count 1; / sqrt 1/sqrt count 4).",
        f"By mdfconv {__version__}.",
    ]


def _body(
    formula: Formula, problem: Problem, dialect: Dialect, argument: str
) -> tuple[list[tuple[str, str]], str]:
    """Return the constants of the function and the expression of its result."""
    shape = formula.shape
    lines: list[tuple[str, str]] = []
    one = dialect.number(1.0)

    def named(name: str, value: str) -> str:
        lines.append((name, value))
        return name

    w = named("w", f"{one} - {argument}") if is_glossy(problem.source) else argument
    has_terms = len(formula.numerator) > 1 or bool(formula.denominator)
    u = w
    if has_terms and shape.variable != 1:
        u = named("u", _raised(w, shape.variable, dialect, named))
    value = _horner(formula.numerator, u, dialect)
    if shape.factor:
        shared = has_terms and shape.factor == shape.variable
        factor = u if shared else _raised(w, shape.factor, dialect, named)
        value = f"{factor} * {_enclosed(value)}"
    if formula.denominator:
        down = _horner((1.0, *formula.denominator), u, dialect)
        value = f"{_enclosed(value) if not shape.factor else value} / ({down})"
    if shape.outer != 1:
        value = _raised(named("v", value), shape.outer, dialect, named)
    return lines, f"{one} - {_enclosed(value)}" if is_glossy(problem.target) else value


def _enclosed(value: str) -> str:
    return f"({value})" if " " in value else value


def _raised(base: str, exponent: float, dialect: Dialect, named: Callable[[str, str], str]) -> str:
    """Return the expression of a name raised to one of the family's powers."""
    square = f"{base} * {base}"
    if exponent == 4:
        square = named("w2", square)
        return f"{square} * {square}"
    one = dialect.number(1.0)
    root = _enclosed(dialect.root.format(base))
    return {
        1.0: base,
        2.0: square,
        -1.0: f"{one} / {base}",
        -2.0: f"{one} / ({square})",
        0.5: dialect.root.format(base),
        -0.5: dialect.inverse_root.format(base),
        0.25: dialect.root.format(root),
        -0.25: dialect.inverse_root.format(root),
    }[exponent]


def _horner(coefficients: tuple[float, ...], u: str, dialect: Dialect) -> str:
    value = dialect.number(coefficients[-1])
    for coefficient in coefficients[-2::-1]:
        value = f"{dialect.number(coefficient)} + {u} * {_enclosed(value)}"
    return value


def latex(formula: Formula, problem: Problem) -> str:
    """Return a formula as LaTeX, without a comment."""
    shape = formula.shape
    symbol = _latex_symbol(problem.source)
    base = f"(1 - {symbol})" if is_glossy(problem.source) else symbol
    value = _latex_polynomial(formula.numerator, base, shape.variable)
    if formula.denominator:
        down = _latex_polynomial((1.0, *formula.denominator), base, shape.variable)
        value = rf"\frac{{{value}}}{{{down}}}"
    elif shape.factor and len(formula.numerator) > 1:
        value = rf"\left({value}\right)"
    if shape.factor and len(formula.numerator) == 1 and not formula.denominator:
        value = f"{value} {_latex_power(base, shape.factor)}"
    elif shape.factor:
        value = f"{_latex_power(base, shape.factor)} {value}"
    if shape.outer != 1:
        value = rf"\left({value}\right)^{{{_exponent(shape.outer)}}}"
    elif is_glossy(problem.target):
        value = rf"\left({value}\right)"
    start = "1 - " if is_glossy(problem.target) else ""
    return f"{_latex_symbol(problem.target)} = {start}{value}"


def _latex_symbol(side: Endpoint) -> str:
    head, _, tail = side.stored.symbol.replace("α", r"\alpha").partition("_")
    return f"{head}_{{{tail}}}" if tail else head


def _latex_polynomial(coefficients: tuple[float, ...], base: str, exponent: float) -> str:
    text = ""
    for index, coefficient in enumerate(coefficients):
        head, _, tail = _plain(abs(coefficient)).partition("e")
        number = rf"{head} \cdot 10^{{{int(tail)}}}" if tail else head
        sign = "-" if coefficient < 0 else "+"
        factor = rf" {_latex_power(base, index * exponent)}" if index else ""
        text += f" {sign} {number}{factor}" if text else f"{'-' * (sign == '-')}{number}{factor}"
    return text


def _latex_power(base: str, exponent: float) -> str:
    return base if exponent == 1 else f"{base}^{{{_exponent(exponent)}}}"


def _exponent(value: float) -> str:
    top, bottom = value.as_integer_ratio()
    return f"{top}/{bottom}" if bottom > 1 else f"{top}"
