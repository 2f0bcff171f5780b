"""What the shell completes: every name that an option takes.

Each function goes to Typer's ``autocompletion``, which keeps what begins as the word does. What a
name is looked up in is imported when the shell asks.
"""

from __future__ import annotations

import io
import os
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stdout

_COLON = ":"


def _names(place: str) -> Callable[[], list[str]]:
    """Return what lists the names at a place of the package, those of records by their ``name``."""

    def names() -> list[str]:
        from pkgutil import resolve_name

        known = resolve_name(f"mdfconv.{place}")
        listed = known() if callable(known) else known
        return [str(getattr(each, "name", each)) for each in listed]

    return names


distributions = _names("distributions:list_distributions")
methods = _names("conversion:list_methods")
metrics = _names("fitting.metrics:list_metrics")
languages = _names("formula:LANGUAGES.names")
mtl_targets = _names("scene.mtl.library:To.__members__")
mitsuba_targets = _names("scene.mitsuba.scene:TARGETS")
angle_units = _names("measured.samples:UNITS")
normalizers = _names("brdf.reflection:NORMALIZERS.names")
maskings = _names("brdf.microfacet:MASKINGS.names")
materials = _names("brdf.fresnel:list_materials")


def endpoints(incomplete: str) -> list[str]:
    """Return the names of the distributions; once a colon is typed, those of the encodings."""
    from mdfconv.distributions import list_distributions
    from mdfconv.distributions.endpoint import encodings_of

    known = {mdf.name: mdf for mdf in list_distributions()}
    if incomplete in known and encodings_of(known[incomplete]):
        return [*known, *_encoded(incomplete)]
    return _encoded(incomplete.partition(_COLON)[0]) if _COLON in incomplete else [*known]


def _encoded(name: str) -> list[str]:
    from mdfconv.distributions import distribution
    from mdfconv.distributions.endpoint import encodings_of
    from mdfconv.errors import MdfconvError

    try:
        return [f"{name}{_COLON}{encoding}" for encoding in encodings_of(distribution(name))]
    except MdfconvError:
        return []


def targets(incomplete: str) -> list[str]:
    """Return what a conversion can go to: distributions and encodings, and all of them."""
    from mdfconv.registry import ALL

    return [*endpoints(incomplete), ALL]


def texels(incomplete: str) -> list[str]:
    """Return what the texels of a texture can be."""
    from mdfconv.distributions import list_distributions
    from mdfconv.scene.texture.rule import TextureRule

    encodings = TextureRule("", "").encodings
    return [
        *endpoints(incomplete),
        *(
            f"{mdf.name}{_COLON}{each.name}"
            for mdf in list_distributions()
            for each in encodings(mdf)
        ),
    ]


def gltf_sources(incomplete: str) -> list[str]:
    """Return what the numbers of a glTF file can be."""
    from mdfconv.scene.gltf.asset import AUTO

    return [AUTO, *endpoints(incomplete)]


def library_sources() -> list[str]:
    """Return what Ns of a material library can be."""
    from mdfconv.distributions.dialects import DIALECTS
    from mdfconv.scene.mtl.meaning import AUTO, is_of_libraries
    from mdfconv.scene.shininess import SHININESS

    stored = filter(is_of_libraries, DIALECTS)
    return [AUTO, SHININESS, *(f"{SHININESS}:{each.name}" for each in stored)]


def furnace_brdfs(incomplete: str) -> list[str]:
    """Return the BRDFs that the furnace takes; once a colon is typed, the forms of a parameter."""
    from mdfconv.studies.furnace import list_models, model_distribution

    brdf, colon, _ = incomplete.partition(_COLON)
    if not colon:
        return list_models()
    owner = model_distribution(brdf) if brdf in list_models() else ""
    return [f"{brdf}{form.removeprefix(owner)}" for form in _encoded(owner)]


def fresnel_factors() -> list[str]:
    """Return the Fresnel factors that are fitted; an index is a number of one's own."""
    from mdfconv.measured.model import FRESNELS

    return [name.removesuffix("N") for name in FRESNELS]


@contextmanager
def whole_words() -> Iterator[None]:
    """Let names with a colon be completed in bash, which takes a colon for the end of a word.

    Bash gives ``ggx:rou`` as the three words ``ggx``, ``:`` and ``rou``, and puts what is printed
    in the place of the last one only.
    """
    words = os.environ.get("COMP_WORDS", "").split("\n")
    if "bash" not in os.environ.get("_MDFCONV_COMPLETE", "") or _joined(words) == words:
        yield
        return
    current = int(os.environ["COMP_CWORD"])
    words += [""] * (current + 1 - len(words))
    until_here = _joined(words[: current + 1])
    os.environ["COMP_WORDS"] = "\n".join(_joined(words))
    os.environ["COMP_CWORD"] = str(len(until_here) - 1)
    printed = io.StringIO()
    try:
        with redirect_stdout(printed):
            yield
    finally:
        before = until_here[-1][: until_here[-1].rfind(_COLON) + 1]
        names = printed.getvalue().splitlines()
        sys.stdout.write("\n".join(name.removeprefix(before) for name in names))


def _joined(words: list[str]) -> list[str]:
    """Return words, those that colons divide as one each."""
    return re.sub(rf"\n?{_COLON}\n?", _COLON, "\n".join(words)).split("\n")
