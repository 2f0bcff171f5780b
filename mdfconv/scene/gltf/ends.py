"""What the numbers of a glTF file are, and become, for each material."""

from __future__ import annotations

from functools import cache
from typing import Any, TypeAlias

from mdfconv.distributions.dialects import Dialect, Specular, dialects_of
from mdfconv.distributions.endpoint import Endpoint, dialect_of, endpoint, with_specular
from mdfconv.errors import MdfconvError
from mdfconv.scene.gltf.document import (
    EXTENSIONS,
    METALLIC_ROUGHNESS,
    SPECULAR_GLOSSINESS,
    RoughnessField,
)
from mdfconv.scene.shininess import luminance

Pair: TypeAlias = tuple[Endpoint, Endpoint]

# What is stored in an extension of its own.
GLOSSINESS = "ggx:gltf-glossiness"
SPECULAR = "KHR_materials_specular"


class MaterialEnds:
    """Source and target of a conversion, for each material with the weight of its specular lobe.

    What the weight is where a rule depends on one says KHR_materials_specular, as far as a
    material has it, else the weight that is given, else the names of the two.

    Raises
    ------
    MdfconvError
        If a name is not known, or is used beyond 1, as an exponent is.
    """

    def __init__(
        self, source: str | Endpoint, target: str | Endpoint, specular: float | None = None
    ) -> None:
        self._rules = _weighted(source), _weighted(target)
        if specular is not None:
            source, target = with_specular(_label(source), _label(target), specular)
        self._names = source, target
        # Both, with a weight of 1 where it is not known.
        self.pair: Pair = (_stand_in(source, self._rules[0]), _stand_in(target, self._rules[1]))
        for argument, end in zip(("source", "target"), self.pair, strict=True):
            if end.stored.typical[1] > 1:
                raise MdfconvError(
                    f"a roughness factor is at most 1, {end.label} is more as a rule",
                    "name what the program stores",
                    argument=argument,
                )
        self.of_weight = cache(self._of_weight)

    @property
    def fields(self) -> tuple[RoughnessField, RoughnessField]:
        """Where a material has the number that is read, and the one that is written.

        They differ if the one endpoint names an extension and the other does not; what is
        converted to that of the extension is so within it.
        """
        named = [_is_of_extension(end) for end in self.pair]
        read = SPECULAR_GLOSSINESS if any(named) else METALLIC_ROUGHNESS
        return read, SPECULAR_GLOSSINESS if named[1] else METALLIC_ROUGHNESS

    @property
    def dialect(self) -> Dialect | None:
        """The program's rule that the source is, if it is one."""
        return dialect_of(self.pair[0])

    @property
    def changes_nothing(self) -> bool:
        """Whether the two are the same."""
        return self.pair[0].label == self.pair[1].label

    @property
    def is_native(self) -> bool:
        """Whether its numbers mean to the source what they do to glTF: other layers are right."""
        return self.changes_nothing or _is_of_extension(self.pair[0])

    def weight_of(self, material: dict[str, Any]) -> float | None:
        """Return the weight that a material has, None if it has none or no rule depends on it."""
        return specular_weight(material) if any(self._rules) else None

    def is_assumed(self, weight: float | None) -> bool:
        """Return whether a rule takes a weight of 1 because none is known."""
        return weight is None and any(
            rule and ":" not in _label(name).partition(":")[2]
            for name, rule in zip(self._names, self._rules, strict=True)
        )

    def _of_weight(self, weight: float | None) -> Pair:
        """Return source and target for a weight; refuse one that is illegal or missing."""
        source, target = (
            endpoint(f"{rule}:{weight!r}" if rule and weight is not None else name)
            for name, rule in zip(self._names, self._rules, strict=True)
        )
        return source, target


def specular_weight(material: dict[str, Any]) -> float | None:
    """Return the luminance of the specular colour of a material, None if it says nothing of it."""
    extensions = material.get(EXTENSIONS)
    specular = extensions.get(SPECULAR) if isinstance(extensions, dict) else None
    if specular is None:
        return None
    try:
        factor, colour = specular.get("specularFactor", 1), specular.get("specularColorFactor")
        weight = factor * luminance([1, 1, 1] if colour is None else colour)
        # Without what the sum rounds.
        return float(f"{float(weight):.9g}")
    except (AttributeError, TypeError, ValueError, OverflowError):
        raise MdfconvError(f"its {SPECULAR} has no specular colour") from None


def _label(name: str | Endpoint) -> str:
    return name.label if isinstance(name, Endpoint) else name


def _weighted(name: str | Endpoint) -> str:
    """Return the name of a rule that depends on a specular weight, without one; "" for others."""
    head, _, tail = _label(name).partition(":")
    mdf = name.distribution if isinstance(name, Endpoint) else endpoint(head).distribution
    key = tail.partition(":")[0].strip().lower()
    dialect = dialects_of(mdf.name).get(key)
    return f"{head}:{key}" if dialect and dialect.specular is not Specular.no else ""


def _stand_in(name: str | Endpoint, rule: str) -> Endpoint:
    """Return what a name means, with a weight of 1 if it has none and needs one."""
    try:
        return endpoint(name)
    except MdfconvError as error:
        if error.argument != "specular":
            raise
    return endpoint(f"{rule}:1")


def _is_of_extension(end: Endpoint) -> bool:
    return end.label == GLOSSINESS
