"""How many operations a printed form takes: the rule of `Distribution.operations`, by machine.

The printed form is evaluated on an expression in the place of β. cos β is given: sin²β is
1 − cos²β, tan²β is 1/cos²β − 1, and β itself an arccosine. What depends on the parameters alone is
computed before, and like terms and constants of a sum are collected. An operation on the same
operands counts once, a whole power as the multiplications that it takes, any other as two
transcendental functions, of which each counts 10. The edge beyond which D is 0, and a maximum off
the normal, are not counted.
"""

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin

TRANSCENDENTAL = 10
COSINE = ("cosine",)
ANGLE = ("arccos", COSINE)
ARITHMETIC = {"sum", "product", "quotient", "negative", "sqrt", "absolute"}


class Expression(NDArrayOperatorsMixin):
    """A sum of terms, each with a coefficient, and a constant."""

    def __init__(self, terms, constant=0.0):
        self.terms = {term: factor for term, factor in terms.items() if factor}
        self.constant = constant

    def __hash__(self):
        return hash(self.node())

    def node(self):
        """Return what is computed, as nested tuples."""
        if not self.constant and list(self.terms.values()) == [1]:
            return next(iter(self.terms))
        return ("sum", tuple(sorted(self.terms.items(), key=repr)), self.constant)

    def plus(self, other, sign):
        if not isinstance(other, Expression):
            return Expression(self.terms, self.constant + sign * other)
        terms = dict(self.terms)
        for term, factor in other.terms.items():
            terms[term] = terms.get(term, 0) + sign * factor
        return Expression(terms, self.constant + sign * other.constant)

    def scaled(self, factor):
        """Return the product with a number; a sum is computed first."""
        if self.constant or len(self.terms) > 1:
            return Expression({self.node(): factor})
        return Expression({term: own * factor for term, own in self.terms.items()})

    def __array_ufunc__(self, ufunc, method, *inputs):
        assert method == "__call__"
        name = ufunc.__name__
        if name in ("add", "subtract"):
            sign = 1 if name == "add" else -1
            if isinstance(inputs[0], Expression):
                return inputs[0].plus(inputs[1], sign)
            number = Expression({}, inputs[0])
            return number.plus(inputs[1], sign)
        if name == "multiply":
            return multiplied(*inputs)
        if name == "divide":
            above, below = inputs
            if not isinstance(below, Expression):
                return above.scaled(1 / below)
            return computed("quotient", node_of(above), below.node())
        if name == "square":
            return power(self, 2)
        if name == "power":
            assert inputs[0] is self, "powers of constants are none of a printed form"
            return power(*inputs)
        if self.node() == ANGLE and name == "cos":
            return Expression({COSINE: 1})
        return computed(name, *map(node_of, inputs))

    def __array_function__(self, function, kinds, arguments, options):
        assert function is np.where, f"{function.__name__} is not known here"
        condition, then, otherwise = arguments
        return then if isinstance(condition, Expression) or condition else otherwise


def node_of(operand):
    return operand.node() if isinstance(operand, Expression) else float(operand)


def computed(name, *operands):
    return Expression({(name, *operands): 1})


def multiplied(one, other):
    if not isinstance(one, Expression):
        return other.scaled(one)
    if not isinstance(other, Expression):
        return one.scaled(other)
    return computed("product", *sorted((one.node(), other.node()), key=repr))


def power(base, exponent):
    node, cosine = base.node(), Expression({COSINE: 1})
    if not isinstance(exponent, int):
        return computed("power", node)
    if exponent == 1:
        return base
    if exponent == 2 and node == ("sin", ANGLE):
        return 1 - cosine**2
    if exponent == 2 and node == ("tan", ANGLE):
        return 1 / cosine**2 - 1
    if exponent % 2:
        return multiplied(base, power(base, exponent - 1))
    half = power(base, exponent // 2)
    return multiplied(half, half)


def parts(node):
    """Yield everything that is computed on the way to a node, once."""
    seen = set()
    left = [node]
    while left:
        node = left.pop()
        if isinstance(node, tuple) and node not in seen:
            seen.add(node)
            yield node
            left += [term for term, _ in node[1]] if node[0] == "sum" else node[1:]


def price(node):
    name = node[0]
    if node == COSINE:
        return 0
    if name == "sum":
        _, terms, constant = node
        factors = sum(abs(factor) != 1 for _, factor in terms)
        return max(1, factors + len(terms) - 1 + bool(constant))
    if name == "power":
        return 2 * TRANSCENDENTAL
    return 1 if name in ARITHMETIC else TRANSCENDENTAL


def operations_of(printed, *parameters):
    """Return how many operations a printed unit form takes."""
    result = printed(Expression({ANGLE: 1}), *map(np.float64, parameters))
    return sum(price(node) for node in parts(result.node()))
