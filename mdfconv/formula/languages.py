"""Formulas as code to paste: GLSL, HLSL, C, Python and LaTeX.

A new language of code is a `Syntax` that is added to `LANGUAGES`; LaTeX is not code and stands
apart.
"""

from __future__ import annotations

import keyword
import re
import unicodedata
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mdfconv import __version__
from mdfconv.distributions.endpoint import Endpoint
from mdfconv.distributions.parameter import number_text
from mdfconv.formula.family import Formula
from mdfconv.formula.search import SearchProblem, is_glossy
from mdfconv.registry import Registry

# What an argument cannot be called: words of the emitted code, and of the languages. Words with
# digits or capitals are not listed, as no argument has any.
_WORDS = """
    u v w sqrt sqrtf rsqrt inversesqrt clamp fminf fmaxf np

    active alignas alignof asm asm_fragment atomic_uint attribute auto bool break buffer case cast
    catch cbuffer centroid char class coherent column_major common compile compile_fragment const
    const_cast constexpr continue default delete demote discard do double dword dynamic_cast else
    enum explicit export extern external false filter fixed flat float for friend fxgroup goto
    groupshared half highp if in inline inout input int interface invariant layout line lineadj
    linear long lowp matrix mediump mutable namespace new noinline nointerpolation noperspective
    nullptr operator out output packoffset partition pass patch pixelfragment point precise
    precision private protected public readonly register reinterpret_cast resource restrict return
    row_major sample sampler shared short signed sizeof smooth snorm stateblock static
    static_assert static_cast string struct subroutine superp switch tbuffer technique template
    texture this thread_local throw triangle triangleadj true try typedef typename typeof uint
    uniform union unorm unsigned using varying vector vertexfragment virtual void volatile while
    writeonly
"""
_TAKEN = {*_WORDS.split(), *keyword.kwlist}


def _plain(value: float) -> str:
    return str(np.float32(value))


@dataclass(frozen=True)
class Syntax:
    """How a programming language writes what the formulas need; without words of its own as GLSL.

    Parameters
    ----------
    inverse_root, root, clamp : str
        1/√ and √ of an expression; one clamped to a lower and an upper bound.
    number : callable
        A number in single precision.
    head, declare, end, foot : str
        The line of the function with {name} and {argument}; a constant with {name} and {value};
        what ends a statement; what ends the function.
    include : str
        What must stand before the function.
    comment : str
        What starts a comment line.
    """

    inverse_root: str
    root: str = "sqrt({})"
    clamp: str = "clamp({}, {}, {})"
    number: Callable[[float], str] = _plain
    head: str = "float {name}(float {argument}) {{"
    declare: str = "float {name} = {value}"
    end: str = ";"
    foot: str = "}"
    include: str = ""
    comment: str = "//"

    def lines(self, formula: Formula, problem: SearchProblem) -> list[str]:
        """Return the lines of a function of the source's stored value."""
        argument = argument_name(problem.source.stored.name)
        return [
            *([self.include] if self.include else []),
            self.head.format(name=function_name(problem), argument=argument),
            *(f"    {statement}{self.end}" for statement in self._statements(formula, problem)),
            *([self.foot] if self.foot else []),
        ]

    def one_line(self, formula: Formula, problem: SearchProblem) -> str:
        """Return the statements of the function."""
        return "; ".join(self._statements(formula, problem))

    def _statements(self, formula: Formula, problem: SearchProblem) -> list[str]:
        constants, result = _body(formula, problem, self)
        declared = [
            self.declare.format(name=name, value=value) for name, value in constants.items()
        ]
        return [*declared, f"return {result}"]


class Latex:
    """The formula as LaTeX."""

    comment = "%"

    def lines(self, formula: Formula, problem: SearchProblem) -> list[str]:
        """Return the one line of an equation, with the range in which it holds."""
        low, high = _latex_number(problem.low), _latex_number(problem.high)
        condition = rf"{low} \le {_latex_symbol(problem.source)} \le {high}"
        return [rf"{self.one_line(formula, problem)}, \quad {condition}"]

    def one_line(self, formula: Formula, problem: SearchProblem) -> str:
        """Return the equation."""
        shape = formula.shape
        symbol = _latex_symbol(problem.source)
        base = f"(1 - {symbol})" if is_glossy(problem.source) else symbol
        value = _latex_polynomial(formula.numerator, base, shape.variable)
        if formula.denominator:
            down = _latex_polynomial((1.0, *formula.denominator), base, shape.variable)
            value = rf"\frac{{{value}}}{{{down}}}"
        elif shape.factor and shape.has_terms:
            value = rf"\left({value}\right)"
        if shape.factor and not shape.has_terms:
            value = f"{value} {_latex_power(base, shape.factor)}"
        elif shape.factor:
            value = f"{_latex_power(base, shape.factor)} {value}"
        if shape.outer != 1:
            value = rf"\left({value}\right)^{{{_exponent(shape.outer)}}}"
        elif is_glossy(problem.target):
            value = rf"\left({value}\right)"
        start = "1 - " if is_glossy(problem.target) else ""
        return f"{_latex_symbol(problem.target)} = {start}{value}"


LANGUAGES: Registry[Syntax | Latex] = Registry("language")
LANGUAGES.add("glsl", Syntax(inverse_root="inversesqrt({})"))
LANGUAGES.add("hlsl", Syntax(inverse_root="rsqrt({})"))
LANGUAGES.add(
    "c",
    Syntax(
        inverse_root="1.0f / sqrtf({})",
        root="sqrtf({})",
        clamp="fminf(fmaxf({}, {}), {})",
        number=lambda value: f"{_plain(value)}f",
        include="#include <math.h>",
    ),
)
LANGUAGES.add(
    "python",
    Syntax(
        inverse_root="{} ** -0.5",
        root="{} ** 0.5",
        # min and max of the language are for numbers alone.
        clamp="np.clip({}, {}, {})",
        head="def {name}({argument}):",
        declare="{name} = {value}",
        end="",
        foot="",
        include="import numpy as np\n\n",
        comment="#",
    ),
)
LANGUAGES.add("latex", Latex())


def write_formula(formula: Formula, problem: SearchProblem, language: str) -> str:
    """Return a formula as code that can be pasted, with a comment that states what it keeps.

    Parameters
    ----------
    formula : Formula
        A formula for the problem.
    problem : Problem
        Its pair, metric and range.
    language : str
        One of `LANGUAGES`.

    Raises
    ------
    MdfconvError
        If the language is not known.
    """
    form = LANGUAGES[language]
    comments = [f"{form.comment} {line}" for line in _facts(formula, problem)]
    return "\n".join([*comments, *form.lines(formula, problem)])


def function_name(problem: SearchProblem) -> str:
    """Return an identifier that says what is computed, and γ where it is not the usual one."""
    ends = []
    for end in (problem.target, problem.source):
        owner, second = end.distribution, end.distribution.second_parameter
        gamma = ""
        if second and owner.gamma != second.default:
            gamma = f" {second.name} {number_text(owner.gamma)}"
        ends.append(f"{owner.name}{gamma} {end.stored.name}")
    return _identifier(" from ".join(ends))


def argument_name(name: str) -> str:
    """Return a parameter's name as that of an argument, ``_value`` after what has a meaning."""
    identifier = _identifier(name).lower()
    plain = identifier not in _TAKEN and not any(map(str.isdigit, identifier))
    return identifier if plain else f"{identifier}_value"


def _identifier(text: str) -> str:
    # In GLSL two underscores in a row are reserved.
    words = re.findall("[A-Za-z0-9]+", _ascii(text))
    return "_".join(words if words and words[0][0].isalpha() else ["f", *words])


def _ascii(text: str, greek: str = "{}") -> str:
    """Return a text with its Greek letters spelled, in a form such as ``<{}>``."""
    return "".join(
        letter if letter.isascii() else greek.format(unicodedata.name(letter).split()[-1].lower())
        for letter in text
    )


def _facts(formula: Formula, problem: SearchProblem) -> list[str]:
    """Return what a reader of the code must know, in ASCII."""
    source, target = (_ascii(_end_text(end)) for end in (problem.source, problem.target))
    metric = problem.metric
    # A metric may be named after a file; a comment is one line.
    named = "".join(letter if letter.isprintable() else "?" for letter in str(metric))
    of = " of 1 - g" if is_glossy(problem.target) else ""
    return [
        f"{source} to {target}, for {number_text(problem.low)} to {number_text(problem.high)}; "
        "outside, the input is clamped.",
        f"Least squares under the {named} metric: keeps the {metric.keeps}.",
        f"Worst relative error{of} {formula.error:.2g} in float32; {formula.shape.operations} "
        "operations (+ - * count 1, clamp 2, / sqrt 1/sqrt 4).",
        f"By mdfconv {__version__}.",
    ]


def _end_text(end: Endpoint) -> str:
    owner, second = end.distribution, end.distribution.second_parameter
    gamma = f" at {second.symbol} = {number_text(owner.gamma)}" if second else ""
    return f"{end.label} {end.stored.symbol}{gamma}"


def _body(formula: Formula, problem: SearchProblem, dialect: Syntax) -> tuple[dict[str, str], str]:
    """Return the constants of the function and the expression of its result."""
    shape = formula.shape
    constants: dict[str, str] = {}
    one = dialect.number(1.0)

    def named(name: str, value: str) -> str:
        constants[name] = value
        return name

    w = argument_name(problem.source.stored.name)
    if not shape.is_constant:
        clamped = dialect.clamp.format(w, dialect.number(problem.low), dialect.number(problem.high))
        w = named("w", f"{one} - {clamped}" if is_glossy(problem.source) else clamped)
    u = w
    if shape.has_terms and shape.variable != 1:
        u = named("u", _raised(w, shape.variable, dialect, named))
    value = _horner(formula.numerator, u, dialect)
    if shape.factor:
        factor = u if shape.shares_factor else _raised(w, shape.factor, dialect, named)
        value = f"{factor} * {_enclosed(value)}"
    if formula.denominator:
        down = _horner((1.0, *formula.denominator), u, dialect)
        value = f"{_enclosed(value) if not shape.factor else value} / ({down})"
    if shape.outer != 1:
        value = _raised(named("v", value), shape.outer, dialect, named)
    return constants, f"{one} - {_enclosed(value)}" if is_glossy(problem.target) else value


def _enclosed(value: str) -> str:
    return f"({value})" if " " in value else value


def _raised(base: str, exponent: float, dialect: Syntax, named: Callable[[str, str], str]) -> str:
    """Return the expression of a name raised to one of the family's powers."""
    if exponent == 4:
        square = named("w2", f"{base} * {base}")
        return f"{square} * {square}"
    if exponent == 2:
        return f"{base} * {base}"
    if exponent == 1:
        return base
    if abs(exponent) == 0.5:
        return (dialect.root if exponent > 0 else dialect.inverse_root).format(base)
    if abs(exponent) == 0.25:
        return _raised(_enclosed(dialect.root.format(base)), 2 * exponent, dialect, named)
    return f"{dialect.number(1.0)} / {_enclosed(_raised(base, -exponent, dialect, named))}"


def _horner(coefficients: tuple[float, ...], u: str, dialect: Syntax) -> str:
    value = dialect.number(coefficients[-1])
    for coefficient in coefficients[-2::-1]:
        value = f"{dialect.number(coefficient)} + {u} * {_enclosed(value)}"
    return value


def _latex_symbol(end: Endpoint) -> str:
    head, _, tail = _ascii(end.stored.symbol, r"\{}").partition("_")
    return f"{head}_{{{tail}}}" if tail else head


def _latex_number(value: float) -> str:
    head, _, tail = _plain(value).partition("e")
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
    top, bottom = value.as_integer_ratio()
    return f"{top}/{bottom}" if bottom > 1 else f"{top}"
