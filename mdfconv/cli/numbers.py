"""The values of a command line: arguments, and standard input in blocks."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeAlias

from mdfconv.distributions.parameter import percent_hint
from mdfconv.errors import MdfconvError

# As a pair this is no surface: one of its axes would be a mirror.
_DECIMAL_COMMA = re.compile(r"\s*[+-]?0,\d+\s*\Z")

Number: TypeAlias = float | tuple[float, float]

_INPUT = "-"
# Characters read at a time: some hundred thousand numbers.
_BLOCK = 1 << 21


@dataclass(frozen=True)
class NumberBlock:
    """Values that are converted together.

    Parameters
    ----------
    numbers : list of float or pair
        Numbers, and pairs X,Y.
    lines : list of int
        Where each stood in standard input, counted from 1; empty for arguments.
    """

    numbers: list[Number]
    lines: list[int]

    @property
    def has_pairs(self) -> bool:
        """Whether a value is a pair."""
        return any(isinstance(number, tuple) for number in self.numbers)


def read_blocks(values: list[str]) -> Iterator[NumberBlock]:
    """Yield the values of the arguments, with standard input in place of ``-``.

    Raises
    ------
    MdfconvError
        If one is no number or pair, or standard input is asked for twice, closed or empty.
    """
    if values.count(_INPUT) > 1:
        raise MdfconvError("standard input can be read only once: give one -")
    numbers: list[Number] = []
    for position, text in enumerate(values, start=1):
        if text == _INPUT:
            if numbers:
                yield NumberBlock(numbers, [])
                numbers = []
            yield from _input_blocks()
        else:
            where = f"value {position} of {len(values)}: " if len(values) > 1 else ""
            numbers.append(_number(text, where))
    if numbers:
        yield NumberBlock(numbers, [])


def _input_blocks() -> Iterator[NumberBlock]:
    if sys.stdin is None:
        raise MdfconvError("standard input is closed")
    start, empty = 1, True
    try:
        while lines := sys.stdin.readlines(_BLOCK):
            if start == 1:
                lines[0] = lines[0].removeprefix("\ufeff")
            block = _block(lines, start)
            start += len(lines)
            if block.numbers:
                empty = False
                yield block
    except UnicodeDecodeError:
        raise MdfconvError("standard input is not text") from None
    if empty:
        raise MdfconvError("standard input holds no values")


def _block(lines: list[str], start: int) -> NumberBlock:
    try:
        return NumberBlock(list(map(float, lines)), list(range(start, start + len(lines))))
    except ValueError:
        # Pairs and blank lines, or a mistake.
        kept = [(line.strip(), number) for number, line in enumerate(lines, start) if line.strip()]
        numbers = [_number(text, f"line {number} of standard input: ") for text, number in kept]
        return NumberBlock(numbers, [number for _, number in kept])


def _number(text: str, where: str) -> Number:
    try:
        parts = [float(part) for part in text.split(",")]
    except ValueError:
        raise MdfconvError(f"{where}'{text}' is not a number", percent_hint(text)) from None
    if _DECIMAL_COMMA.match(text):
        hint = f"did you mean {text.strip().replace(',', '.')}?"
        raise MdfconvError(f"{where}'{text}' is a pair whose first number is 0", hint)
    if len(parts) > 2:
        raise MdfconvError(f"{where}'{text}' is not a pair X,Y")
    return (parts[0], parts[1]) if len(parts) == 2 else parts[0]
