"""Changes in the bytes of a Mitsuba scene."""

from __future__ import annotations

from collections.abc import Sequence

from mdfconv.scene.mitsuba_scene import DEFAULT_ALPHA, DEFAULT_DISTRIBUTION, Bsdf
from mdfconv.scene.xml_edit import (
    Element,
    apply_edits,
    attribute_text,
    children_insertion,
    value_place,
)

# Mitsuba computes with 24 bits, which takes nine digits to tell all apart.
_DIGITS = 9


class SceneEdits:
    """The changes in the bytes of a scene.

    Parameters
    ----------
    data : bytes
        The scene.
    target : str
        The distribution that BSDFs are given.
    """

    def __init__(self, data: bytes, target: str) -> None:
        self._data, self._target = data, target
        self._edits: dict[int, tuple[slice, bytes]] = {}

    def result(self) -> bytes:
        """Return the changed scene."""
        return apply_edits(self._data, self._edits)

    def set_value(self, element: Element, text: bytes) -> None:
        """Change the attribute ``value``, but not the blanks around it."""
        where = value_place(self._data, element)
        old = self._data[where]
        start = where.start + len(old) - len(old.lstrip())
        self._edits[start] = slice(start, start + len(old.strip())), text

    def set_file(self, element: Element, name: str) -> None:
        """Change the attribute ``value`` to the name of another file."""
        where = value_place(self._data, element)
        self._edits[where.start] = where, attribute_text(name)

    def insert(self, element: Element, children: list[tuple[str, dict[str, str]]]) -> None:
        """Put properties before those that a BSDF has."""
        where, new = children_insertion(self._data, element, children)
        self._edits[where.start] = where, new

    def convert(self, bsdf: Bsdf, results: Sequence[float]) -> None:
        """Give a BSDF the target's distribution, and new numbers for its α; NaN of a texture."""
        new: list[tuple[str, dict[str, str]]] = []
        if bsdf.named_by is not None:
            self.set_value(bsdf.named_by, self._target.encode())
        elif self._target != DEFAULT_DISTRIBUTION:
            new.append(("string", {"name": "distribution", "value": self._target}))
        for each, result in zip(bsdf.roughness, results, strict=True):
            text = f"{result:.{_DIGITS}g}"
            if each.holder is None:
                if result != DEFAULT_ALPHA:
                    new.append(("float", {"name": "alpha", "value": text}))
            elif not each.textured:
                self.set_value(each.holder, text.encode())
        if new:
            self.insert(bsdf.element, new)
