"""Mitsuba's scenes: the roughness of their BSDFs, and which of it can be changed on its own.

Mitsuba 0.6 (src/bsdfs/microfacet.h) and Mitsuba 3 (include/mitsuba/render/microfacet.h) take the
same properties: ``distribution``, which is beckmann if not given, and ``alpha``, 0.1 if not given,
or both ``alpha_u`` and ``alpha_v`` (0.6: ``alphaU`` and ``alphaV``).
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from mdfconv.errors import MdfconvError
from mdfconv.scene.mitsuba.xml_edit import Element, read_elements

# What Mitsuba's distributions are here. Those of 0.6 have an exponent for an α.
_EXPONENT = "blinn-phong:mitsuba-phong"
DISTRIBUTIONS = {"beckmann": "beckmann", "ggx": "ggx", "phong": _EXPONENT, "as": _EXPONENT}
TARGETS = ("ggx", "beckmann")
DEFAULT_DISTRIBUTION, DEFAULT_ALPHA = "beckmann", 0.1
# The plugin phong of 0.6, which has no microfacets: the exponent is of the reflected ray.
PHONG, PHONG_EXPONENT, _DEFAULT_EXPONENT = "phong", "blinn-phong:reflected", 30.0

_MICROFACET_TYPES = {"roughconductor", "roughdielectric", "roughplastic", "roughcoating"}
_AXES = ("alpha_u", "alpha_v")
# By the names of 0.6, too, which Mitsuba 3 reads in older scenes.
_PROPERTIES = {name: name for name in ("distribution", "alpha", *_AXES)} | {
    "alphaU": "alpha_u",
    "alphaV": "alpha_v",
}
_ALPHAS: tuple[set[str], ...] = (set(), {"alpha"}, set(_AXES))
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?\Z")
_PARAMETER = re.compile(r"\$(\w+)\Z")
_USED = re.compile(r"\$(\w+)")


@dataclass(eq=False)
class Roughness:
    """Where the α of a BSDF, of one axis or of both, comes from.

    Parameters
    ----------
    value : float
        The number; NaN of a texture.
    holder : Element or None
        What would be changed: the property, the default of a parameter, or the texture; None
        where the α is not given.
    parameter : str
        The parameter's name, "" if it is none.
    textured : bool
        Whether the holder is a texture.
    """

    value: float
    holder: Element | None = None
    parameter: str = ""
    textured: bool = False

    @property
    def shared(self) -> bool:
        """Whether others may use the holder, too."""
        return self.textured or bool(self.parameter)


@dataclass(eq=False)
class Bsdf:
    """A BSDF with a roughness.

    Parameters
    ----------
    element : Element
        Where it stands.
    distribution : str
        One of `DISTRIBUTIONS`; of the plugin phong `PHONG_EXPONENT`.
    named_by : Element or None
        The property that names the distribution; None if it is not given.
    roughness : tuple of Roughness
        One, or those of both axes.
    problem : str
        Why it is left as it is, "" if it is not.
    """

    element: Element
    distribution: str = DEFAULT_DISTRIBUTION
    named_by: Element | None = None
    roughness: tuple[Roughness, ...] = ()
    problem: str = ""

    @property
    def name(self) -> str:
        """Its id, or else its type."""
        attributes = self.element.attributes
        return attributes.get("id") or attributes.get("type", "")

    @property
    def source(self) -> str:
        """What its α or its exponent is, as `mdfconv.convert` names it."""
        return DISTRIBUTIONS.get(self.distribution, self.distribution)

    @property
    def numbers(self) -> list[float]:
        """Its α that are no textures."""
        return [each.value for each in self.roughness if not math.isnan(each.value)]

    @property
    def textures(self) -> list[Element]:
        """The textures of its α."""
        return [each.holder for each in self.roughness if each.textured and each.holder is not None]


@dataclass
class MitsubaScene:
    """What matters of a scene.

    Parameters
    ----------
    version : int or None
        The first number of the version, 0 for Mitsuba 0.6; None if there is none.
    bsdfs : list of Bsdf
        Those with a roughness, in order.
    includes : list of Element
        What stands in other files.
    named : list of str
        All files that it names.
    uses : Counter
        How often each default or texture is used, by its element.
    """

    version: int | None
    bsdfs: list[Bsdf] = field(default_factory=list)
    includes: list[Element] = field(default_factory=list)
    named: list[str] = field(default_factory=list)
    uses: Counter[Element] = field(default_factory=Counter)


def read_scene(data: bytes) -> MitsubaScene:
    """Return what matters of a scene, BSDFs that cannot be converted with their problems.

    Raises
    ------
    MdfconvError
        As `read_elements`.
    """
    elements = read_elements(data)
    names = _Names(elements, parameters=b"$" in data)
    version = re.match(r"\s*(\d{1,9})\b", elements[0].attributes.get("version", ""))
    scene = MitsubaScene(int(version[1]) if version else None, uses=names.uses)
    for element in elements:
        if element.tag == "include":
            scene.includes.append(element)
            scene.named.append(element.attributes.get("filename", ""))
        elif element.tag == "string" and element.attributes.get("name") == "filename":
            scene.named.append(element.attributes.get("value", ""))
        elif element.tag == "bsdf":
            kind = element.attributes.get("type")
            if kind in _MICROFACET_TYPES:
                scene.bsdfs.append(_microfacet_bsdf(element, scene.version, names))
            elif kind == PHONG:
                scene.bsdfs.append(_phong_bsdf(element, names))
    return scene


class _Names:
    """What is called by a name in a scene: parameters with defaults, and textures with ids."""

    def __init__(self, elements: list[Element], *, parameters: bool) -> None:
        # Of several defaults Mitsuba takes the first.
        self.defaults: dict[str, Element] = {}
        self.textures: dict[str, Element] = {}
        textures, referred = False, Counter[str]()
        for element in elements:
            tag = element.tag
            if tag == "default":
                self.defaults.setdefault(element.attributes.get("name", ""), element)
            elif tag == "texture":
                textures = True
                if "id" in element.attributes:
                    self.textures.setdefault(element.attributes["id"], element)
            elif tag in ("ref", "alias"):
                referred[element.attributes.get("id", "")] += 1
        self.uses = Counter({element: referred[name] for name, element in self.textures.items()})
        if textures:
            self.uses.update(_properties_that_are_textures(elements))
        if parameters:
            used = Counter(_parameters_used(elements))
            self.uses.update({element: used[name] for name, element in self.defaults.items()})


def _properties_that_are_textures(elements: list[Element]) -> Iterator[Element]:
    """Yield the textures that stand in other objects; a scene only gives them an id."""
    for element in elements:
        if element.children and element.tag != "scene":
            yield from (child for child in element.children if child.tag == "texture")


def _parameters_used(elements: list[Element]) -> Iterator[str]:
    for element in elements:
        for value in element.attributes.values():
            if "$" in value:
                yield from _USED.findall(value)


def _microfacet_bsdf(element: Element, version: int | None, names: _Names) -> Bsdf:
    bsdf = Bsdf(element)
    try:
        alphas = _properties(element)
        bsdf.named_by = alphas.pop("distribution", None)
        if bsdf.named_by is not None:
            bsdf.distribution = _distribution(bsdf.named_by, version)
        if alphas.keys() not in _ALPHAS:
            given = " and ".join(alphas)
            raise MdfconvError(f"{given}: neither alpha alone nor alpha_u and alpha_v")
        bsdf.roughness = tuple([_roughness(alphas[name], names) for name in sorted(alphas)])
        if not alphas:
            bsdf.roughness = (Roughness(DEFAULT_ALPHA),)
    except MdfconvError as refusal:
        bsdf.problem = str(refusal)
    return bsdf


def _properties(bsdf: Element) -> dict[str, Element]:
    """Return the properties that make the roughness, by their names in Mitsuba 3."""
    found: dict[str, Element] = {}
    for child in bsdf.children:
        name = _PROPERTIES.get(child.attributes.get("name", ""))
        if name in found:
            raise MdfconvError(f"{name} is given twice")
        if name is not None:
            found[name] = child
    return found


def _distribution(element: Element, version: int | None) -> str:
    written = element.attributes.get("value", "")
    name = written.strip().lower()
    if element.tag != "string" or name not in DISTRIBUTIONS:
        raise MdfconvError(f"distribution '{written}' is none of {', '.join(DISTRIBUTIONS)}")
    if name not in TARGETS and version is not None and version > 0:
        raise MdfconvError(f"distribution '{written}' is one of Mitsuba 0.6, not of {version}")
    return name


def _roughness(element: Element, names: _Names) -> Roughness:
    name, value = element.attributes["name"], element.attributes.get("value", "")
    if element.tag == "texture":
        return Roughness(math.nan, element, textured=True)
    if element.tag == "ref":
        identifier = element.attributes.get("id", "")
        if identifier not in names.textures:
            raise MdfconvError(f"{name} refers to '{identifier}', which is no texture in this file")
        return Roughness(math.nan, names.textures[identifier], textured=True)
    if element.tag != "float":
        raise MdfconvError(f"{name} is a {element.tag}, not a float")
    if "$" not in value:
        return Roughness(_number(name, value), element)
    parameter = _PARAMETER.match(value.strip())
    if not parameter:
        raise MdfconvError(f"{name} '{value}' is not a number")
    default = names.defaults.get(parameter[1])
    if default is None:
        raise MdfconvError(
            f"{name} is the parameter {parameter[1]}, which has no default in this file"
        )
    number = _number(f"the default of {parameter[1]},", default.attributes.get("value", ""))
    return Roughness(number, default, parameter[1])


def _number(name: str, text: str) -> float:
    if not _NUMBER.match(text.strip()):
        raise MdfconvError(f"{name} '{text}' is not a number")
    return float(text)


def _phong_bsdf(element: Element, names: _Names) -> Bsdf:
    bsdf = Bsdf(element, PHONG_EXPONENT)
    given = [child for child in element.children if child.attributes.get("name") == "exponent"]
    try:
        values = [_roughness(child, names).value for child in given] or [_DEFAULT_EXPONENT]
    except MdfconvError:
        values = [math.nan]
    bsdf.roughness = (Roughness(values[0]),)
    return bsdf


def bitmap_file(texture: Element, version: int | None) -> Element:
    """Return the property that names the file of a texture whose texels are the α themselves.

    Mitsuba takes 8 and 16 bits for sRGB unless ``raw`` is true (0.6: ``gamma`` is 1); OpenEXR is
    linear.

    Raises
    ------
    MdfconvError
        If it is not such a texture.
    """
    kind = texture.attributes.get("type")
    if kind != "bitmap":
        raise MdfconvError(f"alpha is a texture of type {kind}, and only bitmaps are converted")
    properties = {child.attributes.get("name"): child for child in texture.children}
    file = properties.get("filename")
    name = "" if file is None else file.attributes.get("value", "")
    if file is None or not name or "$" in name:
        raise MdfconvError("alpha is a bitmap without a filename, or with one of a parameter")
    values = {
        str(key): child.attributes.get("value", "").strip().lower()
        for key, child in properties.items()
    }
    raw = values.get("raw") == "true" and version != 0
    linear = _is_one(values.get("gamma", "")) and version in (0, None)
    if not (raw or linear or name.lower().endswith(".exr")):
        setting = 'gamma="1"' if version == 0 else 'raw="true"'
        raise MdfconvError(
            f"Mitsuba takes {name} for sRGB, as it is without {setting}: add that if it holds alpha"
        )
    return file


def _is_one(text: str) -> bool:
    return bool(_NUMBER.match(text)) and float(text) == 1


def leave_what_others_use(scene: MitsubaScene, pending: Sequence[Bsdf]) -> None:
    """Give a problem to BSDFs whose default or texture cannot be changed for all that use it.

    Those that are to be converted may be left for another reason, and have a problem already.
    """
    users: dict[Element, list[tuple[Bsdf, Roughness]]] = {}
    for bsdf in pending:
        if not bsdf.problem:
            for roughness in bsdf.roughness:
                if roughness.shared and roughness.holder is not None:
                    users.setdefault(roughness.holder, []).append((bsdf, roughness))
    unsettled = [holder for holder, group in users.items() if _others_use(scene, holder, group)]
    while unsettled:
        for bsdf, roughness in users.pop(unsettled.pop(), []):
            if not bsdf.problem:
                bsdf.problem = _shared_problem(scene, roughness)
                unsettled += [each.holder for each in bsdf.roughness if each.holder is not None]


def _others_use(scene: MitsubaScene, holder: Element, users: list[tuple[Bsdf, Roughness]]) -> bool:
    """Return whether what is shared may be more than the α of BSDFs that convert alike."""
    nameless = holder.tag == "texture" and "id" not in holder.attributes
    return (
        len(users) != scene.uses[holder]
        or len({bsdf.source for bsdf, _ in users}) > 1
        or (bool(scene.includes) and not nameless)
    )


def _shared_problem(scene: MitsubaScene, roughness: Roughness) -> str:
    assert roughness.holder is not None
    name = roughness.parameter or roughness.holder.attributes.get("id", "")
    what = f"the {'parameter' if roughness.parameter else 'texture'} {name}"
    if scene.includes:
        return f"alpha is {what}, which an included file may use, too"
    return f"alpha is {what}, which is not only that of BSDFs converted alike"
