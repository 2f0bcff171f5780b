"""Mitsuba's scenes: the roughness of their BSDFs, and which of it can be changed on its own.

Mitsuba 0.6 (src/bsdfs/microfacet.h) and Mitsuba 3 (include/mitsuba/render/microfacet.h) take the
same properties: ``distribution``, which is beckmann if not given, and ``alpha``, 0.1 if not given,
or both ``alpha_u`` and ``alpha_v`` (0.6: ``alphaU`` and ``alphaV``). The plugins without such a
distribution that have a roughness all the same are in src/bsdfs of either.
"""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from mdfconv.errors import MdfconvError
from mdfconv.scene.mitsuba.xml_edit import Element, read_elements

# What Mitsuba's distributions are here. Those of 0.6 have an exponent for an α.
_EXPONENT = "blinn-phong:mitsuba-phong"
DISTRIBUTIONS = {"beckmann": "beckmann", "ggx": "ggx", "phong": _EXPONENT, "as": _EXPONENT}
TARGETS = ("ggx", "beckmann")
_DEFAULT_DISTRIBUTION, _DEFAULT_ALPHA = "beckmann", 0.1
_AXES = ("alpha_u", "alpha_v")

_TYPES = {"roughconductor", "roughdielectric", "roughplastic", "roughcoating", "pplastic"}


class _OtherLobe(NamedTuple):
    """A plugin whose lobe is none of Mitsuba's distributions, with the nearest that there is."""

    words: str
    # What its number is nearest to, its name, and what counts where none is given.
    nearest: str
    number: str
    default: float


# The plugins of 0.6: the exponent of phong is of the reflected ray; the exponential of ward is that
# of Beckmann's distribution, its factors are not.
_OTHER_LOBES = {
    "phong": _OtherLobe(
        "the BSDF phong has no microfacets", "blinn-phong:reflected", "exponent", 30.0
    ),
    "ward": _OtherLobe(
        "the BSDF ward has Ward's lobe, near that of beckmann but not equal",
        "beckmann", "alpha", _DEFAULT_ALPHA,
    ),
}  # fmt: skip
# Whose roughness these have, which is right as it is.
_RIGHT_ALREADY = dict.fromkeys(
    ("principled", "principledthin", "disney", "openpbr"), "that of GGX already"
)
_RIGHT_ALREADY |= {
    "roughdiffuse": "Oren-Nayar's, of no microfacet distribution",
    "hair": "that of fibres, of no microfacet distribution",
}
# What a plugin that is not known calls a roughness.
_ROUGHNESS_NAME = re.compile(r"alpha_?[a-z]?\Z|.*(roughness|glossiness|shininess|exponent)\Z", re.I)
# By the names of 0.6, too, which Mitsuba 3 reads in older scenes.
_PROPERTIES = {"alphaU": "alpha_u", "alphaV": "alpha_v"}
_PROPERTIES |= {name: name for name in ("distribution", "alpha", *_AXES)}
_ALPHAS: tuple[set[str], ...] = (set(), {"alpha"}, set(_AXES))
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?\Z")
_PARAMETER = re.compile(r"\$(\w+)")


def source_of(distribution: str) -> str:
    """Return what the α of a distribution in Mitsuba's words is, as `mdfconv.convert` names it.

    What is not one of `DISTRIBUTIONS` is such a name already.
    """
    return DISTRIBUTIONS.get(distribution, distribution)


@dataclass(eq=False)
class Roughness:
    """Where the α of a BSDF, of one axis or of both, comes from.

    Parameters
    ----------
    value : float or None
        The number; None of a texture, and of an exponent that is not a number.
    holder : Element or None
        What would be changed: the property, the default of a parameter, or the texture; None
        where the α is not given.
    parameter : str
        The parameter's name, "" if it is none.
    textured : bool
        Whether the holder is a texture.
    name : str
        What the scene calls it.
    """

    value: float | None
    holder: Element | None = None
    parameter: str = ""
    textured: bool = False
    name: str = "alpha"


@dataclass(eq=False)
class Bsdf:
    """A BSDF with a roughness.

    Parameters
    ----------
    element : Element
        Where it stands.
    distribution : str
        One of `DISTRIBUTIONS`.
    named_by : Element or None
        The property that names the distribution; None if it is not given.
    roughness : tuple of Roughness
        One, or those of both axes.
    problem : str
        Why it is left as it is, "" if it is not.
    taken_for : str
        What its numbers are whatever the distribution says, as `mdfconv.convert` names it; "" if
        the distribution says it.
    other_lobe : str
        In words which lobe it has that is none of `DISTRIBUTIONS`; "" if it has one of them.
    """

    element: Element
    distribution: str = _DEFAULT_DISTRIBUTION
    named_by: Element | None = None
    roughness: tuple[Roughness, ...] = ()
    problem: str = ""
    taken_for: str = ""
    other_lobe: str = ""

    @property
    def name(self) -> str:
        """Its id, or else its type."""
        return self.element.get("id") or self.element.get("type")

    @property
    def source(self) -> str:
        """What its α or its exponent is, as `mdfconv.convert` names it."""
        return self.taken_for or source_of(self.distribution)

    @property
    def meaning(self) -> str:
        """What its α is in Mitsuba's words, unless it was taken for something else."""
        return self.taken_for or self.distribution

    def is_already(self, target: str) -> bool:
        """Return whether it has a distribution, and its numbers are those of it."""
        return not self.other_lobe and self.distribution == self.source == target

    @property
    def numbers(self) -> list[float]:
        """Its α that are no textures."""
        return [each.value for each in self.roughness if each.value is not None]

    @property
    def textures(self) -> list[Element]:
        """The textures of its α."""
        return [each.holder for each in self.roughness if each.textured and each.holder is not None]


class MitsubaScene:
    """What matters of a scene.

    Parameters
    ----------
    data : bytes
        The scene.
    taken_for : str
        What every number that is given as α is, whatever the distribution says, as
        `mdfconv.convert` names it; "" if the distributions say it.

    Attributes
    ----------
    root : str
        The name of its outermost element.
    version : int or None
        The first number of the version, 0 for Mitsuba 0.6; None if there is none.
    bsdfs : list of Bsdf
        Those with a roughness, in order; what cannot be converted has a problem.
    right_already : list of (Element, str)
        The first BSDF of each type whose roughness is right as it is, and in words whose it is.
    includes : list of Element
        What stands in other files.
    named : list of str
        All files that it names.
    uses : Counter
        How often each default or texture is used, by its element.

    Raises
    ------
    MdfconvError
        As `read_elements`.
    """

    def __init__(self, data: bytes, taken_for: str = "") -> None:
        self._taken_for = taken_for
        elements = read_elements(data)
        by_tag: defaultdict[str, list[Element]] = defaultdict(list)
        for element in elements:
            by_tag[element.tag].append(element)
        self.root = elements[0].tag
        version = re.match(r"\s*(\d{1,9})\b", elements[0].get("version"))
        self.version = int(version[1]) if version else None
        self.includes = by_tag["include"]
        self.named = [
            element.get("filename" if element.tag == "include" else "value")
            for element in elements
            if element.tag == "include"
            or (element.tag == "string" and element.get("name") == "filename")
        ]
        # Of several of one name Mitsuba takes the first.
        self._defaults = {each.get("name"): each for each in reversed(by_tag["default"])}
        identified = [each for each in by_tag["texture"] if "id" in each.attributes]
        self._textures = {each.get("id"): each for each in reversed(identified)}
        referred = Counter(each.get("id") for each in by_tag["ref"] + by_tag["alias"])
        self.uses = Counter({each: referred[name] for name, each in self._textures.items()})
        if by_tag["texture"]:
            # Those that stand in other objects; a scene only gives them an id.
            owners = (each for each in elements if each.children and each.tag != "scene")
            properties = (child for owner in owners for child in owner.children)
            self.uses.update(child for child in properties if child.tag == "texture")
        if b"$" in data:
            values = (value for each in elements for value in each.attributes.values())
            used = Counter(name for value in values for name in _PARAMETER.findall(value))
            self.uses.update({each: used[name] for name, each in self._defaults.items()})
        bsdfs = (self._bsdf(each) for each in by_tag["bsdf"])
        self.bsdfs = [bsdf for bsdf in bsdfs if bsdf]
        first = {each.get("type"): each for each in reversed(by_tag["bsdf"])}
        self.right_already = [
            (first[kind], f"the roughness of {kind} is {whose}")
            for kind, whose in _RIGHT_ALREADY.items()
            if kind in first
        ]

    def _bsdf(self, element: Element) -> Bsdf | None:
        """Return a BSDF whose roughness is to be looked at, None for others."""
        kind = element.get("type")
        if kind in _OTHER_LOBES:
            return self._of_another_lobe(element, _OTHER_LOBES[kind])
        if kind not in _TYPES:
            given = (child.get("name") for child in element.children)
            rough = " and ".join(filter(_ROUGHNESS_NAME.match, given))
            if kind in _RIGHT_ALREADY or not rough:
                return None
            problem = f"the BSDF {kind} is of no type that is converted: its {rough}"
            return Bsdf(element, problem=problem)
        bsdf = Bsdf(element)
        try:
            alphas = _properties(element)
            bsdf.named_by = alphas.pop("distribution", None)
            if bsdf.named_by is not None:
                bsdf.distribution = self._distribution(bsdf.named_by)
            if alphas.keys() not in _ALPHAS:
                names = " and ".join(alphas)
                raise MdfconvError(f"{names}: neither alpha alone nor alpha_u and alpha_v")
            bsdf.roughness = tuple([self._roughness(alphas[name]) for name in sorted(alphas)])
            if not alphas:
                # That of Mitsuba, whatever the numbers are that the scene gives.
                bsdf.roughness = (Roughness(_DEFAULT_ALPHA),)
            else:
                bsdf.taken_for = self._taken_for
        except MdfconvError as refusal:
            bsdf.problem = str(refusal)
        return bsdf

    def _of_another_lobe(self, element: Element, lobe: _OtherLobe) -> Bsdf:
        """Return a BSDF that is left, with its numbers, of which the nearest is named."""
        names = ((child.get("name"), child) for child in element.children)
        given = {_PROPERTIES.get(name, name): child for name, child in names}
        alphas = given.keys() & {"alpha", *_AXES} if lobe.number == "alpha" else set()
        roughness = []
        for name in _AXES if alphas & set(_AXES) else (lobe.number,):
            holder = given.get(name, given.get(lobe.number))
            try:
                value = lobe.default if holder is None else self._roughness(holder).value
            except MdfconvError:
                value = None
            roughness.append(Roughness(value, name=name))
        taken_for = (self._taken_for if alphas else "") or lobe.nearest
        return Bsdf(element, roughness=tuple(roughness), taken_for=taken_for, other_lobe=lobe.words)

    def _distribution(self, element: Element) -> str:
        written = element.get("value")
        name = written.strip().lower()
        if element.tag != "string" or name not in DISTRIBUTIONS:
            raise MdfconvError(f"distribution '{written}' is none of {', '.join(DISTRIBUTIONS)}")
        if name not in TARGETS and self.version:
            raise MdfconvError(
                f"distribution '{written}' is one of Mitsuba 0.6, not of {self.version}"
            )
        return name

    def _roughness(self, element: Element) -> Roughness:
        name, value = element.get("name"), element.get("value")
        if element.tag == "texture":
            return Roughness(None, element, textured=True)
        if element.tag == "ref":
            identifier = element.get("id")
            if identifier not in self._textures:
                raise MdfconvError(
                    f"{name} refers to '{identifier}', which is no texture in this file"
                )
            return Roughness(None, self._textures[identifier], textured=True)
        if element.tag != "float":
            raise MdfconvError(f"{name} is a {element.tag}, not a float")
        if "$" not in value:
            return Roughness(_number(name, value), element)
        parameter = _PARAMETER.fullmatch(value.strip())
        if not parameter:
            raise MdfconvError(f"{name} '{value}' is not a number")
        default = self._defaults.get(parameter[1])
        if default is None:
            raise MdfconvError(
                f"{name} is the parameter {parameter[1]}, which has no default in this file"
            )
        number = _number(f"the default of {parameter[1]},", default.get("value"))
        return Roughness(number, default, parameter[1])

    def bitmap_file(self, texture: Element) -> Element:
        """Return the property that names the file of a texture whose texels are the α themselves.

        Mitsuba takes 8 and 16 bits for sRGB unless ``raw`` is true (0.6: ``gamma`` is 1); OpenEXR
        is linear.

        Raises
        ------
        MdfconvError
            If it is not such a texture.
        """
        kind = texture.attributes.get("type")
        if kind != "bitmap":
            raise MdfconvError(f"alpha is a texture of type {kind}, and only bitmaps are converted")
        properties = {child.get("name"): child for child in texture.children}
        file = properties.get("filename")
        name = file.get("value") if file else ""
        if file is None or not name or "$" in name:
            raise MdfconvError("alpha is a bitmap without a filename, or with one of a parameter")
        values = {key: child.get("value").strip().lower() for key, child in properties.items()}
        gamma = values.get("gamma", "")
        raw = values.get("raw") == "true" and self.version != 0
        linear = _NUMBER.match(gamma) and float(gamma) == 1 and self.version in (0, None)
        if not (raw or linear or name.lower().endswith(".exr")):
            setting = 'gamma="1"' if self.version == 0 else 'raw="true"'
            raise MdfconvError(
                f"Mitsuba takes {name} for sRGB, as it is without {setting}: add that if it holds "
                "alpha"
            )
        return file

    def leave_what_others_use(self, pending: Sequence[Bsdf]) -> None:
        """Give a problem to BSDFs whose default or texture cannot be changed for all that use it.

        Those that are to be converted may be left for another reason, and have a problem already.
        """
        users: dict[Element, list[tuple[Bsdf, Roughness]]] = {}
        for bsdf in pending:
            for roughness in () if bsdf.problem else bsdf.roughness:
                if roughness.holder is not None and (roughness.textured or roughness.parameter):
                    users.setdefault(roughness.holder, []).append((bsdf, roughness))
        unsettled = [holder for holder, group in users.items() if self._others_use(holder, group)]
        while unsettled:
            for bsdf, roughness in users.pop(unsettled.pop(), []):
                if not bsdf.problem:
                    bsdf.problem = self._shared_problem(roughness)
                    unsettled += [each.holder for each in bsdf.roughness if each.holder is not None]

    def _others_use(self, holder: Element, users: list[tuple[Bsdf, Roughness]]) -> bool:
        """Return whether what is shared may be more than the α of BSDFs that convert alike."""
        nameless = holder.tag == "texture" and "id" not in holder.attributes
        return (
            len(users) != self.uses[holder]
            or len({bsdf.source for bsdf, _ in users}) > 1
            or (bool(self.includes) and not nameless)
        )

    def _shared_problem(self, roughness: Roughness) -> str:
        assert roughness.holder is not None
        name = roughness.parameter or roughness.holder.get("id")
        what = f"the {'parameter' if roughness.parameter else 'texture'} {name}"
        if self.includes:
            return f"alpha is {what}, which an included file may use, too"
        return f"alpha is {what}, which is not only that of BSDFs converted alike"


def _properties(bsdf: Element) -> dict[str, Element]:
    """Return the properties that make the roughness, by their names in Mitsuba 3."""
    properties: dict[str, Element] = {}
    for child in bsdf.children:
        name = _PROPERTIES.get(child.get("name"))
        if name in properties:
            raise MdfconvError(f"{name} is given twice")
        if name is not None:
            properties[name] = child
    return properties


def _number(name: str, text: str) -> float:
    if not _NUMBER.match(text.strip()):
        raise MdfconvError(f"{name} '{text}' is not a number")
    return float(text)
