"""Distributions exchanged in one picture, and how far the pictures differ."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mdfconv.brdf.fresnel import schlick_fresnel
from mdfconv.brdf.materials import Fresnel, material
from mdfconv.conversion import convert
from mdfconv.conversion.residual import lobe_reach
from mdfconv.distributions import distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import Metric, metric, srgb
from mdfconv.reports.error_curves import DRAWN
from mdfconv.reports.sphere import Frame, cross_section, lights, microfacet, radiance
from mdfconv.reports.text import rounded_rows

_SECTION_POINTS = 401
_REC_709 = np.array([0.2126, 0.7152, 0.0722])  # luminance of linear R, G, B (ITU-R BT.709)
# Sawicki 2021, captions of Figures 4 and 5: the surfaces of Figures 1 and 2.
PAPER_FIGURES = {"fig4": 0.4, "fig5": 0.04464}


@dataclass(frozen=True)
class Scene:
    """What is rendered: everything but the distributions.

    Parameters
    ----------
    brdf : str
        A name in `mdfconv.brdf.reflection.BRDFS`.
    light : str
        ``"directional"`` or ``"area"``.
    normalized : bool
        Which form of D.
    exposure : float
        Where the reference's peak is displayed: 1 is white.
    size : int
        Pixels a side.
    material : str, optional
        The material's name, a metal or a plastic; without one F is Schlick's with F₀ = 0.04.
    """

    brdf: str = "ashikhmin-shirley"
    light: str = "directional"
    normalized: bool = True
    exposure: float = 1.0
    size: int = 256
    material: str | None = None

    @property
    def fresnel(self) -> Fresnel:
        """F of a cosine."""
        return material(self.material).fresnel if self.material else schlick_fresnel


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
        if self.method == "fit":
            return f"fit {self.metric.name} ({self.metric.keeps.split()[0]})"
        return f"{self.method} (shape)" if self.method == "closed-form" else self.method


def default_rules(exposure: float) -> list[Rule]:
    """Return the paper's conversion (shape), and the fits that keep the light and the picture."""
    return [
        Rule("closed-form", metric("unit")),
        Rule("fit", metric("energy")),
        Rule("fit", metric("display", exposure)),
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
        found = []
        exposure = self.scene.exposure
        shown = self.reference.displayed(exposure)
        for rule, renderings in self.rows.items():
            for entry in renderings:
                linear = _rmse(entry.image, self.reference.image)
                display = _rmse(entry.displayed(exposure), shown)
                found.append(
                    {
                        "conversion": rule,
                        "distribution": entry.name,
                        "parameter": entry.parameter,
                        "rmse_linear": linear,
                        "psnr_linear": _psnr(linear),
                        "rmse_displayed": display,
                        "psnr_displayed": _psnr(display),
                        "peak_ratio": float(entry.image.max() / self.reference.image.max()),
                        "energy_ratio": float(entry.image.sum() / self.reference.image.sum()),
                    }
                )
        return found

    def section_rows(self) -> tuple[list[str], list[dict[str, float]]]:
        """Return the cross-section as columns and rows: position, then luminances."""
        columns = {"position_radii": self.position, self.reference.name: self.reference.section}
        for rule, renderings in self.rows.items():
            columns |= {f"{entry.name}, {rule}": entry.section for entry in renderings}
        return list(columns), rounded_rows(columns)


def compare(
    m_b: float, rules: Sequence[Rule], scene: Scene, names: Sequence[str] = DRAWN
) -> Comparison:
    """Render Beckmann and its substitutes.

    Parameters
    ----------
    m_b : float
        Beckmann's parameter.
    rules : sequence of Rule
        How it is converted.
    scene : Scene
        What is rendered.
    names : sequence of str
        The substitutes.

    Raises
    ------
    MdfconvError
        If the scene makes no sense or a conversion has no answer.
    """
    if not 16 <= scene.size <= 4096:
        raise MdfconvError("the size of a picture is from 16 to 4096 pixels")
    if not (np.isfinite(scene.exposure) and scene.exposure > 0):
        raise MdfconvError("the exposure is a positive number")
    parameter = float(distribution("beckmann").parameter.check(m_b, "beckmann"))
    converted = {
        rule.label: [
            (name, float(convert(parameter, "beckmann", name, rule.method, metric=rule.metric)))
            for name in names
        ]
        for rule in rules
    }
    reach = float(lobe_reach(distribution("beckmann"), np.asarray(parameter)))
    position, normals = cross_section(_SECTION_POINTS, min(reach, 1.0))
    reference = _render("beckmann", parameter, scene, normals)
    if reference.image.max() < 0.5 * reference.section.max():
        raise MdfconvError(
            f"the highlight of beckmann m_B = {parameter:g} falls between the pixels: raise --size"
        )
    # The pixel at the highlight need not hit the peak; the section's is as good a unit.
    peak = max(reference.image.max(), reference.section.max())
    pixels = reference.image.reshape(*reference.image.shape[:-2], -1)
    unit = max(_luminance(pixels).max(), _luminance(reference.section).max())

    def relative(entry: Rendering) -> Rendering:
        section = _luminance(entry.section) / unit
        return replace(entry, image=entry.image / peak, section=section)

    return Comparison(
        scene,
        relative(reference),
        {
            label: [relative(_render(name, value, scene, normals)) for name, value in pairs]
            for label, pairs in converted.items()
        },
        position,
    )


def _render(name: str, parameter: float, scene: Scene, normals: Array) -> Rendering:
    """Return the picture and the section, both in colour and not yet relative to a peak."""
    surface = microfacet(
        distribution(name),
        parameter,
        scene.brdf,
        normalized=scene.normalized,
        fresnel=scene.fresnel,
    )
    light = lights(scene.light)
    image = Frame(scene.size).render(surface, light)
    return Rendering(name, parameter, image, radiance(normals, surface, light))


def _luminance(light: Array) -> Array:
    """Return the luminance of light of shape (n,), or (3, n) in colour."""
    return light if light.ndim == 1 else np.tensordot(_REC_709, light, 1)


def _rmse(one: Array, other: Array) -> float:
    return float(np.sqrt(np.mean(np.square(one - other))))


def _psnr(rmse: float) -> float:
    """Return the peak signal-to-noise ratio in dB for a peak of 1; at most 200."""
    return float(-20 * np.log10(max(rmse, 1e-10)))
