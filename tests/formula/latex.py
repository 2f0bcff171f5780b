"""LaTeX, read and evaluated as a mathematician would."""

import re
from fractions import Fraction

import numpy as np


def evaluated(line, values):
    """Return the value of an equation, up to its range, for the values of symbols such as α_s."""
    formula = line.partition(" = ")[2].partition(r", \quad")[0]
    reader = Reader(formula, {latex_symbol(symbol): value for symbol, value in values.items()})
    value = reader.sum()
    assert not reader.tokens
    return value


def latex_symbol(symbol):
    head, _, tail = symbol.replace("α", r"\alpha").partition("_")
    return f"{head}_{{{tail}}}" if tail else head


class Reader:
    """Evaluates LaTeX as a mathematician reads it."""

    TOKENS = re.compile(
        r"\\begin{cases}|\\end{cases}|\\text{[a-z ]+}|\\\\|\\left\(|\\right\)|"
        r"(?:\\alpha|[A-Za-z])(?:_{\w+})?(?![a-z])|\\[a-z]+|[0-9.]+|\S"
    )

    def __init__(self, text, values):
        self.tokens, self.values = self.TOKENS.findall(text), values

    def next(self, *wanted):
        """Take the next token if it is one of those that are wanted, any if none is named."""
        if self.tokens and (not wanted or self.tokens[0] in wanted):
            return self.tokens.pop(0)
        return None

    def sum(self):
        value = -self.product() if self.next("-") else self.product()
        while sign := self.next("+", "-"):
            value = value + self.product() * (1 if sign == "+" else -1)
        return value

    def product(self):
        value = self.power()
        while self.tokens and self.tokens[0] not in {
            "+", "-", "}", ",", "&", "<", r"\right)", r"\\", r"\end{cases}"
        }:  # fmt: skip
            self.next(r"\cdot")
            value = value * self.power()
        return value

    def power(self):
        value = self.atom()
        return value ** self.group(fraction=True) if self.next("^") else value

    def group(self, fraction=False):
        assert self.next("{")
        value = self.sum() if not fraction else float(Fraction(self.until("}")))
        assert fraction or self.next("}")
        return value

    def until(self, end):
        text = ""
        while (token := self.next()) != end:
            text += token
        return text

    def atom(self):
        token = self.next()
        if token in self.values:
            return self.values[token]
        if token == r"\frac":
            return self.group() / self.group()
        if token == r"\ln":
            return np.log(self.atom())
        if token == r"\left(":
            value = self.sum()
            assert self.next(r"\right)")
            return value
        if token in (r"\min", r"\max"):
            self.next(r"\left(")
            first, _, second = self.sum(), self.next(","), self.sum()
            assert self.next(r"\right)")
            return (np.minimum if token == r"\min" else np.maximum)(first, second)
        if token == r"\begin{cases}":
            first, _, _, low, _, high = (
                self.sum(), self.next("&"), self.next(), self.sum(), self.next("<"), self.sum()
            )  # fmt: skip
            _, other = self.next(r"\\"), self.sum()
            self.tokens = self.tokens[self.tokens.index(r"\end{cases}") + 1 :]
            return np.where(low < high, first, other)
        return float(token)
