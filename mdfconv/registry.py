"""Things with names: looked up as the user writes them, with a hint where that fails."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Generic, TypeVar

from mdfconv.errors import MdfconvError

Item = TypeVar("Item")

# Stands for every item where a command takes one, and so names none.
ALL = "all"
_SEPARATORS = str.maketrans("_/ ", "---")


class Registry(Generic[Item]):
    """Items by name and alias, in the order in which they were added.

    Case does not matter in a name, and ``_``, ``/`` and blanks count as ``-``. The kind says in
    messages what the items are.
    """

    def __init__(self, kind: str) -> None:
        self.kind = kind
        self._items: dict[str, Item] = {}
        self._aliases: dict[str, str] = {}
        self._meant: dict[str, str] = {}

    def add(
        self,
        name: str,
        item: Item,
        aliases: Sequence[str] = (),
        meant_by: Mapping[str, str] | None = None,
    ) -> None:
        """Add an item; `meant_by` leads from words that are no names to what they may mean.

        Raise `MdfconvError` if the name or an alias is taken, or is not one as they are looked up:
        in small letters, with ``-`` between words, without the colon that sets off an encoding or
        a setting.
        """
        if isinstance(aliases, str):
            raise MdfconvError(f"the aliases of {name} are a sequence, not the string {aliases!r}")
        for word in (name, *aliases):
            if not isinstance(word, str) or word in ("", ALL) or word != _key(word) or ":" in word:
                raise MdfconvError(
                    f"{word!r} cannot name a {self.kind}", "small letters, and - between words"
                )
            if word in self._aliases:
                raise MdfconvError(f"the {self.kind} '{word}' exists already")
        self._items[name] = item
        self._aliases |= dict.fromkeys((name, *aliases), name)
        self._meant = dict(meant_by or {}) | self._meant

    def __getitem__(self, name: str) -> Item:
        """Return the item with a name or alias; raise `MdfconvError` if there is none."""
        if not isinstance(name, str):
            raise MdfconvError(f"a {self.kind} is named by a string, not {name!r}")
        key = _key(name)
        if key not in self._aliases:
            meant = [self._meant[key]] if key in self._meant else []
            raise unknown_name(self.kind, name, list(self._aliases), meant)
        return self._items[self._aliases[key]]

    def __iter__(self) -> Iterator[Item]:
        return iter(self._items.values())

    @property
    def names(self) -> list[str]:
        """The names, without the aliases."""
        return list(self._items)


def _key(name: str) -> str:
    return name.strip().lower().translate(_SEPARATORS)


def unknown_name(
    kind: str, name: str, known: Sequence[str], meant: Sequence[str] = ()
) -> MdfconvError:
    """Return the error for a name that is not known, with what it means or the nearest ones."""
    from difflib import get_close_matches

    near = meant or get_close_matches(name.lower(), known, n=3, cutoff=0.5)
    hint = f"did you mean {' or '.join(near)}?" if near else f"known: {', '.join(known)}"
    return MdfconvError(f"unknown {kind} '{name}'", hint)
