"""Distributions exchanged in one picture, and how far the pictures differ."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mdfconv.brdf.directions import Brdf
from mdfconv.brdf.fresnel import schlick_fresnel
from mdfconv.brdf.materials import material
from mdfconv.brdf.microsurface import Microsurface
from mdfconv.brdf.reflection import BRDFS
from mdfconv.conversion import convert, method_named
from mdfconv.distributions import distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.distributions.parameter import number_text
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import Metric, metric_named
from mdfconv.fitting.metrics.display import srgb
from mdfconv.output.records import rounded_rows
from mdfconv.paper.error_curves import DRAWN, PAPER_SETS, lobe_extent
from mdfconv.render.sphere import LIGHTS, Frame, cross_section, radiance

_SECTION_POINTS = 401
_SIZES = (16, 4096)  # pixels a side: from where the sphere shows up to what memory holds
_REC_709 = np.array([0.2126, 0.7152, 0.0722])  # luminance of linear R, G, B (ITU-R BT.709)
# Where the pixels that are nearest to the highlight miss more than half of its height, a picture
# says nothing of it.
_LEAST_PEAK = 0.5
# A difference of less than this is the rounding of the conversion: 200 dB.
_LEAST_RMSE = 1e-10
# The distribution that the others stand for: the first of the paper's sets.
REFERENCE = next(iter(PAPER_SETS["fig1"]))
# Sawicki 2021, captions of Figures 4 and 5: the surfaces of Figures 1 and 2.
PAPER_FIGURES = {"fig4": PAPER_SETS["fig1"][REFERENCE], "fig5": PAPER_SETS["fig2"][REFERENCE]}
# What a rule keeps whose metric does not say it, in a word that fits beside a row of pictures.
_KEPT = {"closed-form": "shape"}


@dataclass(frozen=True)
class Scene:
    """What is rendered: everything but the distributions.

    Parameters
    ----------
    brdf : str
        A name in `mdfconv.brdf.reflection.BRDFS`.
    light : str
        A name in `mdfconv.render.sphere.LIGHTS`.
    normalized : bool
        Which form of D.
    exposure : float
        Where the reference's peak is displayed: 1 is white.
    size : int
        Pixels a side, 16 to 4096.
    material : str, optional
        The material's name, a metal or a plastic; without one F is Schlick's with F₀ = 0.04.

    Raises
    ------
    MdfconvError
        If the size or the exposure makes no sense.
    """

    brdf: str = "ashikhmin-shirley"
    light: str = "directional"
    normalized: bool = True
    exposure: float = 1.0
    size: int = 256
    material: str | None = None

    def __post_init__(self) -> None:
        least, largest = _SIZES
        if not least <= self.size <= largest:
            raise MdfconvError(f"the size of a picture is from {least} to {largest} pixels")
        if not (np.isfinite(self.exposure) and self.exposure > 0):
            raise MdfconvError("the exposure is a positive number")

    def surface(self, name: str, parameter: float) -> Brdf:
        """Return the BRDF with a distribution put in."""
        fresnel = material(self.material).fresnel if self.material else schlick_fresnel
        facets = Microsurface(distribution(name), parameter, self.normalized)
        return BRDFS[self.brdf](facets, fresnel)


@dataclass(frozen=True)
class Rule:
    """One way to convert the parameters: a row of the contact sheet.

    Parameters
    ----------
    method : str
        The conversion method.
    metric : Metric
        What it keeps, for the method ``"fit"``.
    """

    method: str
    metric: Metric

    @property
    def label(self) -> str:
        """The rule and what it keeps, in words."""
        if method_named(self.method).follows_metric:
            return f"{self.method} {self.metric.name} ({self.metric.word})"
        return f"{self.method} ({_KEPT[self.method]})" if self.method in _KEPT else self.method


def default_rules(exposure: float) -> list[Rule]:
    """Return the paper's conversion (shape), and the fits that keep the light and the picture."""
    return [
        Rule("closed-form", metric_named("unit")),
        Rule("fit", metric_named("energy")),
        Rule("fit", metric_named(f"display:{exposure}")),
    ]


@dataclass(frozen=True)
class Rendering:
    """One distribution's picture.

    Parameters
    ----------
    name : str
        The distribution.
    parameter : float
        Its parameter.
    image : numpy.ndarray, shape (size, size), or (3, size, size) in colour
        Linear light, relative to the reference's peak, in colour that of its brightest channel.
    section : numpy.ndarray, shape (n,)
        Luminance along the line through the highlight, relative to the reference's peak.
    """

    name: str
    parameter: float
    image: Array
    section: Array

    def displayed(self, exposure: float) -> Array:
        """Return the picture as a screen shows it, encoded, in [0, 1]."""
        return srgb(exposure * self.image)


@dataclass(frozen=True)
class Comparison:
    """A reference's picture and those of its substitutes under each rule.

    Parameters
    ----------
    scene : Scene
        What was rendered.
    reference : Rendering
        The picture that the others are compared with.
    rows : dict
        From rules in words to the substitutes' pictures.
    position : numpy.ndarray, shape (n,)
        Of the section, in radii.
    """

    scene: Scene
    reference: Rendering
    rows: Mapping[str, Sequence[Rendering]]
    position: Array

    def table(self) -> list[dict[str, Any]]:
        """Return for each picture its parameter and how far it is from the reference."""
        displayed = self.reference.displayed(self.scene.exposure)
        return [
            {
                "conversion": rule,
                "distribution": substitute.name,
                "parameter": substitute.parameter,
            }
            | self._errors(substitute, displayed)
            for rule, renderings in self.rows.items()
            for substitute in renderings
        ]

    def _errors(self, substitute: Rendering, displayed_reference: Array) -> dict[str, float]:
        image, reference = substitute.image, self.reference.image
        linear = _rmse(image, reference)
        displayed = _rmse(substitute.displayed(self.scene.exposure), displayed_reference)
        return {
            "rmse_linear": linear,
            "psnr_linear": _psnr(linear),
            "rmse_displayed": displayed,
            "psnr_displayed": _psnr(displayed),
            "peak_ratio": float(image.max() / reference.max()),
            "energy_ratio": float(image.sum() / reference.sum()),
        }

    def section_rows(self) -> tuple[list[str], list[dict[str, float]]]:
        """Return the cross-section as columns and rows: position, then luminances."""
        columns = {"position_radii": self.position, self.reference.name: self.reference.section}
        for rule, renderings in self.rows.items():
            columns |= {f"{shown.name}, {rule}": shown.section for shown in renderings}
        return list(columns), rounded_rows(columns)


def compare(
    parameter: float, rules: Sequence[Rule], scene: Scene, names: Sequence[str] = DRAWN
) -> Comparison:
    """Render the reference, which is Beckmann as in the paper, and its substitutes.

    Parameters
    ----------
    parameter : float
        The reference's parameter.
    rules : sequence of Rule
        How it is converted.
    scene : Scene
        What is rendered.
    names : sequence of str
        The substitutes.

    Raises
    ------
    MdfconvError
        If a conversion has no answer or the highlight is too small to be seen.
    """
    legal = distribution(REFERENCE).parameter.check_one(parameter, REFERENCE)
    converted = {
        rule.label: [
            (name, float(convert(legal, REFERENCE, name, rule.method, metric=rule.metric)))
            for name in names
        ]
        for rule in rules
    }
    extent = float(lobe_extent(distribution(REFERENCE), np.asarray(legal)))
    position, normals = cross_section(_SECTION_POINTS, min(extent, 1.0))
    substitutes = [pair for pairs in converted.values() for pair in pairs]
    rendered = _render([(REFERENCE, legal), *substitutes], scene, normals)
    relative = _scale(rendered[REFERENCE, legal])
    shown = {pair: relative(one) for pair, one in rendered.items()}
    rows = {label: [shown[pair] for pair in pairs] for label, pairs in converted.items()}
    return Comparison(scene, shown[REFERENCE, legal], rows, position)


def _render(
    surfaces: Iterable[tuple[str, float]], scene: Scene, normals: Array
) -> dict[tuple[str, float], Rendering]:
    """Return pictures and sections by distribution and parameter, not yet relative to a peak.

    All are drawn at once, as the directions are the same for all; and each but once.
    """
    distinct = list(dict.fromkeys(surfaces))
    brdfs = [scene.surface(*pair) for pair in distinct]

    def side_by_side(toward: Array, view: Array) -> Array:
        return np.stack([brdf(toward, view) for brdf in brdfs])

    light = LIGHTS[scene.light]
    images = Frame(scene.size).render(side_by_side, light)
    sections = radiance(normals, side_by_side, light)
    return {
        pair: Rendering(*pair, image, section)
        for pair, image, section in zip(distinct, images, sections, strict=True)
    }


def _scale(reference: Rendering) -> Callable[[Rendering], Rendering]:
    """Return what makes renderings relative to the reference's peak, and sections luminances.

    Raises
    ------
    MdfconvError
        If the picture misses the peak.
    """
    if reference.image.max() < _LEAST_PEAK * reference.section.max():
        symbol = distribution(reference.name).parameter.symbol
        raise MdfconvError(
            f"the highlight of {reference.name} {symbol} = {number_text(reference.parameter)} "
            "falls between the pixels of the picture",
            "a larger picture shows it",
            argument="size",
        )
    # The pixel at the highlight need not hit the peak; the section's is as good a unit.
    peak = max(reference.image.max(), reference.section.max())
    pixels = reference.image.reshape(*reference.image.shape[:-2], -1)
    brightest = max(_luminance(pixels).max(), _luminance(reference.section).max())
    return lambda rendering: replace(
        rendering,
        image=rendering.image / peak,
        section=_luminance(rendering.section) / brightest,
    )


def _luminance(light: Array) -> Array:
    """Return the luminance of light of shape (n,), or (3, n) in colour."""
    return light if light.ndim == 1 else np.tensordot(_REC_709, light, 1)


def _rmse(one: Array, other: Array) -> float:
    return float(np.sqrt(np.mean(np.square(one - other))))


def _psnr(rmse: float) -> float:
    """Return the peak signal-to-noise ratio in dB for a peak of 1; at most 200."""
    return float(-20 * np.log10(max(rmse, _LEAST_RMSE)))
