"""Distributions exchanged in one picture, and how far the pictures differ."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mdfconv.brdf.fresnel import material, schlick_fresnel
from mdfconv.brdf.microfacet import Microsurface
from mdfconv.brdf.reflection import AROUND_MIRROR, BRDFS, BrdfSet, LobeBrdf
from mdfconv.conversion import convert, method_named
from mdfconv.distributions import Distribution
from mdfconv.distributions.endpoint import Endpoint, one_parameter_endpoint
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import Metric, metric_named
from mdfconv.fitting.metrics.base import srgb
from mdfconv.output.records import rounded_rows
from mdfconv.render import sphere
from mdfconv.render.sphere import LIGHTS, MARGIN, Frame, Lights

# Sawicki 2021, captions of Figures 1 and 2.
PAPER_SETS: Mapping[str, Mapping[str, float]] = {
    "fig1": {
        "beckmann": 0.4, "blinn-phong": 10, "gauss": 0.4364, "ggx": 0.4456, "sawicki": 12.04,
        "schlick": 0.4,
    },
    "fig2": {
        "beckmann": 0.04464, "blinn-phong": 1000, "gauss": 0.04471, "ggx": 0.05354,
        "sawicki": 1174.3, "schlick": 0.04464,
    },
}  # fmt: skip
DRAWN = ("blinn-phong", "gauss", "ggx", "sawicki", "schlick")
# 4.8 β_half is 4 m_B for Beckmann, the paper's habit.
_HALF_WIDTHS = 4.8
_SECTION_POINTS = 401
_SIZES = (16, 4096)  # pixels a side: from where the sphere shows up to what memory holds
_REC_709 = np.array([0.2126, 0.7152, 0.0722])  # luminance of linear R, G, B (ITU-R BT.709)
# Where the pixels that are nearest to the highlight miss more than half of its height, a picture
# says nothing of it.
_LEAST_PEAK = 0.5
# A difference of less than this is the rounding of the conversion: 200 dB.
_LEAST_RMSE = 1e-10
# The distribution that the paper's others stand for: the first of its sets.
REFERENCE = next(iter(PAPER_SETS["fig1"]))
# Sawicki 2021, captions of Figures 4 and 5: the surfaces of Figures 1 and 2.
PAPER_FIGURES = {"fig4": PAPER_SETS["fig1"][REFERENCE], "fig5": PAPER_SETS["fig2"][REFERENCE]}
# What a method without a metric keeps, in a word that fits beside a row of pictures.
_WORDS = {"closed-form": "shape"}


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

    def surface(self, mdf: Distribution, parameter: float) -> LobeBrdf:
        """Return the BRDF with a distribution put in."""
        fresnel = material(self.material).fresnel if self.material else schlick_fresnel
        facets = Microsurface(mdf, parameter, self.normalized)
        return BRDFS[self.brdf](facets, fresnel)

    def seen(self, lobes: Sequence[tuple[Distribution, float]]) -> tuple[BrdfSet, Lights]:
        """Return the BRDF with each distribution put in, and the light in samples for them all."""
        widths = np.fmin([mdf.half_width(parameter) for mdf, parameter in lobes], 1)
        width = float(np.sqrt(widths.min() * widths.max()))
        brdf = BrdfSet([self.surface(*lobe) for lobe in lobes], width)
        in_light = width * (1 if self.brdf in AROUND_MIRROR else 2)
        return brdf, LIGHTS[self.light].resolved(in_light)


@dataclass(frozen=True)
class PictureRule:
    """A row of the contact sheet: how the parameters are converted, with the metric of a fit."""

    method: str
    metric: Metric

    @property
    def label(self) -> str:
        """The rule and what it keeps, in words."""
        if method_named(self.method).follows_metric:
            return f"{self.method} {self.metric.name} ({self.metric.word})"
        return f"{self.method} ({_WORDS[self.method]})" if self.method in _WORDS else self.method


def default_rules(exposure: float) -> list[PictureRule]:
    """Return the paper's conversion (shape), and the fits that keep the light and the picture."""
    return [
        PictureRule("closed-form", metric_named("unit")),
        PictureRule("fit", metric_named("energy")),
        PictureRule("fit", metric_named(f"display:{exposure}")),
    ]


@dataclass(frozen=True)
class _Surface:
    """A distribution and its parameter, in the form that the user has and as it is."""

    end: Endpoint
    value: float

    @property
    def name(self) -> str:
        """The distribution and the form of its parameter, as the user writes it."""
        return self.end.label

    @property
    def value_text(self) -> str:
        """The parameter behind its symbol."""
        return self.end.text(self.value)

    @property
    def lobe(self) -> tuple[Distribution, float]:
        return self.end.distribution, self.end.decode_one(self.value)

    def converted(self, end: Endpoint, rule: PictureRule) -> _Surface:
        """Return the surface with another distribution."""
        value = convert(self.value, self.end, end, rule.method, metric=rule.metric)
        return _Surface(end, float(value))


@dataclass(frozen=True)
class Rendering(_Surface):
    """The pictures of one surface.

    Image and close-up, of the highlight alone, are linear light relative to the reference's peak,
    in shape (size, size), or (3, size, size) in colour; the section is the luminance along the line
    through the highlight.
    """

    image: Array
    closeup: Array
    section: Array

    def displayed(self, exposure: float) -> Array:
        """Return the picture as a screen shows it, encoded, in [0, 1]."""
        return srgb(exposure * self.image)


@dataclass(frozen=True)
class PictureComparison:
    """A reference's picture and those of its substitutes under each rule, by its words.

    `position` is that along the section, in radii; `frame` is what the close-ups show.
    """

    scene: Scene
    reference: Rendering
    rows: Mapping[str, Sequence[Rendering]]
    position: Array
    frame: Frame

    @property
    def magnification(self) -> int:
        """How many times the close-ups enlarge the pictures; 1 where they are the same."""
        return round(MARGIN / self.frame.half)

    def table(self) -> list[dict[str, Any]]:
        """Return for each picture its parameter and how far it is from the reference."""
        displayed = self.reference.displayed(self.scene.exposure)
        return [
            {"conversion": rule, "distribution": substitute.name, "parameter": substitute.value}
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

    def difference(self, substitute: Rendering) -> Array:
        """Return how much brighter a substitute's close-up is displayed, in [−1, 1].

        In colour it is the difference of the channel that differs most, so that 0 is equal.
        """
        exposure = self.scene.exposure
        difference = srgb(exposure * substitute.closeup) - srgb(exposure * self.reference.closeup)
        if difference.ndim == 2:
            return difference
        largest = np.abs(difference).argmax(axis=0, keepdims=True)
        return np.take_along_axis(difference, largest, axis=0)[0]

    def section_rows(self) -> tuple[list[str], list[dict[str, float]]]:
        """Return the cross-section as columns and rows: position, then luminances."""
        columns = {"position_radii": self.position, self.reference.name: self.reference.section}
        for rule, renderings in self.rows.items():
            columns |= {f"{shown.name}, {rule}": shown.section for shown in renderings}
        return list(columns), rounded_rows(columns)


def lobe_extent(distribution: Distribution, parameter: Array) -> Array:
    """Return the angle up to which the figures show a lobe: 4.8 β_half, at most π/2, radians."""
    extent = _HALF_WIDTHS * distribution.half_width(parameter)
    return np.where(extent <= np.pi / 2, extent, np.pi / 2)


def compare(
    value: float,
    rules: Sequence[PictureRule],
    scene: Scene,
    source: str | Endpoint = REFERENCE,
    targets: Sequence[str | Endpoint] = DRAWN,
) -> PictureComparison:
    """Render a surface and its substitutes.

    Parameters
    ----------
    value : float
        The parameter of the surface, in the form in which the source stores it.
    rules : sequence of PictureRule
        How it is converted.
    scene : Scene
        What is rendered.
    source, targets : str or Endpoint
        The surface's distribution and those that take its place, as `convert` takes them; as in
        the paper if not given.

    Raises
    ------
    MdfconvError
        If a conversion has no answer or the highlight is too small to be seen.
    """
    reference = _Surface(one_parameter_endpoint(source), float(value))
    ends = [one_parameter_endpoint(target) for target in targets]
    rows = {rule.label: [reference.converted(end, rule) for end in ends] for rule in rules}
    mdf, parameter = reference.lobe
    extent = float(lobe_extent(mdf, np.asarray(parameter)))
    extent = sphere.highlight_extent(extent, LIGHTS[scene.light])
    frame = _closeup_frame(extent, scene.size)
    position, normals = sphere.cross_section(_SECTION_POINTS, min(extent, 1.0))
    surfaces = [reference, *(surface for row in rows.values() for surface in row)]
    shown = _rendered(surfaces, scene, normals, frame)
    pictures = {label: [shown[surface] for surface in row] for label, row in rows.items()}
    return PictureComparison(scene, shown[reference], pictures, position, frame)


def _closeup_frame(extent: float, size: int) -> Frame:
    """Return what shows a highlight alone, or the sphere where that is no larger."""
    enlarged = int(MARGIN / np.sin(min(extent, 0.5 * np.pi)))
    x, y, _ = sphere.HIGHLIGHT.tolist()
    return Frame(size, (x, y), MARGIN / enlarged) if enlarged > 1 else Frame(size)


def _rendered(
    surfaces: Sequence[_Surface], scene: Scene, normals: Array, closeup: Frame
) -> dict[_Surface, Rendering]:
    """Return the renderings by surface, relative to the peak of the first one, the reference.

    All are drawn at once, as the directions are the same for all; and each lobe but once. Raise
    `MdfconvError` if the picture misses the peak.
    """
    lobes = {surface: surface.lobe for surface in surfaces}
    numbers = {lobe: number for number, lobe in enumerate(dict.fromkeys(lobes.values()))}
    brdf, light = scene.seen([*numbers])
    whole = Frame(scene.size)
    images = whole.render(brdf, light)
    closeups = images if closeup == whole else closeup.render(brdf, light)
    sections = sphere.radiance(normals, brdf, light)
    reference = surfaces[0]
    if images[0].max() < _LEAST_PEAK * sections[0].max():
        raise MdfconvError(
            f"the highlight of {reference.name} {reference.value_text} "
            "falls between the pixels of the picture",
            "a larger picture shows it",
            argument="size",
        )
    # The pixel at the highlight need not hit the peak; the section's is as good a unit.
    peak = max(images[0].max(), sections[0].max())
    pixels = images[0].reshape(*images[0].shape[:-2], -1)
    brightest = max(_luminance(pixels).max(), _luminance(sections[0]).max())
    shown = [
        (image / peak, enlarged / peak, _luminance(section) / brightest)
        for image, enlarged, section in zip(images, closeups, sections, strict=True)
    ]
    return {
        surface: Rendering(surface.end, surface.value, *shown[numbers[lobe]])
        for surface, lobe in lobes.items()
    }


def _luminance(light: Array) -> Array:
    """Return the luminance of light of shape (n,), or (3, n) in colour."""
    return light if light.ndim == 1 else np.tensordot(_REC_709, light, 1)


def _rmse(one: Array, other: Array) -> float:
    return float(np.sqrt(np.mean(np.square(one - other))))


def _psnr(rmse: float) -> float:
    """Return the peak signal-to-noise ratio in dB for a peak of 1; at most 200."""
    return float(-20 * np.log10(max(rmse, _LEAST_RMSE)))
