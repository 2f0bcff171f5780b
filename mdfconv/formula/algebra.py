"""The simplest form of an expression: a sum of products of powers, in which equals cancel.

A sum is pairs of a product and its coefficient; a product is pairs of a factor and its exponent; a
factor is a variable, a function of sums, or a sum. All are sorted tuples: what is equal is the same
key. A sum is multiplied out only where terms cancel, for a product keeps more digits.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable
from fractions import Fraction
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from mdfconv.formula.expression import Expression, number

_LARGEST = 1e300
# Relative: what rounding leaves of terms that cancel, and of a fraction.
_ROUNDING = 1e-14
_LARGEST_DENOMINATOR = 10_000


class Factor(NamedTuple):
    """A variable, with its name and limits, or a function of sums, with its name."""

    operation: str
    operands: tuple[Any, ...]


Product: TypeAlias = tuple[tuple[Factor, float], ...]
Sum: TypeAlias = tuple[tuple[Product, float], ...]
_Interval: TypeAlias = tuple[float, float]

_ONE: Product = ()


def simplified(*expressions: Expression) -> list[Expression]:
    """Return expressions in their simplest form, in which what is equal is one object.

    Roots are taken as those of positive numbers, and ranges of variables show which clamps act.
    An operation that cannot be written raises NotImplementedError.
    """
    writer = _Writer()
    return [writer.sum(_sum_of(expression)) for expression in expressions]


def _sum_of(node: Expression) -> Sum:
    if node.is_number:
        return _constant(node.value)
    if node.operation == "variable":
        return _of_factor(Factor("variable", (node.name, *node.limits)))
    if node.operation == "where":
        return _where(*node.operands)
    operands = [_sum_of(operand) for operand in node.operands]
    if node.operation not in _RULES:
        raise NotImplementedError(node.operation)
    return _RULES[node.operation](*operands)


def _constant(value: float) -> Sum:
    return ((_ONE, value),) if value else ()


def _of_factor(factor: Factor) -> Sum:
    return ((((factor, 1.0),), 1.0),)


def _value(terms: Sum) -> float | None:
    """Return the number that a sum is; None if it depends on a variable."""
    if not terms:
        return 0.0
    return terms[0][1] if len(terms) == 1 and terms[0][0] == _ONE else None


def _rounded(value: float) -> float:
    """Return the simple fraction that a number is but for its rounding, or the number."""
    fraction = float(Fraction(value).limit_denominator(_LARGEST_DENOMINATOR))
    return fraction if math.isclose(fraction, value, rel_tol=_ROUNDING) else value


def _plus(*sums: Sum) -> Sum:
    terms = _merged(sums)
    if not any(map(_factors_to_expand, (product for product, _ in terms))):
        return terms
    expanded = _merged([_multiplied_out(product, size) for product, size in terms])
    return expanded if len(expanded) <= len(terms) else terms


def _merged(sums: Iterable[Sum]) -> Sum:
    coefficients: dict[Product, float] = defaultdict(float)
    sizes: dict[Product, float] = defaultdict(float)
    for product, coefficient in (term for terms in sums for term in terms):
        coefficients[product] += coefficient
        sizes[product] = max(sizes[product], abs(coefficient))
    kept = (
        (product, _rounded(coefficient))
        for product, coefficient in coefficients.items()
        if abs(coefficient) > _ROUNDING * sizes[product]
    )
    # The constant comes first.
    return tuple(sorted(kept, key=lambda term: (len(term[0]), repr(term))))


def _minus(first: Sum, second: Sum) -> Sum:
    return _plus(first, _times(_constant(-1), second))


def _times(first: Sum, second: Sum) -> Sum:
    if len(first) > 1 and len(second) > 1:
        first, second = _as_factor(first), _as_factor(second)
    return _merged(
        _expanded(_product(one, other), coefficient * factor)
        for one, coefficient in first
        for other, factor in second
    )


def _as_factor(terms: Sum) -> Sum:
    """Return a sum as one term: what its terms have in common times a factor that is a sum."""
    common, coefficient, rest = _factored(terms, scaled=True)
    return ((_product(common, ((Factor("sum", rest), 1.0),)), coefficient),)


def _product(*products: Product) -> Product:
    exponents: dict[Factor, float] = defaultdict(float)
    for factor, exponent in (pair for product in products for pair in product):
        exponents[factor] += exponent
    kept = ((factor, _rounded(exponent)) for factor, exponent in exponents.items())
    return tuple(sorted((pair for pair in kept if pair[1]), key=repr))


def _factors_to_expand(product: Product) -> list[Sum]:
    return [
        factor.operands for factor, power in product if factor.operation == "sum" and power == 1
    ]


def _expanded(product: Product, coefficient: float) -> Sum:
    """Return a product with its only sum multiplied out, or several whose terms cancel."""
    sums = _factors_to_expand(product)
    if not sums:
        return ((product, coefficient),)
    expanded = _multiplied_out(product, coefficient)
    cancels = len(expanded) <= max(map(len, sums))
    return expanded if len(sums) == 1 or cancels else ((product, coefficient),)


def _multiplied_out(product: Product, coefficient: float) -> Sum:
    sums = _factors_to_expand(product)
    rest = tuple(pair for pair in product if pair[0].operation != "sum" or pair[1] != 1)
    terms: Sum = ((rest, coefficient),)
    for factor in sums:
        terms = _merged(
            _expanded(_product(one, other), size * scale)
            for one, size in terms
            for other, scale in factor
        )
    return terms


def _raised(terms: Sum, exponent: float) -> Sum:
    """Return a sum to a power; its common factors to that power are taken out of it."""
    value = _value(terms)
    if value is not None:
        return _constant(value**exponent)
    if exponent == 1:
        return terms
    product, coefficient, rest = _factored(terms, scaled=True)
    whole = float(exponent).is_integer()
    outside: list[tuple[Factor, float]] = []
    inside: list[tuple[Factor, float]] = []
    for factor, power in product:
        # A root is that of a positive number already.
        splits = whole or not float(power).is_integer() or _bounds_of(factor)[0] >= 0
        (outside if splits else inside).append((factor, power))
    if coefficient < 0 and not whole:
        coefficient, rest = -coefficient, _times(_constant(-1), rest)
    rest = _times(((tuple(inside), 1.0),), rest)
    if _value(rest) != 1:
        outside.append((Factor("sum", rest), 1.0))
    raised = tuple((factor, power * exponent) for factor, power in outside)
    return _expanded(_product(raised), _rounded(coefficient**exponent))


def _factored(terms: Sum, *, scaled: bool) -> tuple[Product, float, Sum]:
    """Return the product and the number that all terms have in common, and the sum of the rest.

    Scaled, the rest is the same for all multiples of a sum of two terms, so that its powers meet.
    """
    every = [dict(product) for product, _ in terms]
    common: Product = ()
    for factor in every[0]:
        exponents = [product.get(factor, 0.0) for product in every]
        if min(exponents) > 0 or max(exponents) < 0:
            common += ((factor, min(exponents, key=abs)),)
    coefficient = terms[0][1] if len(terms) == 1 else 1.0
    if len(terms) > 1:
        sizes = {abs(size) for _, size in terms}
        # 2/x² − 2 stays, 1000 − 1000 x is 1000 (1 − x).
        quotient = any(exponent < 0 for product in every for exponent in product.values())
        alike = len(sizes) == 1 and (scaled or not quotient)
        if alike or (scaled and len(terms) == 2 and 1 not in sizes):
            coefficient = abs(terms[-1][1])
    divisor = tuple((factor, -exponent) for factor, exponent in common)
    rest = _plus(*(((_product(product, divisor), c / coefficient),) for product, c in terms))
    return common, coefficient, rest


def _power(base: Sum, exponent: Sum) -> Sum:
    by = _value(exponent)
    if by is not None:
        return _raised(base, by)
    return _of_factor(Factor("power", (base, exponent)))


def _logarithm(terms: Sum) -> Sum:
    if len(terms) == 1 and terms[0][1] == 1 and len(terms[0][0]) == 1:
        factor, exponent = terms[0][0][0]
        if factor.operation == "power":
            base, by = factor.operands
            return _times(_times(by, _constant(exponent)), _logarithm(base))
    value = _value(terms)
    return _of_factor(Factor("log", (terms,))) if value is None else _constant(math.log(value))


def _minimum(first: Sum, second: Sum) -> Sum:
    (low, high), (other_low, other_high) = _bounds(first), _bounds(second)
    if high <= other_low:
        return first
    return second if other_high <= low else _of_factor(Factor("minimum", (first, second)))


def _maximum(first: Sum, second: Sum) -> Sum:
    (low, high), (other_low, other_high) = _bounds(first), _bounds(second)
    if low >= other_high:
        return first
    return second if other_low >= high else _of_factor(Factor("maximum", (first, second)))


def _where(condition: Expression, first: Expression, second: Expression) -> Sum:
    """Return a choice; every comparison is brought to <."""
    comparison = condition.operation
    if comparison not in ("less", "less_equal", "greater", "greater_equal"):
        raise NotImplementedError(comparison)
    below, above = (_sum_of(operand) for operand in condition.operands)
    if comparison in ("greater", "less_equal"):
        below, above = above, below
    if comparison.endswith("equal"):
        first, second = second, first
    return _of_factor(Factor("select", (below, above, _sum_of(first), _sum_of(second))))


_E, _LN_2, _LN_10 = (_constant(value) for value in (math.e, math.log(2), math.log(10)))
_RULES: dict[str, Any] = {
    "add": _plus,
    "subtract": _minus,
    "multiply": _times,
    "divide": lambda first, second: _times(first, _raised(second, -1)),
    "negative": lambda terms: _times(_constant(-1), terms),
    "reciprocal": lambda terms: _raised(terms, -1),
    "square": lambda terms: _raised(terms, 2),
    "sqrt": lambda terms: _raised(terms, 0.5),
    "cbrt": lambda terms: _raised(terms, 1 / 3),
    "hypot": lambda x, y: _raised(_plus(_raised(x, 2), _raised(y, 2)), 0.5),
    "power": _power,
    "exp": lambda terms: _power(_E, terms),
    "exp2": lambda terms: _power(_constant(2), terms),
    "log": _logarithm,
    "log2": lambda terms: _times(_logarithm(terms), _raised(_LN_2, -1)),
    "log10": lambda terms: _times(_logarithm(terms), _raised(_LN_10, -1)),
    "minimum": _minimum,
    "maximum": _maximum,
    "clip": lambda terms, low, high: _minimum(_maximum(terms, low), high),
}


def _bounds(terms: Sum) -> _Interval:
    """Return between which values a sum lies; wider than it may be, but no narrower."""
    low = high = 0.0
    for product, coefficient in terms:
        least = most = 1.0
        for factor, exponent in product:
            ends = np.minimum(_bounds_of(factor), _LARGEST)
            if ends[0] < 0:
                return -math.inf, math.inf
            with np.errstate(divide="ignore", over="ignore"):
                powers = np.minimum(ends**exponent, _LARGEST)
            least, most = least * powers.min(), min(most * powers.max(), _LARGEST)
        low += min(coefficient * least, coefficient * most)
        high += max(coefficient * least, coefficient * most)
    return low, high


def _bounds_of(factor: Factor) -> _Interval:
    if factor.operation == "variable":
        return factor.operands[1], factor.operands[2]
    if factor.operation == "sum":
        return _bounds(factor.operands)
    ends = [_bounds(operand) for operand in factor.operands]
    lows, highs = [low for low, _ in ends], [high for _, high in ends]
    if factor.operation == "select":
        return min(lows[2:]), max(highs[2:])
    if factor.operation in ("minimum", "maximum"):
        choose = min if factor.operation == "minimum" else max
        return choose(lows), choose(highs)
    return (0.0 if factor.operation == "power" else -math.inf), math.inf


class _Writer:
    """Makes the expression that is written of a sum; what is equal is one object."""

    def __init__(self) -> None:
        self._made: dict[Any, Expression] = {}

    def sum(self, terms: Sum) -> Expression:
        """Return a sum: what is added before what is subtracted."""
        if terms not in self._made:
            self._made[terms] = self._sum(terms)
        return self._made[terms]

    def _sum(self, terms: Sum) -> Expression:
        if len(terms) < 2:
            return self._term(*(terms[0] if terms else (_ONE, 0.0)))
        common, coefficient, rest = _factored(terms, scaled=False)
        if common or coefficient != 1:
            return self._term(_product(common, ((Factor("sum", rest), 1.0),)), coefficient)
        (first, size), *others = sorted(terms, key=lambda term: term[1] < 0)
        result = self._term(first, size)
        for other, size in others:
            term = self._term(other, abs(size))
            result = result - term if size < 0 else result + term
        return result

    def _term(self, product: Product, coefficient: float) -> Expression:
        if (product, coefficient) not in self._made:
            self._made[product, coefficient] = self._term_made(product, coefficient)
        return self._made[product, coefficient]

    def _term_made(self, product: Product, coefficient: float) -> Expression:
        by_root: dict[float, list[tuple[Factor, float]]] = defaultdict(list)
        for factor, power in product:
            by_root[1.0 if power.is_integer() else abs(power)].append((factor, power))
        above: list[Expression] = []
        below: list[Expression] = []
        for root, pairs in by_root.items():
            if root != 1 and len(pairs) > 1 and any(power > 0 for _, power in pairs):
                # A root of all is one root.
                inside = tuple((factor, power / root) for factor, power in pairs)
                above.append(self.sum(_expanded(inside, 1.0)) ** root)
                continue
            for factor, power in pairs:
                (above if power > 0 else below).append(self._power(factor, abs(power)))
        if coefficient != 1 or not above:
            above.append(number(coefficient))
        result = math.prod(above[1:], start=above[0])
        return result / math.prod(below[1:], start=below[0]) if below else result

    def _power(self, factor: Factor, exponent: float) -> Expression:
        if (factor, exponent) not in self._made:
            base = self._factor(factor)
            self._made[factor, exponent] = base if exponent == 1 else base**exponent
        return self._made[factor, exponent]

    def _factor(self, factor: Factor) -> Expression:
        if factor.operation == "sum":
            return self.sum(factor.operands)
        if factor not in self._made:
            self._made[factor] = (
                Expression("variable", name=factor.operands[0])
                if factor.operation == "variable"
                else Expression(factor.operation, tuple(map(self.sum, factor.operands)))
            )
        return self._made[factor]
