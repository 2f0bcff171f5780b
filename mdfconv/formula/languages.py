"""Formulas as text to paste: code of several languages, MaterialX and LaTeX.

A new language of code is a `Syntax` that is added to `LANGUAGES`; MaterialX is a graph, and LaTeX
stands apart.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from mdfconv.formula.code import Code, Language, exact_code, fitted_code
from mdfconv.formula.exact import ExactRelation
from mdfconv.formula.expression import Expression, in_order, number
from mdfconv.formula.family import Formula
from mdfconv.formula.latex import Latex
from mdfconv.formula.search import SearchProblem
from mdfconv.registry import Registry


def _plain(value: float) -> str:
    return str(np.float32(value))


def _single(value: float) -> str:
    return f"{_plain(value)}f"


def _double(value: float) -> str:
    """Return a number in double precision, one of single precision in as few digits as there."""
    return _plain(value) if float(np.float32(value)) == value else repr(value)


class _Steps:
    """Brings expressions to what languages have: powers in steps, a name for what stands twice."""

    def __init__(self, expressions: Sequence[Expression]) -> None:
        self._uses: Counter[int] = Counter()
        self._done: dict[int, Expression] = {}
        self._names = 0
        for expression in expressions:
            self._count(expression)
        self.expressions = [self._lowered(expression) for expression in expressions]

    def _count(self, node: Expression) -> None:
        self._uses[id(node)] += 1
        if self._uses[id(node)] == 1:
            for operand in node.operands:
                self._count(operand)

    def _lowered(self, node: Expression) -> Expression:
        if id(node) not in self._done:
            result = self._in_steps(node)
            again = self._uses[id(node)] > 1
            self._done[id(node)] = self._atom(result) if again else result
        return self._done[id(node)]

    def _in_steps(self, node: Expression) -> Expression:
        if not node.operands:
            return node
        first, *others = map(self._lowered, node.operands)
        if node.operation == "power" and others[0].is_number:
            return self._raised(first, others[0].value)
        return Expression(node.operation, (first, *others), node.name)

    def _atom(self, node: Expression) -> Expression:
        if node.is_atom:
            return node
        self._names += 1
        # No other name has digits.
        return node.named(f"t{self._names}")

    def _raised(self, base: Expression, exponent: float) -> Expression:
        if exponent == 1:
            return base
        if abs(exponent) == 0.5:
            return Expression("sqrt" if exponent > 0 else "inverse_root", (base,))
        if abs(exponent) == 0.25:
            return self._raised(Expression("sqrt", (base,)), 2 * exponent)
        if exponent in (-1, -2, -3, -4):
            return number(1) / self._raised(base, -exponent)
        if exponent not in (2, 3, 4):
            return Expression("power", (base, number(exponent)))
        base = self._atom(base)
        square = base * base
        if exponent == 4:
            square = self._atom(square)
            return square * square
        return square if exponent == 2 else square * base


# How tightly a text binds: a choice, a sum, a quotient, a product, a power, a call.
_CHOICE, _SUM, _QUOTIENT, _PRODUCT, _POWER, _CALL = range(6)
# What an operator in a template makes of it.
_BINDS = {"?": _CHOICE, " / ": _QUOTIENT, "**": _POWER}


@dataclass(frozen=True)
class Syntax(Language):
    """How a programming language writes what the formulas need; without words of its own as GLSL.

    Parameters
    ----------
    inverse_root, root, clamp : str
        1/√ and √ of an expression; one clamped to a lower and an upper bound.
    power, minimum, maximum, log, select : str
        One raised to another; the smaller and the larger of two; a natural logarithm; of four
        the third if the first is less than the second, else the fourth.
    number : callable
        A number in single precision.
    head, argument, declare, end, foot : str
        The line of the function with {name} and {arguments}; an argument; a constant with {name}
        and {value}; what ends a statement; what ends the function.
    include : str
        What must stand before the function.
    comment : str
        What starts a comment line.
    """

    inverse_root: str
    root: str = "sqrt({})"
    clamp: str = "clamp({}, {}, {})"
    power: str = "pow({}, {})"
    minimum: str = "min({}, {})"
    maximum: str = "max({}, {})"
    log: str = "log({})"
    select: str = "{} < {} ? {} : {}"
    number: Callable[[float], str] = _plain
    head: str = "float {name}({arguments}) {{"
    argument: str = "float {}"
    declare: str = "float {name} = {value}"
    end: str = ";"
    foot: str = "}"
    include: str = ""
    comment: str = "//"

    def lines(self, code: Code) -> list[str]:
        """Return the lines of a function for each result."""
        arguments = ", ".join(self.argument.format(one.name) for one in code.arguments)
        lines = [self.include] if self.include else []
        for result, expression in zip(code.results, code.expressions, strict=True):
            lines += [] if result is code.results[0] else [""] * (1 if self.foot else 2)
            name = code.function_name([result])
            lines.append(self.head.format(name=name, arguments=arguments))
            lines += [f"    {statement}{self.end}" for statement in self._statements(expression)]
            lines += [self.foot] if self.foot else []
        return lines

    def short(self, code: Code) -> str:
        """Return the statements of the functions."""
        statements = (text for one in code.expressions for text in self._statements(one))
        return "; ".join(statements)

    def _statements(self, expression: Expression) -> list[str]:
        constants: dict[str, str] = {}
        result = self._text(_Steps([expression]).expressions[0], constants)
        declared = [
            self.declare.format(name=name, value=value) for name, value in constants.items()
        ]
        return [*declared, f"return {result}"]

    def _text(self, node: Expression, constants: dict[str, str], least: int = _CHOICE) -> str:
        """Return an expression as text, in parentheses if it binds less than it must."""
        if node.operation == "let":
            if node.name not in constants:
                constants[node.name] = self._text(node.operands[0], constants)
            return node.name
        if node.is_atom:
            return self.number(node.value) if node.is_number else node.name
        text, binds = self._operation(node, constants)
        return text if binds >= least else f"({text})"

    def _operation(self, node: Expression, constants: dict[str, str]) -> tuple[str, int]:
        if node.operation in _ARITHMETIC:
            sign, binds, needed = _ARITHMETIC[node.operation]
            first, second = in_order(node)
            left = self._text(first, constants, min(binds, _QUOTIENT))
            return f"{left} {sign} {self._text(second, constants, needed)}", binds
        template = getattr(self, _TEMPLATES.get(node.operation, node.operation))
        # Without a call around them they are bound by an operator.
        inside = _CHOICE if "(" in template else _CALL
        text = template.format(*(self._text(one, constants, inside) for one in node.operands))
        return text, min((_BINDS[sign] for sign in _BINDS if sign in template), default=_CALL)


# The sign, how tightly it binds, and how tightly what follows it must.
_ARITHMETIC = {
    "add": ("+", _SUM, _QUOTIENT),
    "subtract": ("-", _SUM, _QUOTIENT),
    "multiply": ("*", _PRODUCT, _PRODUCT),
    "divide": ("/", _QUOTIENT, _POWER),
}
_TEMPLATES = {"sqrt": "root", "clip": "clamp"}


class MaterialX(Language):
    """The formula as a graph of MaterialX's standard nodes."""

    # The category of a node, and its inputs.
    _NODES: ClassVar = {
        "add": ("add", "in1", "in2"),
        "subtract": ("subtract", "in1", "in2"),
        "multiply": ("multiply", "in1", "in2"),
        "divide": ("divide", "in1", "in2"),
        "power": ("power", "in1", "in2"),
        "minimum": ("min", "in1", "in2"),
        "maximum": ("max", "in1", "in2"),
        "clip": ("clamp", "in", "low", "high"),
        "sqrt": ("sqrt", "in"),
        "log": ("ln", "in"),
        # in1 where value1 > value2
        "select": ("ifgreater", "value2", "value1", "in1", "in2"),
        "number": ("constant", "value"),
        "variable": ("dot", "in"),
    }

    def remark(self, text: str) -> str:
        """Return a comment, in which XML has no two hyphens in a row."""
        return f"<!-- {re.sub('-(?=-)', '- ', text)} -->"

    def lines(self, code: Code) -> list[str]:
        """Return a document with a graph that has an output for each result."""
        nodes, ends = self._nodes(code)
        typical = {one.name: _plain(one.parameter.typical_value) for one in code.arguments}
        inputs = [
            f'<input name="{name}" type="float" value="{value}" />'
            for name, value in typical.items()
        ]
        outputs = [
            f'<output name="{one.name}_out" type="float" nodename="{end}" />'
            for one, end in zip(code.results, ends, strict=True)
        ]
        return [
            '<materialx version="1.38">',
            f'  <nodegraph name="{code.function_name(code.results)}">',
            *(f"    {line}" for line in (*inputs, *nodes, *outputs)),
            "  </nodegraph>",
            "</materialx>",
        ]

    def short(self, code: Code) -> str:
        """Return the nodes."""
        return " ".join(line.strip() for line in self._nodes(code)[0])

    def _nodes(self, code: Code) -> tuple[list[str], list[str]]:
        """Return the lines of the nodes, and the names of those that are the results."""
        lines: list[str] = []
        made: dict[str, str] = {}
        counts: Counter[str] = Counter()

        def written(node: Expression, name: str = "") -> str:
            """Write a node after those that it needs, and return its name."""
            if node.operation == "let":
                if node.name not in made:
                    made[node.name] = written(node.operands[0], node.name)
                return made[node.name]
            if node.operation == "inverse_root":
                node = number(1) / Expression("sqrt", node.operands)
            category, *inputs = self._NODES[node.operation]
            values = list(map(source, node.operands or (node,)))
            counts[category] += 1
            name = name or f"{category}{counts[category]}"
            lines.append(f'<{category} name="{name}" type="float">')
            for port, value in zip(inputs, values, strict=True):
                lines.append(f'  <input name="{port}" type="float" {value} />')
            lines.append(f"</{category}>")
            return name

        def source(node: Expression) -> str:
            if node.is_number:
                return f'value="{_plain(node.value)}"'
            if node.operation == "variable":
                return f'interfacename="{node.name}"'
            return f'nodename="{written(node)}"'

        return lines, [written(one) for one in _Steps(code.expressions).expressions]


LANGUAGES: Registry[Language] = Registry("language")
LANGUAGES.add("glsl", Syntax(inverse_root="inversesqrt({})"))
LANGUAGES.add("hlsl", Syntax(inverse_root="rsqrt({})"))
LANGUAGES.add(
    "wgsl",
    Syntax(
        inverse_root="inverseSqrt({})",
        select="select({3}, {2}, {0} < {1})",
        head="fn {name}({arguments}) -> f32 {{",
        argument="{}: f32",
        declare="let {name} = {value}",
    ),
)
LANGUAGES.add(
    "metal",
    Syntax(
        inverse_root="rsqrt({})",
        number=_single,
        include="#include <metal_stdlib>\nusing namespace metal;",
    ),
)
LANGUAGES.add("osl", Syntax(inverse_root="inversesqrt({})"))
LANGUAGES.add(
    "c",
    Syntax(
        inverse_root="1.0f / sqrtf({})",
        root="sqrtf({})",
        clamp="fminf(fmaxf({}, {}), {})",
        power="powf({}, {})",
        minimum="fminf({}, {})",
        maximum="fmaxf({}, {})",
        log="logf({})",
        number=_single,
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
        power="{} ** {}",
        minimum="np.minimum({}, {})",
        maximum="np.maximum({}, {})",
        log="np.log({})",
        select="np.where({} < {}, {}, {})",
        number=_double,
        head="def {name}({arguments}):",
        argument="{}",
        declare="{name} = {value}",
        end="",
        foot="",
        include="import numpy as np\n\n",
        comment="#",
    ),
)
LANGUAGES.add("materialx", MaterialX())
LANGUAGES.add("latex", Latex())


def write_formula(formula: Formula, problem: SearchProblem, language: str) -> str:
    """Return a formula as code that can be pasted, with a comment that states what it keeps.

    Parameters
    ----------
    formula : Formula
        A formula for the problem.
    problem : SearchProblem
        Its pair, metric and range.
    language : str
        One of `LANGUAGES`.

    Raises
    ------
    MdfconvError
        If the language is not known.
    """
    return _written(fitted_code(formula, problem), LANGUAGES[language])


def write_relation(relation: ExactRelation, language: str) -> str:
    """Return an exact relation as code that can be pasted, with a comment that says so.

    Parameters
    ----------
    relation : ExactRelation
        Both ends, and how what the target stores follows from what the source stores.
    language : str
        One of `LANGUAGES`.

    Raises
    ------
    MdfconvError
        If the language is not known, or the relation is no formula.
    """
    return _written(exact_code(relation), LANGUAGES[language])


def _written(code: Code, language: Language) -> str:
    return "\n".join([*map(language.remark, code.facts), *language.lines(code)])
