"""The words of a text, one after the other, with the lines they stand in."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError


class Words:
    """A place in a text that moves on from word to word.

    Parameters
    ----------
    path : Path
        The file, for messages.
    lines : iterable of (int, str)
        Its lines and their numbers from 1, without comments.
    """

    def __init__(self, path: Path, lines: Iterable[tuple[int, str]]) -> None:
        self._path = path
        self._words = [(number, word) for number, line in lines for word in line.split()]
        self._at = 0

    def peek(self) -> str | None:
        """Return the next word without moving on; None at the end."""
        return self._words[self._at][1] if self._at < len(self._words) else None

    def next(self, what: str) -> str:
        """Return the next word; raise `MdfconvError` if the text ends before it."""
        word = self.peek()
        if word is None:
            raise MdfconvError(f"{self._path}: truncated: it ends before {what}")
        self._at += 1
        return word

    def expect(self, word: str) -> None:
        """Pass over a word; raise `MdfconvError` if another one stands there."""
        found = self.next(word)
        if found.lower() != word.lower():
            raise self.error(f"'{found[:30]}' where {word} goes")

    def count(self, what: str) -> int:
        """Return the next word as a count, at most that of the words that follow."""
        word = self.next(what)
        if not (word.isascii() and word.isdecimal() and len(word) < 10 and int(word) > 0):
            raise self.error(f"{what}: '{word[:30]}' is no count")
        return int(word)

    def numbers(self, count: int, what: str) -> Array:
        """Return the next numbers, shape (count,)."""
        words = self._words[self._at : self._at + count]
        if len(words) < count:
            raise MdfconvError(f"{self._path}: truncated: it ends within {what}")
        numbers = np.empty(count)
        for place, (_, word) in enumerate(words):
            self._at += 1
            try:
                numbers[place] = float(word)
            except ValueError:
                raise self.error(f"{what}: '{word[:30]}' is no number") from None
        return numbers

    def error(self, reason: str) -> MdfconvError:
        """Return an error about the word that was last read."""
        number = self._words[max(self._at - 1, 0)][0]
        return MdfconvError(f"{self._path}, line {number}: {reason}")
