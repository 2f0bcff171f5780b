"""The interactive page: a source and its substitute side by side, in one file of HTML.

All numbers are computed here, as tables that the page interpolates; `page.html` is the template.
"""

from __future__ import annotations

import base64
import html
import json
from collections.abc import Callable
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import DTypeLike

from mdfconv import __version__
from mdfconv.brdf.microfacet import direction, half_vector
from mdfconv.conversion import convert
from mdfconv.conversion.explanation import remaining_error
from mdfconv.distributions import Distribution
from mdfconv.distributions.endpoint import Endpoint, stored_forms
from mdfconv.distributions.evaluation import Array, gauss_panels
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import Metric, list_metrics, metric_named
from mdfconv.fitting.metrics.base import srgb
from mdfconv.light.spectrum import LobeSpectrum
from mdfconv.output.files import file_bytes
from mdfconv.render.comparison import Scene
from mdfconv.render.comparison_figure import BACKGROUND
from mdfconv.render.sphere import LIGHTS, MARGIN, VIEW, Lights, cross_section, radiance

_TEMPLATE = "page.html"
# What the template has in the place of its title and of the data.
_TITLE, _DATA = "@title@", "@data@"
# The metric with which the page begins: light from all around is the usual case.
_FIRST_METRIC = "environment"
# Of a converted parameter, relative: with four digits shown the number is within 0.1 %.
_CONVERTED_ERROR = 2e-4
# Of stored numbers: relative, and absolute beside that.
_STORED_ERROR = 3e-4, 5e-6
# Nodes of ln p to begin with; at a jump they are no nearer to each other than this.
_NODES = 65
_FORM_NODES = 17
_NARROWEST_STEP = 1e-6
# Parameters at which the error that remains is shown.
_ERROR_NODES = 33
# Of lobes: parameters, and angles in u = t/(1 + t), t = tan β / α with D(0) = 1/(π α²).
_PARAMETERS, _ANGLES = 48, 96
# What is less than e to this of D(0) is not told from 0.
_LEAST_LOG = -24.0
# On both sides of a clamp, relative: a rule may have a step there.
_BESIDE_CLAMP = 1e-9
_LIGHT_LABELS = {"directional": "the sun", "area": "a square lamp"}
# Where the peak of the source's picture is sampled: parameters, and points of a section.
_PEAKS, _SECTION_POINTS = 64, 41
# The highest degree of the environment.
_DEGREE = 16
# The environment as the sphere mirrors it: rows of the angle from the viewer, and azimuths.
_ROWS, _AZIMUTHS = 25, 48
# Of the integrals over the environment: nodes in the height, and azimuths.
_HEIGHTS, _AROUND = 32, 64
# Of the curves of screens: entries, and the light that the filmic one shows as white.
_CURVE_ENTRIES = 4096
_FILMIC_WHITE = 16.0


def comparison_page(source: Endpoint, target: Endpoint, start: float | None = None) -> bytes:
    """Return the page that compares a distribution with another in its place.

    Parameters
    ----------
    source : Endpoint
        The distribution that is converted. The page shows its parameter itself.
    target : Endpoint
        What it is converted to, in the form that the page shows first.
    start : float, optional
        What the page shows first, in the form in which the source stores it; the typical
        parameter if not given.

    Raises
    ------
    MdfconvError
        If the start is illegal or outside the typical range, or there is no conversion.
    """
    parameter = None if start is None else source.decode_one(start)
    return filled(page_data(Endpoint(source.distribution), target, parameter))


def page_data(source: Endpoint, target: Endpoint, start: float | None = None) -> dict[str, Any]:
    """Return all that the page shows, as JSON takes it; as `comparison_page`."""
    first, last = source.distribution, target.distribution
    low, high = first.parameter.typical
    start = first.parameter.typical_value if start is None else start
    if not low <= start <= high:
        raise MdfconvError(
            f"the page shows {first.parameter.symbol} from {low:g} to {high:g}, not {start:g}"
        )
    tables, span, error = _conversions(first, last)
    return {
        "title": f"{last.label} in place of {first.label}",
        "version": __version__,
        "source": _end(source) | {"start": float(start)} | _lobes(first, low, high),
        "target": _end(target) | _lobes(last, *span),
        "metrics": tables,
        "interpolation": float(f"{error:.2g}"),
        "forms": _forms(last, *span),
        "lights": [_light(name, LIGHTS[name], first) for name in LIGHTS.names],
        "environment": _environment(),
        "curves": _curves(),
        "margin": MARGIN,
        "background": BACKGROUND,
        "view": VIEW.tolist(),
    }


def _end(end: Endpoint) -> dict[str, Any]:
    mdf = end.distribution
    return {
        "name": mdf.name,
        "form": end.label,
        "label": mdf.label,
        "symbol": mdf.parameter.symbol,
        "parameter": mdf.parameter.name,
    }


def filled(data: dict[str, Any]) -> bytes:
    """Return the template with its title and data, in which no text is taken for a tag."""
    text = json.dumps(data, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    template = files(__package__).joinpath(_TEMPLATE).read_text(encoding="utf-8")
    page = template.replace(_TITLE, html.escape(data["title"]))
    return file_bytes(page.replace(_DATA, text.replace("<", "\\u003c")).rstrip())


def _packed(values: Any, kind: DTypeLike) -> str:
    """Return an array as the base64 text of its little-endian bytes."""
    array = np.ascontiguousarray(values, dtype=np.dtype(kind).newbyteorder("<"))
    return base64.b64encode(array.tobytes()).decode()


def _rounded(values: Array, digits: int = 8) -> list[Any]:
    """Return an array as lists of numbers with few digits, for they are read as text."""
    return [_rounded(v, digits) if np.ndim(v) else float(f"{v:.{digits}g}") for v in values]


def _grid(low: float, high: float, count: int) -> Array:
    """Return parameters from one to another, in equal steps of the logarithm."""
    return np.exp(np.linspace(np.log(low), np.log(high), count))


def _refined(
    function: Callable[[Array], Array], nodes: Array, relative: float, absolute: float
) -> tuple[Array, Array, float]:
    """Halve steps of ln p until a function is as good as linear in each, but for narrow jumps.

    The function returns shape (k, n), NaN where there is no value. Return the nodes, its values
    there, and the largest error in the middle of a step that is no jump.
    """
    values = function(nodes)
    while True:
        middle = 0.5 * (nodes[:-1] + nodes[1:])
        between = function(middle)
        error = np.abs(0.5 * (values[:, :-1] + values[:, 1:]) - between)
        none = np.isnan(values[:, :-1]) & np.isnan(values[:, 1:])
        linear = none | (error <= relative * np.abs(between) + absolute)
        bad = ~linear.all(axis=0) & (np.diff(nodes) > _NARROWEST_STEP)
        if not bad.any():
            return nodes, values, float(np.max(error, where=linear & ~none, initial=0))
        order = np.argsort(np.concatenate([nodes, middle[bad]]))
        nodes = np.concatenate([nodes, middle[bad]])[order]
        values = np.concatenate([values, between[:, bad]], axis=1)[:, order]


def _conversions(
    source: Distribution, target: Distribution
) -> tuple[list[dict[str, Any]], tuple[float, float], float]:
    """Return the conversions over the source's typical range under every metric.

    Beside them the range of the target's parameters, and the largest relative error of linear
    interpolation between their logarithms.
    """
    names = dict.fromkeys([_FIRST_METRIC, *list_metrics()])
    rows = [_conversion(source, target, metric_named(name)) for name in names]
    logs = np.concatenate([logs for _, logs, _ in rows])
    span = float(np.exp(logs.min())), float(np.exp(logs.max()))
    return [table for table, _, _ in rows], span, max(error for _, _, error in rows)


def _conversion(
    source: Distribution, target: Distribution, metric: Metric
) -> tuple[dict[str, Any], Array, float]:
    """Return ln p of the target, ``parameter``, at ln p of the source, ``nodes``.

    The errors that remain are at parameters of the source in equal steps of ln p. Beside the table
    ln p of the target as it is, and the error of linear interpolation.
    """
    ends = Endpoint(source), Endpoint(target)
    low, high = source.parameter.typical

    def converted(logs: Array) -> Array:
        # The ends of the range, whose logarithm is rounded, are inside of it.
        parameter = np.clip(np.exp(logs), low, high)
        return np.log(convert(parameter, *ends, metric=metric))[None, :]

    start = np.log(_grid(low, high, _NODES))
    nodes, (logs,), error = _refined(converted, start, 0, _CONVERTED_ERROR)
    values = _grid(low, high, _ERROR_NODES)
    results = convert(values, *ends, metric=metric)
    rmse, maximum = remaining_error(source, values, target, results, metric)
    table = {
        "name": str(metric),
        "keeps": metric.keeps,
        "nodes": _packed(nodes, np.float64),
        "parameter": _packed(logs, np.float32),
        "rmse": _rounded(rmse, 4),
        "maximum": _rounded(maximum, 4),
    }
    return table, logs, error


def _lobes(mdf: Distribution, low: float, high: float) -> dict[str, Any]:
    """Return a distribution's lobes over a range of its parameter, and how they blur.

    ``low`` and ``high`` are ln p, and for parameters in equal steps of ln p between them there are
    ``alpha`` (ln α) and ``peak`` (ln D(0)); ``lobes``, as 16-bit numbers from ``least`` to
    ``most``, ln D/D(0) at ``angles`` angles in equal steps of u; ``spectrum``, k_l by degree from
    1, as 32-bit numbers.
    """
    parameter = _grid(low, high, _PARAMETERS)
    alpha = np.asarray(mdf.peak_alpha(parameter))
    u = np.linspace(0, 1, _ANGLES)
    with np.errstate(divide="ignore"):
        beta = np.arctan(alpha[:, None] * u / (1 - u))
        logs = np.log(mdf.normalized(beta, parameter[:, None]))
    relative = np.maximum(logs - logs[:, :1], _LEAST_LOG)
    # A rough lobe may be highest away from the normal.
    most = float(relative.max())
    spectrum = LobeSpectrum(_DEGREE)(mdf, parameter[:, None])[:, :_DEGREE]
    return {
        "low": float(np.log(low)),
        "high": float(np.log(high)),
        "alpha": _rounded(np.log(alpha)),
        "peak": _rounded(logs[:, 0]),
        "least": _LEAST_LOG,
        "most": most,
        "angles": _ANGLES,
        "lobes": _packed(np.rint(65535 * (relative - _LEAST_LOG) / (most - _LEAST_LOG)), np.uint16),
        "spectrum": _packed(spectrum, np.float32),
    }


def _forms(mdf: Distribution, low: float, high: float) -> list[dict[str, Any]]:
    """Return the forms in which the parameter is stored, over a range of it.

    Their ``values`` are those at ``nodes``, ln p, between which they are interpolated linearly, and
    NaN where the parameter cannot be stored. The first is the parameter itself, which is at hand.
    """
    return [
        {
            "name": end.label,
            "symbol": end.stored.symbol,
            "formula": end.encoding.formula if end.encoding else "",
            "clamped": "; ".join(end.clamped(np.empty(0))),
        }
        | _tabulated(end, low, high)
        for end in (Endpoint(mdf), *(end for end, _ in stored_forms(mdf)))
    ]


def _tabulated(end: Endpoint, low: float, high: float) -> dict[str, str]:
    """Return a stored form in as few steps of ln p as it takes."""
    if not end.encoding:
        return {"nodes": "", "values": ""}
    limits = [clamp.limit for clamp in end.encoding.clamps]
    beside = [limit * (1 + side) for limit in limits for side in (-_BESIDE_CLAMP, 0, _BESIDE_CLAMP)]
    inside = [value for value in beside if low < value < high]
    start = np.log(np.unique(np.concatenate([_grid(low, high, _FORM_NODES), inside])))

    def stored(logs: Array) -> Array:
        return end.encode(np.exp(logs))[None]

    nodes, values, _ = _refined(stored, start, *_STORED_ERROR)
    return {"nodes": _packed(nodes, np.float64), "values": _packed(values[0], np.float32)}


def _light(name: str, light: Lights, source: Distribution) -> dict[str, Any]:
    """Return (x, y, z, w) of each sample, and the picture's peak over the source's range.

    w is what the viewer gets through the half vector for D = 1: irradiance, F and the constants of
    the BRDF. The peak is a logarithm, at parameters in equal steps of ln p.
    """
    half = half_vector(light.directions, VIEW)
    typical = source.parameter.typical_value
    surface = Scene().surface(source, typical)
    weights = [
        radiance(normal[None, :], surface, Lights(toward[None, :], irradiance[None]))[0]
        for normal, toward, irradiance in zip(half, light.directions, light.irradiance, strict=True)
    ]
    through = np.array(weights) / float(source.normalized(0.0, typical))
    grid = _grid(*source.parameter.typical, _PEAKS).tolist()
    peaks = [_peak(source, parameter, light, half) for parameter in grid]
    return {
        "label": _LIGHT_LABELS.get(name, name),
        "directions": _rounded(np.column_stack([light.directions, through])),
        "peak": _rounded(np.log(peaks)),
    }


def _peak(source: Distribution, parameter: float, light: Lights, half: Array) -> float:
    """Return the maximum of the picture, on the section through the highlight or in a sample."""
    width = min(4 * float(source.peak_alpha(parameter)), 1.0)
    normals = np.concatenate([cross_section(_SECTION_POINTS, width)[1], half])
    surface = Scene().surface(source, parameter)
    return float(radiance(normals, surface, light).max())


def _environment() -> dict[str, Any]:
    """Return a small landscape as the sphere mirrors it, by degree of spherical harmonics.

    There are ``rows`` of the mirrored direction's angle from the viewer, 0 to π, and ``azimuths``
    from the x axis; for the degrees from 1 ``scales`` and ``maps`` of 8-bit numbers. A lobe's
    picture is the mean and the sum over degrees of k_l, scale and map.
    """
    theta = np.linspace(0, np.pi, _ROWS)
    phi = 2 * np.pi * np.arange(_AZIMUTHS) / _AZIMUTHS
    seen = direction(*np.meshgrid(theta, phi, indexing="ij")).reshape(-1, 3)
    parts = _by_degree(seen)
    parts /= parts.sum(axis=0).max()
    scales = np.abs(parts[1:]).max(axis=1) / 127
    return {
        "rows": _ROWS,
        "azimuths": _AZIMUTHS,
        "mean": float(parts[0].mean()),
        "scales": _rounded(scales),
        "maps": _packed(np.rint(parts[1:] / scales[:, None]), np.int8),
    }


def _by_degree(seen: Array) -> Array:
    """Return the parts of the landscape, a row for each degree from 0.

    A part is (2l+1)/(4π) ∫ L(ω) P_l(ω·ω') dω, by the addition theorem; P_l by its recurrence.
    """
    height, weight = gauss_panels(np.array([[-1.0, 1.0]]), _HEIGHTS)
    azimuth = 2 * np.pi * (np.arange(_AROUND) + 0.5) / _AROUND
    # The poles of the quadrature are above and below, as those of the landscape.
    z, phi = np.meshgrid(height[0], azimuth, indexing="ij")
    level = np.sqrt(1 - z * z)
    nodes = np.stack([level * np.cos(phi), z, level * np.sin(phi)], axis=-1).reshape(-1, 3)
    light = _landscape(nodes) * np.repeat(weight[0], _AROUND) * 2 * np.pi / _AROUND
    cosine = seen @ nodes.T
    before, now = np.ones_like(cosine), cosine
    parts = []
    for degree in range(_DEGREE + 1):
        # Lanczos' factor keeps what is cut off from ringing.
        share = (2 * degree + 1) / (4 * np.pi) * np.sinc(degree / (_DEGREE + 1))
        parts.append(share * (before @ light))
        step = (2 * degree + 3) * cosine * now - (degree + 1) * before
        before, now = now, step / (degree + 2)
    return np.array(parts)


def _landscape(toward: Array) -> Array:
    """Return the radiance from directions with y up: sky, sun behind haze, hills, ground."""
    x, y, z = np.moveaxis(toward, -1, 0)
    azimuth = np.arctan2(x, z)
    hills = 0.12 + 0.1 * np.sin(3 * azimuth + 1) + 0.06 * np.sin(7 * azimuth)
    sky = 0.35 + 0.25 * (1 - np.clip(y, 0, 1)) ** 3
    clouds = 0.25 * np.clip(np.sin(5 * x + 2) * np.sin(6 * z - 1) * np.sin(4 * y + 1), 0, 1)
    sun = direction(0.9, 2.3)
    haze = 6 * np.exp(-(1 - toward @ sun) / 0.02)
    ground = 0.1 + 0.05 * np.sin(9 * x) * np.sin(8 * z)
    return np.where(y > hills, sky + clouds + haze, np.where(y > 0, 0.04, ground))


def _curves() -> list[dict[str, Any]]:
    """Return the curves from linear light to a screen's 8 bits.

    Of each ``entries``, for light in equal steps of its root from 0 to ``white``, those are said at
    which the levels from 1 to 255 start.
    """
    root = np.linspace(0, 1, _CURVE_ENTRIES)
    filmic = _filmic(_FILMIC_WHITE * np.square(root))
    curves = ("sRGB", 1.0, np.square(root)), ("filmic", _FILMIC_WHITE, filmic)
    levels = np.arange(1, 256)
    return [
        {
            "label": label,
            "white": white,
            "entries": _CURVE_ENTRIES,
            "starts": _packed(np.searchsorted(np.rint(255 * srgb(shown)), levels), np.uint16),
        }
        for label, white, shown in curves
    ]


def _filmic(light: Array) -> Array:
    """Return the fit to the ACES tone curve of Narkowicz 2015, which rises to just above 1."""
    return np.clip(light * (2.51 * light + 0.03) / (light * (2.43 * light + 0.59) + 0.14), 0, 1)
