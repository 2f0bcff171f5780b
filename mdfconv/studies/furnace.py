"""The white furnace: how much of the light that comes from everywhere alike is reflected.

The directional albedo ∫ f(l, v) cos θ_l dω_l of a surface that absorbs nothing is 1. It is
integrated by quadrature on panels that end where the integrand has its kinks (the horizon) and
shrink towards its peak (the mirror image, or the half vector along the normal).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from mdfconv.brdf import microfacet, reflection
from mdfconv.brdf.fresnel import Fresnel, lossless
from mdfconv.brdf.microfacet import Brdf, Microsurface, direction, dot, reflect
from mdfconv.distributions import distribution
from mdfconv.distributions.evaluation import Array, gauss_legendre, gauss_panels
from mdfconv.errors import MdfconvError
from mdfconv.output.figures import PAGE, encoded, new_figure
from mdfconv.output.records import csv_text, markdown_text
from mdfconv.registry import Registry
from mdfconv.studies.pages import PageFiles, fill, pivot, tracked


def cosine_lobe(axis: Array, exponent: float, u1: Array, u2: Array) -> Array:
    """Draw directions around an axis with density (γ+1)/(2π) cos^γ (Lafortune & Willems 1994).

    Around the normal and with γ = 1 the draw is cosine-weighted; u₁ and u₂ are uniform on [0, 1).
    """
    # 1 − cos θ = −expm1(ln(1−u)/(γ+1)) keeps the digits of narrow lobes.
    drop = -np.expm1(np.log1p(-u1) / (exponent + 1))
    local = direction(2 * np.arcsin(np.sqrt(0.5 * drop)), 2 * np.pi * u2)
    drawn: Array = np.einsum("...i,...ij->...j", local, microfacet.frames(axis))
    return drawn


def cosine_lobe_density(axis: Array, exponent: float, omega: Array) -> Array:
    """Return the density of `cosine_lobe`."""
    drop = 0.5 * np.square(omega - axis).sum(axis=-1)
    inside = drop < 1
    power = np.exp(exponent * np.log1p(-np.where(inside, drop, 0)))
    return np.where(inside, (exponent + 1) / (2 * np.pi) * power, 0)


def reflected_density(half_density: Array, view: Array, m: Array) -> Array:
    """Return the density of reflected directions for that of half vectors: p/(4 |v·m|)."""
    cosine = np.abs(dot(view, m))
    return half_density / (4 * np.where(cosine > 0, cosine, np.inf))


def energy_response(alpha: float) -> float:
    """Return ∫∫ sin θ cos θ D(θ/2) dθ dφ = 2π (½ + ½α² ln α − ¼α² ln(α²+2)).

    D is the article's, (α + 4 sin²β/α)^(−2), which is not normalized. The article prints
    ½ + α² ln α − ½α² ln(1+α²), which is not this integral.
    """
    square = alpha * alpha
    logarithms = 0.5 * np.log(alpha) - 0.25 * np.log(square + 2)
    return float(2 * np.pi * (0.5 + square * logarithms))


def printed_energy_response(alpha: float) -> float:
    """Return the article's expression for the energy response, as printed."""
    square = alpha * alpha
    return float(0.5 + square * np.log(alpha) - 0.5 * square * np.log1p(square))


# Gauss's rule of this order on panels that grow by this factor, from a fiftieth of the peak's
# width on, leaves an error of 1e-8; of order 8 it leaves 2e-7.
_ORDER = 12
_GROWTH = 2.5
_FIRST_PANEL = 0.02
# Where the integrand ends like a root the panels shrink to this, whose share is below rounding.
_LEAST_PANEL = 1e-8
# The peak is about 1/width², and divided by small cosines.
_LEAST_WIDTH = 1e-140
# Nearer to grazing rounding shows, and the limit is within 1e-6 from here on.
_LEAST_COSINE = 1e-8
# With some 500 nodes for each azimuth the intermediates of as many stay in the cache.
_AZIMUTHS_AT_ONCE = 32


@dataclass(frozen=True)
class FurnaceModel:
    """A BRDF with what the integration must know of it.

    `width` is about the angle, in radians, over which it falls from its peak, which surrounds the
    mirror image of the viewer (Phong) or, in half vectors, the normal (microfacets). `sample`
    takes (view, u₁, u₂) to light directions and their density, 1/sr. Beyond `edge`, tan β of the
    half vector, the BRDF is 0.
    """

    brdf: Brdf
    width: float
    around_mirror: bool
    sample: Callable[[Array, Array, Array], tuple[Array, Array]]
    edge: float = np.inf


def directional_albedo(model: FurnaceModel, cosine: Array) -> Array:
    """Integrate f cos θ_l over the hemisphere, to 1e-8; with V-cavities to 1e-6.

    Parameters
    ----------
    model : FurnaceModel
        The BRDF.
    cosine : numpy.ndarray, shape (n,)
        Cosines of the viewer with the normal, 0 < cos θ ≤ 1; at 0 the limit is approached.

    Returns
    -------
    numpy.ndarray, shape (n,)
        The share of the light that is reflected.

    Raises
    ------
    MdfconvError
        If the lobe is so narrow that no float holds its peak.
    """
    if model.width < _LEAST_WIDTH:
        raise MdfconvError(f"a lobe of {model.width:.2g} rad is a mirror: its peak overflows")
    integrate = _around_mirror if model.around_mirror else _around_normal
    clipped = np.clip(cosine, _LEAST_COSINE, 1)
    return np.array([integrate(model, float(value)) for value in clipped])


def sampled_albedo(
    model: FurnaceModel, cosine: Array, count: int, seed: int
) -> tuple[Array, Array]:
    """Return means and standard errors of f cos θ_l / p over `count` ≥ 2 drawn directions.

    There is one of each for every cosine of the viewer; `seed` is that of the random numbers.
    """
    random = np.random.default_rng(seed)
    estimates = []
    for value in np.maximum(cosine, _LEAST_COSINE).tolist():
        view = np.broadcast_to(_viewer(value), (count, 3))
        light, density = model.sample(view, *random.random((2, count)))
        reflected = model.brdf(light, view) * light[..., 2]
        weight = np.where(density > 0, reflected / np.where(density > 0, density, 1), 0)
        estimates.append((weight.mean(), weight.std(ddof=1) / np.sqrt(count)))
    albedo, error = np.array(estimates).reshape(-1, 2).T
    return albedo, error


def _viewer(cosine: float) -> Array:
    return np.array([np.sqrt((1 - cosine) * (1 + cosine)), 0.0, cosine])


def _around_normal(model: FurnaceModel, cosine: float) -> float:
    """Integrate over half vectors m = (t cos φ, t sin φ, 1)/√(1+t²), dω_l = 4 (v·m) dω_m.

    The light is above the horizon for t < t_h(φ), the positive root of c t² − 2 s cos φ t − c.
    """
    sine = np.sqrt((1 - cosine) * (1 + cosine))
    phi, phi_weight = _azimuths(cosine)
    along = sine * np.cos(phi)
    root = np.hypot(along, cosine)
    # The root without the difference of two nearly equal numbers.
    horizon = np.where(along > 0, (along + root) / cosine, cosine / (root + np.abs(along)))
    kinks = np.column_stack([_kinks(along, cosine), np.full(phi.size, model.edge)])
    total = 0.0
    view = _viewer(cosine)
    for rows in np.array_split(np.arange(phi.size), max(1, phi.size // _AZIMUTHS_AT_ONCE)):
        t, weight = _from_zero(horizon[rows], kinks[rows], model.width)
        theta = np.arctan(t)
        m = direction(theta, phi[rows, None])
        light = reflect(view, m)
        jacobian = 4 * dot(m, view) * np.sin(theta) * np.square(np.cos(theta))
        value = model.brdf(light, view) * light[..., 2]
        total += float(phi_weight[rows] @ np.sum(value * jacobian * weight, axis=1))
    # The two halves of the circle are alike.
    return 2 * total


def _azimuths(cosine: float) -> tuple[Array, Array]:
    """Return φ on [0, π] and weights; at grazing the horizon turns within cos θ around π/2."""
    steps = _growing(min(cosine, 1.0) * 0.2, np.pi / 2)
    edges = np.concatenate([np.pi / 2 - steps[::-1], np.pi / 2 + steps[1:]])
    return gauss_panels(edges, _ORDER)


def _kinks(along: Array, cosine: float) -> Array:
    """Return the t where light and viewer are level, and where V-cavities begin to mask either.

    n·l = n·v at t = s cos φ/c, 2 (n·m)(n·v) = v·m at t = c/(s cos φ), and 2 (n·m)(n·l) = v·m
    where tan 3θ_m = −c/(s cos φ); shape (n, 3).
    """
    slope = np.where(np.abs(along) > 0, along, 1e-300) / cosine
    third = np.tan((np.pi - np.arctan2(1, slope)) / 3)
    with np.errstate(over="ignore"):
        return np.abs(np.stack([slope, 1 / slope, third], axis=1))


def _from_zero(end: Array, kinks: Array, width: float) -> tuple[Array, Array]:
    """Return nodes and weights on [0, end] for each row, dense around 0 on the scale of a width.

    Panels end at the kinks, too.
    """
    largest = float(np.max(end))
    edges = _growing(min(_FIRST_PANEL * width, largest), largest)
    every = np.concatenate([np.broadcast_to(edges, (end.size, edges.size)), kinks], axis=1)
    rows = np.sort(np.minimum(every, end[:, None]), axis=1)
    return gauss_panels(rows, _ORDER)


def _growing(first: float, end: float) -> Array:
    """Return 0, then points that grow by a factor from the first to the end."""
    count = max(1, int(np.ceil(np.log(end / first) / np.log(_GROWTH))))
    return np.concatenate([[0.0], np.geomspace(first, end, count + 1)])


def _around_mirror(model: FurnaceModel, cosine: float) -> float:
    """Integrate over directions at θ_r from the mirror image, in rings cut by the horizon.

    With φ from the azimuth of the mirror image upwards, cos θ_l = c cos θ_r + s sin θ_r cos φ.
    """
    sine = np.sqrt((1 - cosine) * (1 + cosine))
    grazing = np.arctan2(cosine, sine)  # from the mirror image down to the horizon
    theta, theta_weight = _rings(grazing, model.width)
    ratio = cosine * np.cos(theta) / np.maximum(sine * np.sin(theta), 1e-300)
    # Rings beyond the horizon end at this azimuth from the highest point.
    last = np.arccos(np.clip(-ratio, -1, 1))
    x, w = gauss_legendre(4 * _ORDER)
    phi = 0.5 * last[:, None] * (1 + x)
    weight = 0.5 * last[:, None] * w
    view = _viewer(cosine)
    mirrored = np.array([-view[0], 0.0, view[2]])
    up, side = np.array([view[2], 0.0, view[0]]), np.array([0.0, 1.0, 0.0])
    ring = np.cos(phi)[..., None] * up + np.sin(phi)[..., None] * side
    light = np.cos(theta)[:, None, None] * mirrored + np.sin(theta)[:, None, None] * ring
    value = model.brdf(light, view) * light[..., 2]
    rings = np.sum(value * weight, axis=1) * np.sin(theta)
    return float(2 * theta_weight @ rings)


def _rings(grazing: float, width: float) -> tuple[Array, Array]:
    """Return θ_r on [0, π/2] and weights, dense at 0, at π/2 and around the horizon.

    At π/2 a lobe with a broken exponent ends like a root.
    """
    end = np.pi / 2
    lobe = _growing(min(_FIRST_PANEL * width, end), end)
    root = _growing(_LEAST_PANEL, end)
    near = np.hstack([grazing - lobe, grazing + lobe, grazing - root, grazing + root, end - root])
    edges = np.unique(np.concatenate([lobe, near[(near > 0) & (near < end)]]))
    return gauss_panels(edges, _ORDER)


@dataclass(frozen=True)
class _Definition:
    """A BRDF by name: how it is built, the one option that it has, and its distribution."""

    name: str
    build: Callable[..., FurnaceModel]
    option: str
    distribution: str


_REGISTRY: Registry[_Definition] = Registry("BRDF")
# Why a BRDF does not take an option.
_WITHOUT = {"normalizer": "{} has no normalizer", "masking": "the masking of {} is part of it"}


def furnace_model(
    name: str, parameter: float, *, normalizer: str | None = None, masking: str | None = None
) -> FurnaceModel:
    """Return a BRDF for the white-furnace test, its Fresnel term 1.

    Parameters
    ----------
    name : str
        One of `list_models`.
    parameter : float
        Exponent of the Phong BRDFs, the distribution's parameter of the others.
    normalizer : str, optional
        Of modified Phong: a name in `mdfconv.brdf.reflection.NORMALIZERS`; "usual" by default.
    masking : str, optional
        Of BRDFs that have the name of a distribution but smoothie and ashikhmin-shirley: a name in
        `mdfconv.brdf.microfacet.MASKINGS`; "correlated" by default.

    Raises
    ------
    MdfconvError
        If a name is not known, does not apply, or the parameter is illegal.
    """
    definition = _REGISTRY[name]
    options = {"normalizer": normalizer, "masking": masking}
    chosen = {option: value for option, value in options.items() if value is not None}
    for option in chosen:
        if option != definition.option:
            others = ", ".join(other.name for other in _REGISTRY if other.option == option)
            reason = _WITHOUT[option].format(definition.name)
            raise MdfconvError(reason, f"it can be chosen for {others}")
    return definition.build(float(parameter), **chosen)


def model_distribution(name: str) -> str:
    """Return the distribution whose parameter a BRDF takes; "" for an exponent of Phong's."""
    return _REGISTRY[name].distribution


def list_models() -> list[str]:
    """Return the names of the BRDFs."""
    return _REGISTRY.names


def _masked(surface: Microsurface, fresnel: Fresnel, masking: str = "correlated") -> Brdf:
    return reflection.microfacet(surface, fresnel, microfacet.MASKINGS[masking](surface))


def _facet_model(
    owner: str, brdf: Callable[..., Brdf], parameter: float, **options: str
) -> FurnaceModel:
    """Return the model of a BRDF in half vectors, sampled by the facets of its surface."""
    surface = Microsurface(distribution(owner), parameter)

    def sample(view: Array, u1: Array, u2: Array) -> tuple[Array, Array]:
        if surface.has_visible_normals:
            m = surface.visible_normals(view, u1, u2)
            density = surface.visible_normal_density(view, m)
        else:
            m = surface.half_vectors(u1, u2)
            density = surface.half_vector_density(m)
        density = np.where(dot(view, m) > 0, density, 0)
        return reflect(view, m), reflected_density(density, view, m)

    width = float(surface.distribution.peak_alpha(parameter))
    edge = surface.distribution.edge(np.array([parameter]))
    # At m = 1 Schlick's is π/2, but for rounding.
    end = np.inf if edge is None or edge[0] >= np.pi / 2 else float(np.tan(edge[0]))
    return FurnaceModel(brdf(surface, lossless, **options), width, False, sample, end)


def _mirror_model(brdf: Callable[..., Brdf], exponent: float, **options: str) -> FurnaceModel:
    """Return the model of a BRDF around the mirror image of the viewer."""

    def sample(view: Array, u1: Array, u2: Array) -> tuple[Array, Array]:
        axis = microfacet.mirrored(view)
        light = cosine_lobe(axis, exponent, u1, u2)
        return light, cosine_lobe_density(axis, exponent, light)

    return FurnaceModel(brdf(exponent, **options), 1 / np.sqrt(exponent + 1), True, sample)


def _register(name: str, brdf: Callable[..., Brdf], owner: str = "", option: str = "") -> None:
    """Register a BRDF by the owner of its facets, and under all names of that if it has its."""
    build = partial(_facet_model, owner, brdf) if owner else partial(_mirror_model, brdf)
    definition = _Definition(name, build, option, owner)
    if owner == name:
        mdf = distribution(name)
        # A distribution's alias may be a BRDF of its own: phong.
        aliases = [alias for alias in mdf.aliases if alias not in _REGISTRY.names]
        _REGISTRY.add(name, definition, aliases, mdf.meant_by)
    else:
        meant = distribution("blinn-phong").meant_by if not owner else {}
        _REGISTRY.add(name, definition, meant_by=dict.fromkeys(meant, "phong"))


_register("ggx", _masked, "ggx", "masking")
_register("beckmann", _masked, "beckmann", "masking")
_register("phong", reflection.original)
_register("modified-phong", reflection.modified, option="normalizer")
_register("smoothie", reflection.smoothie, "smoothie")
_register("smoothie-approx", reflection.smoothie_approx, "smoothie")
_register("ashikhmin-shirley", reflection.ashikhmin_shirley, "ashikhmin-shirley")
for _name in ("gauss", "schlick", "sawicki", "blinn-phong"):
    _register(_name, _masked, _name, "masking")


_COSINES = np.linspace(0, 1, 21)
# The rows of the cosines that the page shows: 0, 0.1, 0.5 and 1.
_SHOWN = {"grazing": 0, "nearly_grazing": 2, "oblique": 10, "normal": 20}
_GAMMA, _ALPHA = 20.0, 0.5
_EXACT = ("Phong: modified, Arvo", "Phong: modified, Mallett & Yuksel")
_Model = tuple[str, float, dict[str, str]]
_Models = dict[str, _Model]


def _modified(normalizer: str) -> _Model:
    return "modified-phong", _GAMMA, {"normalizer": normalizer}


def _smooth_and_rough(*names: str) -> _Models:
    return {f"{name} {alpha:g}": (name, alpha, {}) for name in names for alpha in (0.1, 1.0)}


# Panels of the figure by name: the title, and for each curve a label and its model.
_PANELS: dict[str, tuple[str, _Models]] = {
    "Phong": (
        f"Phong, γ = {_GAMMA:g}",
        {
            "original": ("phong", _GAMMA, {}),
            "modified, usual": _modified("usual"),
            "modified, Arvo": _modified("arvo"),
            "modified, Mallett & Yuksel": _modified("mallett-yuksel"),
        },
    ),
    "GGX": (
        f"GGX, α = {_ALPHA:g}, by masking",
        {name: ("ggx", _ALPHA, {"masking": name}) for name in microfacet.MASKINGS.names},
    ),
    "GGX and Beckmann": ("GGX and Beckmann, correlated", _smooth_and_rough("ggx", "beckmann")),
    "Smoothie": ("Smoothie", _smooth_and_rough("smoothie", "smoothie-approx")),
}
_RESPONSE_ALPHAS = (0.01, 0.1, 0.25, 0.5, 1.0)


def furnace() -> PageFiles:
    """Return the white furnace of the BRDFs."""
    albedos: dict[str, dict[str, list[float]]] = {panel: {} for panel in _PANELS}
    models = [(panel, *model) for panel, (_, some) in _PANELS.items() for model in some.items()]
    for panel, label, (name, parameter, options) in tracked(models):
        model = furnace_model(name, parameter, **options)
        albedos[panel][label] = directional_albedo(model, _COSINES).tolist()
    columns = {
        f"{panel}: {label}": values
        for panel, curves in albedos.items()
        for label, values in curves.items()
    }
    shown = [
        (name, f"cos θ = {_COSINES[row]:g}", f"{values[row]:.4g}")
        for name, values in columns.items()
        for row in _SHOWN.values()
    ]
    responses = [
        {"α": alpha, "integral": energy_response(alpha), "printed": printed_energy_response(alpha)}
        for alpha in _RESPONSE_ALPHAS
    ]
    page = fill(
        "furnace",
        largest=max(map(max, albedos["Smoothie"].values())),
        albedos=pivot("BRDF", shown),
        responses=markdown_text(list(responses[0]), responses),
        **{
            angle: {name: values[row] for name, values in columns.items()}
            for angle, row in _SHOWN.items()
        },
    )
    rows = [
        {"cos_theta": float(cosine)}
        | {name: float(f"{values[row]:.8g}") for name, values in columns.items()}
        for row, cosine in enumerate(_COSINES)
    ]
    error = max(abs(albedo - 1) for name in _EXACT for albedo in columns[name])
    titled = {title: albedos[panel] for panel, (title, _) in _PANELS.items()}
    picture = draw_albedo(_COSINES.tolist(), titled)
    return PageFiles([page, csv_text(list(rows[0]), rows), picture], {"error": error})


def draw_albedo(
    cosine: Sequence[float], panels: Mapping[str, Mapping[str, Sequence[float]]]
) -> bytes:
    """Return a figure of albedos over the viewer's cosine: by panel and label."""
    rows = (len(panels) + 1) // 2
    columns = min(2, len(panels))
    width = PAGE[0] * (1.45 if columns > 1 else 1)
    figure = new_figure(width, PAGE[1] * 0.72 * rows + 0.6)
    axes = figure.subplots(rows, columns, squeeze=False)
    dashes = ["-", (0, (5, 2)), (0, (5, 2, 1, 2)), (0, (1, 1.5)), (0, (8, 2)), (0, (3, 3))]
    for axis, (title, curves) in zip(axes.flat, panels.items(), strict=True):
        for number, (label, albedo) in enumerate(curves.items()):
            style = {"color": f"C{number}", "linestyle": dashes[number % len(dashes)]}
            axis.plot(cosine, albedo, label=label, linewidth=1.5, **style)
        highest = max(max(albedo) for albedo in curves.values())
        axis.set(xlabel="cos θ of the viewer", ylabel="directional albedo", title=title)
        axis.set(xlim=(0, 1), ylim=(0, min(max(1.05, 1.05 * highest), 1.6)))
        axis.legend(loc="best")
    return encoded(figure, dpi=110)
