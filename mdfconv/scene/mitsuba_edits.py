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
        self._edits: dict[int, tuple[int, bytes]] = {}

    def result(self) -> bytes:
        """Return the changed scene."""
        return apply_edits(self._data, self._edits)

    def set_file(self, element: Element, name: str) -> None:
        """Change the attribute ``value`` to the name of another file."""
        self._set_value(element, attribute_text(name))

    def _set_value(self, element: Element, text: bytes) -> None:
        start, end = value_place(self._data, element)
        self._edits[start] = end, text

    def convert(self, bsdf: Bsdf, results: Sequence[float]) -> None:
        """Give a BSDF the target's distribution, and new numbers for its α; NaN of a texture."""
        new: list[tuple[str, dict[str, str]]] = []
        if bsdf.named_by is not None:
            self._set_value(bsdf.named_by, self._target.encode())
        elif self._target != DEFAULT_DISTRIBUTION:
            new.append(("string", {"name": "distribution", "value": self._target}))
        for each, result in zip(bsdf.roughness, results, strict=True):
            number = f"{result:.{_DIGITS}g}"
            if each.holder is None:
                if result != DEFAULT_ALPHA:
                    new.append(("float", {"name": "alpha", "value": number}))
            elif not each.textured:
                self._set_value(each.holder, number.encode())
        if new:
            start, end, text = children_insertion(self._data, bsdf.element, new)
            self._edits[start] = end, text
